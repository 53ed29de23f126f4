"""What `track` and `registered` write beside their frames: when, how often and where."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from commands import dynmesh_command as run
from scan_files import moving_body

import dynmesh
from dynmesh.formats.place import Place

Verb = Callable[[Path], Any]


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("beside")
    truth = moving_body(2)
    dynmesh.write(made / "truth.npz", truth)
    dynmesh.write(made / "body.obj", truth[:1])
    run("degrade", made / "truth.npz", made / "points", "--scan", "--points", "1500")
    return made


@pytest.fixture(params=["track", "registered"])
def verb(request: pytest.FixtureRequest, scans: Path) -> Verb:
    """A verb as a function of the file that it writes beside the frames."""
    body = scans / "body.obj"
    if request.param == "track":
        return lambda path: dynmesh.track(
            scans / "points", template=body, csv=path.with_suffix(".csv")
        )
    pytest.importorskip("PIL")
    scan = scans / "points" / "frame_00000.ply"
    return lambda path: dynmesh.registered(body, scan, page=path.with_suffix(".html"))


def beside(folder: Path) -> list[Path]:
    return sorted([*folder.glob("beside.*"), *folder.glob(".*")])


def test_each_pass_writes_it_anew(verb: Verb, tmp_path: Path) -> None:
    frames = verb(tmp_path / "beside")
    assert len(dynmesh.read(frames)) == len(frames)
    (path,) = beside(tmp_path)
    first = path.read_text()
    path.unlink()
    dynmesh.write(tmp_path / "first.npz", frames)
    dynmesh.write(tmp_path / "second.npz", dynmesh.convert(frames, scale=2))
    assert beside(tmp_path) == [path]
    assert len(path.read_text().splitlines()) == len(first.splitlines())


def test_a_failed_write_leaves_none(
    verb: Verb, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise OSError("the disk is full")

    for frames in (verb(tmp_path / "beside"), dynmesh.convert(verb(tmp_path / "beside"), scale=2)):
        with monkeypatch.context() as patched:
            patched.setattr(Place, "fill", fail)
            with pytest.raises(OSError, match="the disk is full"):
                dynmesh.write(tmp_path / "out.npz", frames)
        assert beside(tmp_path) == []
    dynmesh.write(tmp_path / "out.npz", verb(tmp_path / "beside"))
    assert len(beside(tmp_path)) == 1


def test_a_file_of_another_program_stays(verb: Verb, tmp_path: Path) -> None:
    frames = verb(tmp_path / "beside")
    dynmesh.read(frames)
    (path,) = beside(tmp_path)
    path.rename(tmp_path / "kept")  # which keeps its inode
    path.write_text("of another program")
    with pytest.raises(FileExistsError, match=r"beside\..*: exists already"):
        dynmesh.write(tmp_path / "out.npz", frames)
    assert path.read_text() == "of another program"
    with pytest.raises(FileExistsError, match="exists already"):
        verb(tmp_path / "beside")


def test_it_is_written_where_it_was_when_it_was_given(
    verb: Verb, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    frames = verb(Path("beside"))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    dynmesh.read(frames)
    assert beside(Path()) == []
    assert len(beside(tmp_path)) == 1


def test_tracked_frames_never_come_among_the_scans(scans: Path, tmp_path: Path) -> None:
    (tmp_path / "linked").symlink_to(scans / "points")
    before = sorted((scans / "points").iterdir())
    tracked = dynmesh.track(scans / "points", template=scans / "body.obj")
    for folder in (scans / "points", tmp_path / "linked"):
        with pytest.raises(ValueError, match="is in the folder of the input"):
            dynmesh.write(folder / "tracked_%d.ply", tracked)
    assert sorted((scans / "points").iterdir()) == before
