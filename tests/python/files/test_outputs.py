"""Outputs whose names are taken: by links, pipes, protected files, or files of other modes."""

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from sequences import left_in, sea

import dynmesh

WRITTEN = [
    ("convert in.npz out.npz", "out.npz"),
    ("convert in.npz out.npy", "out.npy"),
    ("convert in.npz out.npy", "out.faces.npy"),
    ("convert in.npz new/f_%d.ply", "new/f_1.ply"),
    ("convert in.npz mixed/f_%d.ply", "mixed/f_2.ply"),
    ("convert in.npz out.obj --frames 0:1", "out.obj"),
    ("convert clouds out", "out/a_1.ply"),
    ("convert clouds/a_2.xyz c.ply", "c.ply"),
    ("degrade in.npz out --scan --points 50", "out/frame_00001.ply"),
    ("degrade in.npz out --depth 8x8", "out/cameras.json"),
    ("evaluate in.npz in.npz --csv table.csv", "table.csv"),
    ("view in.npz -o page.html", "page.html"),
    ("picture in.npz -o sheet.png", "sheet.png"),
]


@pytest.fixture(params=WRITTEN, ids=[f"{words.split()[0]} {file}" for words, file in WRITTEN])
def written(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: Any) -> Any:
    """A command that was run, and one of its files."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clouds").mkdir()
    (tmp_path / "mixed").mkdir()
    (tmp_path / "mixed" / "readme.txt").touch()
    for number in (1, 2):
        np.savetxt(tmp_path / "clouds" / f"a_{number}.xyz", np.eye(3))
    dynmesh.write("in.npz", sea(3))
    words, file = request.param
    run(*words.split())
    return words.split(), Path(file)


def refused(words: list[str]) -> str:
    """Runs a command that is refused with and without `--overwrite`, and changes nothing."""
    before = left_in(Path())
    run(*words, code=1)
    said = run(*words, "--overwrite", code=1).stderr
    assert left_in(Path()) == before
    return said


@pytest.mark.parametrize("leads_to", ["a file", "nothing", "the input"])
def test_a_link_stays_and_what_it_leads_to(written: Any, leads_to: str) -> None:
    words, file = written
    kept = Path("kept").absolute() if leads_to != "the input" else Path("in.npz").absolute()
    if leads_to == "a file":
        file.rename(kept)
    else:
        file.unlink()
    file.symlink_to(kept)
    said = refused(words)
    assert f"{file}: is a symbolic link" in said or f"{file}: is the input" in said


def test_a_pipe_stays_one(written: Any) -> None:
    words, file = written
    file.unlink()
    os.mkfifo(file)
    assert f"{file}: is no file" in refused(words)


def test_a_folder_of_that_name_stays(written: Any) -> None:
    words, file = written
    file.unlink()
    file.mkdir()
    (file / "inner").touch()
    assert f"{file}: is " in refused(words)


def test_a_protected_file_is_not_replaced(written: Any) -> None:
    words, file = written
    file.chmod(0o444)
    assert f"{file}: Permission denied" in refused(words)


def test_a_replaced_file_keeps_its_mode(written: Any) -> None:
    words, file = written
    file.write_bytes(file.read_bytes() + b" ")
    file.chmod(0o640)
    was = file.read_bytes()
    run(*words, "--overwrite")
    assert file.read_bytes() != was
    assert file.stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize(
    "words",
    ["convert in.npz out/f_%d.ply", "convert clouds out", "degrade in.npz out --scan --points 50"],
)
def test_a_folder_behind_a_link_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clouds").mkdir()
    np.savetxt("clouds/a_1.xyz", np.eye(3))
    dynmesh.write("in.npz", sea(3))
    (tmp_path / "disk" / "far").mkdir(parents=True)
    (tmp_path / "out").symlink_to("disk/far")
    for more in ([], ["--overwrite"]):
        run(*words.split(), *more)
        assert Path("out").is_symlink()
        assert [*Path("disk/far").glob("*.ply")]
    assert [file.name for file in Path("disk").iterdir()] == ["far"]


@pytest.mark.parametrize("error", [PermissionError, KeyboardInterrupt])
@pytest.mark.parametrize("name", ["f_%d.ply", "a.npy"])
@pytest.mark.parametrize("n_frames", [2, 6])
def test_a_move_that_fails_leaves_all_and_one_that_is_interrupted_frames_of_one_sequence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, n_frames: int, error: Any
) -> None:
    """As a file cannot be moved that another program has open in Windows, or another user has."""
    old = sea(4)
    zeros = np.zeros(old.vertices.shape[:2], np.int32)
    old = replace(old, generation=zeros, age=zeros, standard_error=zeros.astype(np.float32))
    new = dynmesh.Sequence(sea(n_frames).vertices + 1, old.faces)
    output = tmp_path / "out" / name
    moves = 0

    def fail_at(most: int, action: Callable[..., Any]) -> Callable[..., Any]:
        def act(path: Path, *arguments: Any, **options: Any) -> Any:
            nonlocal moves
            moves += 1
            if moves == most:
                raise error(13, "Permission denied", str(path))
            return action(path, *arguments, **options)

        return act

    for most in range(1, 100):
        moves = 0
        dynmesh.write(output, old)
        before = left_in(output.parent)
        with monkeypatch.context() as patched:
            for action in ("replace", "unlink"):
                patched.setattr(Path, action, fail_at(most, getattr(Path, action)))
            try:
                dynmesh.write(output, new)
                break
            except error:
                pass
        if error is PermissionError:
            assert left_in(output.parent) == before
        elif any(output.parent.glob(name.replace("%d", "*"))):
            left = dynmesh.read(output)
            whole = new if left.standard_error is None else old
            np.testing.assert_array_equal(left.vertices, whole.vertices[: len(left)])
    assert most > 3
    assert len(dynmesh.read(output)) == n_frames
