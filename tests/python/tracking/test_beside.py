"""What commands write beside frames: when, how often and where."""

from pathlib import Path
from typing import Any

import pytest
from commands import dynmesh_command as run
from scan_files import scanned_body

import dynmesh
from dynmesh.formats.writing import Place

SUFFIX = {"track": ".csv", "register": ".html"}


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("beside")
    scanned_body(made, 2, "--scan", "--points", "1500")
    return made


@pytest.fixture(params=SUFFIX)
def words(request: pytest.FixtureRequest, scans: Path, tmp_path: Path) -> list[Any]:
    """A command that writes a file beside the frames."""
    beside, out = tmp_path / f"beside{SUFFIX[request.param]}", tmp_path / "out.npz"
    if request.param == "track":
        return ["track", scans / "points", out, "--template", scans / "body.obj", "--csv", beside]
    scan = scans / "points" / "frame_00000.ply"
    return ["register", scans / "body.obj", scan, out, "--page", beside]


def test_it_is_written_with_the_frames_or_not_at_all(
    words: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise OSError("the disk is full")

    with monkeypatch.context() as patched:
        patched.setattr(Place, "fill", fail)
        assert "the disk is full" in run(*words, code=1).stderr
    assert [*tmp_path.iterdir()] == []
    run(*words)
    assert sorted(path.suffix for path in tmp_path.iterdir()) == sorted([".npz", words[-1].suffix])
    words[-1].write_text("of another program")
    (tmp_path / "out.npz").unlink()
    assert f"{words[-1].name}: exists already" in run(*words, code=1).stderr
    assert not (tmp_path / "out.npz").exists()  # it was refused before any work
    assert words[-1].read_text() == "of another program"
    run(*words, "--overwrite")
    assert words[-1].read_text() != "of another program"


def test_tracked_frames_never_come_among_the_scans(scans: Path, tmp_path: Path) -> None:
    (tmp_path / "linked").symlink_to(scans / "points")
    before = sorted((scans / "points").iterdir())
    tracked = dynmesh.track(scans / "points", template=scans / "body.obj")
    for folder in (scans / "points", tmp_path / "linked"):
        with pytest.raises(ValueError, match="is in the folder of the input"):
            tracked.write(folder / "tracked_%d.ply")
    assert sorted((scans / "points").iterdir()) == before
