"""Paths mean what they meant when they were given, wherever the frames are made.

test_compositions.py gives paths of all formats to each pair of verbs so.
"""

import contextlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from scan_files import scanned_body
from sequences import assert_same, sea

import dynmesh
from dynmesh.cli.job_table import read_jobs
from dynmesh.scans import open_scans


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sea in several formats, scans of a body, and what options name."""
    made = tmp_path_factory.mktemp("folder")
    partial, whole = sea(4, 12, share=0.7, whole=[0], start=3), sea(4, 12, start=3)
    for name in ("a.npz", "a.npy", "a.usd", "walk/a_%d.obj"):
        dynmesh.write(made / name, partial)
    dynmesh.write(made / "whole.npz", whole)
    dynmesh.write(made / "sea.obj", whole[:1])
    np.save(made / "known.npy", np.asarray(partial.known))
    truth = scanned_body(made, 3, "--scan", "--points", "1500")
    run("degrade", made / "truth.npz", made / "depth", "--depth", "60x60", "--up", "z")
    (made / "depth" / "cameras.json").rename(made / "rig.json")
    marks = [{"vertex": 9, "position": truth.vertices[0, 9].tolist()}]
    (made / "marks.json").write_text(json.dumps(marks))
    return made


VERBS: dict[str, Callable[[Callable[[str], Any]], Any]] = {
    "a folder": lambda at: dynmesh.complete(at("walk")),
    "a pattern": lambda at: dynmesh.open(at("walk/a_*.obj")),
    "a stage": lambda at: dynmesh.complete(at("a.usd")),
    "template": lambda at: dynmesh.complete(at("a.npz"), template=at("sea.obj")),
    "training": lambda at: dynmesh.complete(at("a.npz"), training=[at("whole.npz")]),
    "known": lambda at: dynmesh.open(at("whole.npz"), known=at("known.npy")),
    "faces": lambda at: dynmesh.open(at("a.npy"), faces=at("sea.obj")),
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
"""What makes frames of paths, which are made of names in a folder."""


@pytest.mark.parametrize("verb", VERBS)
def test_frames_are_those_of_the_paths_as_given(folder: Path, tmp_path: Path, verb: str) -> None:
    expected = dynmesh.read(VERBS[verb](lambda name: folder / name))
    with contextlib.chdir(folder):
        frames, again = VERBS[verb](str), VERBS[verb](str)
    with contextlib.chdir(tmp_path):
        assert_same(dynmesh.read(frames), expected)
        dynmesh.write("over.usda", again)  # over the stage, if it is one
        np.testing.assert_allclose(dynmesh.read("over.usda").vertices, expected.vertices, 1e-5)
    assert all(file.is_relative_to(folder) for file in frames.files)


def test_cameras_are_those_of_the_path_as_given(folder: Path) -> None:
    with contextlib.chdir(folder):
        scans = open_scans("depth", cameras="rig.json")
    assert len([*scans]) == 3
    assert all(file.is_absolute() for file in scans.files)


def test_a_tilde_is_the_home_folder(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To read and to write; a file of which it is only the first character keeps its name."""
    monkeypatch.setenv("HOME", str(folder))
    monkeypatch.chdir(tmp_path)
    assert dynmesh.open("~/whole.npz").files == [folder / "whole.npz"]
    dynmesh.write("~/made.npz", dynmesh.open(Path("~/whole.npz")))
    (folder / "made.npz").unlink()
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
