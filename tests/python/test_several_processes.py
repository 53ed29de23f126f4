"""Outputs that several processes write, and inputs that another process writes meanwhile."""

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command, run_here
from jobs import COMMANDS, command, make_sources
from meshes import Mesh
from test_every_format import FORMATS, place

import dynmesh
from dynmesh import files
from dynmesh._errors import InputError
from dynmesh.completion import ways
from dynmesh.draw import page
from dynmesh.files.new_output import making
from dynmesh.verbs import convert, degrade, show


def moving(mesh: Mesh, n_frames: int = 4) -> dynmesh.Sequence:
    """A mesh that grows by half in each frame."""
    growth = 1 + 0.5 * np.arange(n_frames)[:, None, None]
    return dynmesh.Sequence((mesh.vertices * growth).astype(np.float32), mesh.faces)


def contents(folder: Path) -> dict[str, bytes]:
    """All files in a folder, the hidden ones included."""
    found = (file for file in folder.rglob("*") if file.is_file())
    return {str(file.relative_to(folder)): file.read_bytes() for file in found}


@pytest.mark.parametrize("format", FORMATS)
def test_only_one_writes_an_output(tmp_path: Path, mesh: Mesh, format: str) -> None:
    path, sequence = place(tmp_path, format), moving(mesh)
    with files.create(path, files.header_of(sequence)) as writer:
        for number in range(4):
            with pytest.raises(BlockingIOError, match="is being written by another process"):
                files.create(path, writer.header)
            writer.append(files.frame_of(sequence, number).points)
    np.testing.assert_allclose(dynmesh.read(path).vertices, sequence.vertices, rtol=1e-6)
    assert not list(tmp_path.rglob(".*"))
    dynmesh.write(path, sequence)  # which is over


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_sources(tmp_path_factory.mktemp("sources") / "new", 5)


