"""Paths mean what they meant when they were given, wherever the frames are made."""

import contextlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from every_format import FORMATS, NUMBERED
from scan_files import scanned_body
from sequences import assert_same, sea

import dynmesh
from dynmesh.cli.job_table import read_jobs
from dynmesh.scans import open_scans

N = 4


def filled(folder: Path, seed: int) -> Path:
    """A folder with a sequence in all formats, and what options name; others by another seed."""
    folder.mkdir()
    known = np.random.default_rng(seed).random((N, 144)) < 0.7
    known[0] = True
    whole = sea(N, 12, start=3)
    whole = replace(whole, vertices=whole.vertices * np.float32(1 + 0.05 * seed))
    partial = replace(whole, known=known)
    for format in FORMATS:
        suffix = dynmesh.formats.FORMATS[format].suffixes[0]
        (folder / format).mkdir()
        name = f"a_%d{suffix}" if format in NUMBERED else f"a{suffix}"
        dynmesh.write(folder / format / name, partial)
    dynmesh.write(folder / "whole.npz", whole)
    dynmesh.write(folder / "template.obj", whole[:1])
    np.save(folder / "known.npy", known)
    return folder


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    above = tmp_path_factory.mktemp("folders")
    return filled(above / "one", 0), filled(above / "other", 1)


NAME: dict[str, str] = {
    format: f"{format}/a{'_%d' if format in NUMBERED else ''}{of.suffixes[0]}"
    for format, of in dynmesh.formats.FORMATS.items()
}
Verb = Callable[[Callable[[str], Any]], Any]
"""Makes frames of paths, which are made of names in a folder."""


def _of(verb: Callable[..., Any], format: str) -> Verb:
    return lambda at: verb(at(NAME[format]))


VERBS: dict[str, Verb] = {
    **{f"open {f}": _of(dynmesh.open, f) for f in FORMATS},
    **{f"complete {f}": _of(dynmesh.complete, f) for f in FORMATS},
    "a folder": lambda at: dynmesh.complete(at("ply")),
    "a pattern": lambda at: dynmesh.open(at("obj/a_*.obj")),
    "convert": lambda at: dynmesh.convert(at("npz/a.npz"), scale=2),
    "degraded": lambda at: dynmesh.degrade(at("hdf5/a.h5"), known=0.5),
    "template": lambda at: dynmesh.complete(at("npz/a.npz"), template=at("template.obj")),
    "training": lambda at: dynmesh.complete(at("npz/a.npz"), training=[at("whole.npz")]),
    "known": lambda at: dynmesh.open(at("whole.npz"), known=at("known.npy")),
    "faces": lambda at: dynmesh.open(at("npy/a.npy"), faces=at("template.obj")),
    "a verb of a verb": lambda at: dynmesh.complete(dynmesh.convert(at("usd/a.usd"), fps=9)),
}


@pytest.mark.parametrize("kind", [str, Path])
@pytest.mark.parametrize("verb", VERBS)
def test_frames_are_those_of_the_paths_as_given(
    folders: tuple[Path, Path], tmp_path: Path, verb: str, kind: Callable[[str], Any]
) -> None:
    one, other = folders
    expected = dynmesh.read(VERBS[verb](lambda name: one / name))
    with contextlib.chdir(one):
        frames = VERBS[verb](kind)
        layer = VERBS[verb](kind)
    with contextlib.chdir(other):
        assert_same(dynmesh.read(frames), expected)
        if "usd" in verb:
            dynmesh.write(tmp_path / "over.usda", layer)
            assert "/other/" not in (tmp_path / "over.usda").read_text()
            made = dynmesh.read(tmp_path / "over.usda")
            np.testing.assert_array_equal(made.vertices, expected.vertices)
    assert all(file.is_relative_to(one) for file in frames.files)


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Points, depth images, a template and landmarks."""
    made = tmp_path_factory.mktemp("scanned")
    truth = scanned_body(made, 3, "--scan", "--points", "1500")
    run("degrade", made / "truth.npz", made / "depth", "--depth", "60x60", "--up", "z")
    (made / "depth" / "cameras.json").rename(made / "rig.json")
    marks = [{"vertex": 9, "position": truth.vertices[0, 9].tolist()}]
    (made / "marks.json").write_text(json.dumps(marks))
    return made


SCANS: dict[str, Verb] = {
    "track": lambda at: dynmesh.track(
        at("points"), template=at("body.obj"), landmarks=at("marks.json")
    ),
    "track depth": lambda at: dynmesh.track(
        at("depth"), template=at("body.obj"), cameras=at("rig.json"), training=at("truth.npz")
    ),
    "register": lambda at: dynmesh.register(
        at("body.obj"), at("points/frame_00000.ply"), landmarks=at("marks.json")
    ),
}


@pytest.mark.parametrize("verb", SCANS)
def test_scans_are_those_of_the_paths_as_given(scanned: Path, tmp_path: Path, verb: str) -> None:
    with contextlib.chdir(scanned):
        frames, scans = SCANS[verb](str), open_scans("depth", cameras="rig.json")
    with contextlib.chdir(tmp_path):
        assert dynmesh.read(frames).n_frames == len(frames)
        assert len([*scans]) == 3
    assert [*tmp_path.iterdir()] == []
    assert all(file.is_absolute() for file in (*frames.files, *scans.files))


def test_a_tilde_is_the_home_folder(
    folders: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To read and to write; a file of which it is only the first character keeps its name."""
    monkeypatch.setenv("HOME", str(folders[0]))
    monkeypatch.chdir(tmp_path)
    assert dynmesh.open("~/whole.npz").files == [folders[0] / "whole.npz"]
    dynmesh.write("~/made.npz", dynmesh.open(Path("~/whole.npz")))
    (folders[0] / "made.npz").unlink()
    dynmesh.write("~old.npz", dynmesh.read("~/whole.npz"))
    assert [file.name for file in tmp_path.iterdir()] == ["~old.npz"]


def test_paths_of_a_table_are_seen_from_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or from home."""
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    table = "input,output,template\na.npz,~/b.npz,~/c.obj\n~/a.npz,d.npz,c.obj\n"
    (tmp_path / "jobs.csv").write_text(table)
    with contextlib.chdir(tmp_path.parent):
        jobs = read_jobs(Path(tmp_path.name, "jobs.csv"))
    here, home = tmp_path, tmp_path / "home"
    assert [(job.input, job.output, job.reads[1]) for job in jobs] == [
        (here / "a.npz", home / "b.npz", home / "c.obj"),
        (home / "a.npz", here / "d.npz", here / "c.obj"),
    ]