@pytest.mark.parametrize("kind", COMMANDS)
def test_no_command_writes_what_another_one_is_writing(
    tmp_path: Path, sources: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.chdir(sources)
    (tmp_path / "mixed").mkdir()
    (tmp_path / "mixed" / "readme.txt").touch()
    output = next(Path(word.format(tmp_path)) for word in COMMANDS[kind].split() if "{}" in word)
    words = command(kind, sources, tmp_path)
    with making(output.parent if "%" in output.name else output):
        before = contents(tmp_path)
        refused = dynmesh_command(*words, code=1).stderr
        assert "is being written by another process" in refused
        assert contents(tmp_path) == before
    assert run_here(*words).returncode in (0, 3)  # which is over; 3 if the result is doubtful


def test_a_folder_that_a_killed_command_had_put_aside_comes_back(
    tmp_path: Path, mesh: Mesh
) -> None:
    source, output = tmp_path / "in.npz", tmp_path / "out" / "f_%02d.ply"
    dynmesh.write(source, moving(mesh, 2))
    dynmesh.write(output, moving(mesh))
    before = contents(tmp_path)
    (tmp_path / ".out.unfinished").mkdir()
    output.parent.rename(tmp_path / ".out.unfinished" / "old")
    refused = dynmesh_command("convert", source, output, code=1)
    assert "exists already" in refused.stderr
    assert contents(tmp_path) == before
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("beside", ["readme.txt", ".hidden", "more"])
def test_other_files_stay_where_they_are(tmp_path: Path, mesh: Mesh, beside: str) -> None:
    output, other = tmp_path / "out" / "f_%02d.ply", tmp_path / "out" / beside
    dynmesh.write(output, moving(mesh, 6))
    other.mkdir() if beside == "more" else other.write_text("mine")
    was = output.parent.stat().st_ino
    dynmesh.write(output, moving(mesh))
    assert len(dynmesh.read(output)) == 4
    assert other.exists()
    assert output.parent.stat().st_ino == was


def write_another(path: Path) -> Callable[..., Iterator[Any]]:
    """Passes frames on, and before the last one makes the output, as another process may."""

    def track(items: Any, total: int, *_: Any, **__: Any) -> Iterator[Any]:
        for number, item in enumerate(items):
            if number == total - 1:
                path.parent.mkdir(exist_ok=True)
                path.write_bytes(b"of another process")
            yield item

    return track


@pytest.mark.parametrize(
    ("command", "made"),
    [
        ("convert in.npz out.npz", "out.npz"),
        ("convert in.npz out.npy", "out.faces.npy"),
        ("convert in.npz out.pc2", "out.pc2"),
        ("convert in.npz q/f_%02d.ply", "q/f_07.ply"),
        ("degrade in.npz out.npz --known 0.5", "out.npz"),
        ("degrade in.npz out --scan --points 50", "out/frame_00000.ply"),
        ("degrade in.npz out --depth 8x8", "out/depth_00000_0.png"),
        ("view in.npz -o page.html", "page.html"),
        ("picture in.npz -o sheet.png", "sheet.png"),
    ],
)
def test_an_output_that_appears_meanwhile_is_kept(
    tmp_path: Path, mesh: Mesh, monkeypatch: pytest.MonkeyPatch, command: str, made: str
) -> None:
    monkeypatch.chdir(tmp_path)
    dynmesh.write("in.npz", moving(mesh))
    before = contents(tmp_path)
    for module in (convert, degrade, show, page):
        monkeypatch.setattr(module, "tracked", write_another(Path(made)))
    result = dynmesh_command(*command.split(), code=1)
    assert "exists already" in result.stderr
    assert contents(tmp_path) == before | {made: b"of another process"}
    assert not list(tmp_path.glob(".*"))
    dynmesh_command(*command.split(), "--overwrite")
    assert contents(tmp_path).get(made) != b"of another process"


def test_completion_keeps_an_output_that_appears_meanwhile(
    tmp_path: Path, mesh: Mesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, output = tmp_path / "in.npz", tmp_path / "out.npz"
    dynmesh.write(source, moving(mesh))
    monkeypatch.setattr(ways, "tracked", write_another(output))
    with pytest.raises(FileExistsError, match=r"out\.npz: exists already"):
        dynmesh.complete_file(source, output)
    monkeypatch.undo()
    assert output.read_bytes() == b"of another process"
    dynmesh.complete_file(source, output, overwrite=True)
    assert len(dynmesh.read(output).vertices) == 4


def rewrite(folder: Path, path: Path, sequence: dynmesh.Sequence) -> None:
    """Writes other frames into the same files."""
    other = dynmesh.Sequence(sequence.vertices[::-1].copy(), sequence.faces)
    anew = folder / "anew"
    anew.mkdir()
    dynmesh.write(anew / path.name, other)
    for file in anew.rglob("*"):
        if file.is_file():
            (path.parent / file.relative_to(anew)).write_bytes(file.read_bytes())
    shutil.rmtree(anew)


def make_old(folder: Path) -> None:
    """Sets the times of all files back, as they were not written in this moment."""
    for file in folder.rglob("*"):
        os.utime(file, (1e9, 1e9))


@pytest.mark.parametrize("format", FORMATS)
def test_an_input_that_is_rewritten_is_refused(tmp_path: Path, mesh: Mesh, format: str) -> None:
    folder, sequence = tmp_path / "in", moving(mesh, 6)
    folder.mkdir()
    path = place(folder, format)
    dynmesh.write(path, sequence)
    make_old(folder)
    with files.open(path) as reader:
        assert len(list(reader)) == 6
        frames = iter(reader)
        next(frames)
        rewrite(tmp_path, path, sequence)
        with pytest.raises(ValueError, match="was changed while it was read") as caught:
            list(frames)
        assert isinstance(caught.value, InputError)
        assert caught.value.file in reader.files
        with pytest.raises(ValueError, match="was changed while it was read"):
            list(reader.frames(2, 4))
    assert len(dynmesh.read(path).vertices) == 6


def test_masks_that_are_rewritten_are_refused(tmp_path: Path, mesh: Mesh) -> None:
    sequence = moving(mesh)
    dynmesh.write(tmp_path / "in.npz", sequence)
    masks = np.ones(sequence.vertices.shape[:2], bool)
    np.save(tmp_path / "m.npy", masks)
    make_old(tmp_path)
    with files.open(tmp_path / "in.npz", known=tmp_path / "m.npy") as reader:
        frames = iter(reader)
        next(frames)
        np.save(tmp_path / "m.npy", ~masks)
        with pytest.raises(ValueError, match=r"m\.npy: was changed while it was read"):
            list(frames)


@pytest.mark.parametrize("start", [0, 3])
def test_a_rewritten_input_is_not_completed(
    tmp_path: Path, mesh: Mesh, monkeypatch: pytest.MonkeyPatch, start: int
) -> None:
    folder, output, sequence = tmp_path / "in", tmp_path / "out.npz", moving(mesh, 6)
    folder.mkdir()
    path = folder / "f.npy"
    dynmesh.write(path, sequence)
    make_old(folder)

    def meanwhile(frames: Iterator[Any], *_: Any) -> Iterator[Any]:
        for number, frame in enumerate(frames):
            if number == 1:
                rewrite(tmp_path, path, sequence)
            yield frame

    monkeypatch.setattr(ways, "tracked", meanwhile)
    with pytest.raises(ValueError, match="was changed while it was read"):
        dynmesh.complete_file(path, output, start=start)
    assert sorted(tmp_path.iterdir()) == [folder]


@pytest.mark.parametrize("kind", ["--scan", "--depth"])
def test_scans_that_are_rewritten_are_refused(tmp_path: Path, mesh: Mesh, kind: str) -> None:
    source, folder = tmp_path / "in.npz", tmp_path / "scans"
    dynmesh.write(source, moving(mesh))
    what = ("--points", "50") if kind == "--scan" else ("8x8",)
    dynmesh_command("degrade", source, folder, kind, *what, "--cameras", "1")
    make_old(folder)
    scans_of_all = iter(dynmesh.scans.open_scans(folder))
    next(scans_of_all)
    *_, last = sorted({*folder.iterdir()} - {folder / "cameras.json"})
    last.write_bytes(last.read_bytes())
    with pytest.raises(ValueError, match=rf"{last.name}: was changed while it was read"):
        list(scans_of_all)
