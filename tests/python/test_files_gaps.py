"""Sequences in which the files of some frames are missing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import dynmesh_command as run
from sequences import sea

import dynmesh

LOST = (3, 4, 8)


PARTIAL = sea(10, 8, share=0.5, whole=[0], start=1001, fps=None)


def written(folder: Path, partial: dynmesh.Sequence, suffix: str) -> Path:
    """The sequence in files, without those of the lost frames."""
    path = folder / f"scans/f_%04d{suffix}"
    if suffix == ".obj":
        missing = np.where(
            np.array(partial.known)[:, :, None], partial.vertices, np.float32(np.nan)
        )
        partial = replace(partial, vertices=missing, known=None)
    dynmesh.write(path, partial)
    for lost in LOST:
        path.with_name(path.name % (1001 + lost)).unlink()
    return path


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_lost_frames_are_frames_without_observations(tmp_path: Path, suffix: str) -> None:
    path = written(tmp_path, PARTIAL, suffix)
    with pytest.raises(ValueError, match=r"1004.* gaps are lost"):
        dynmesh.open(path)
    read = dynmesh.read(path, gaps="lost")
    kept = [i for i in range(10) if i not in LOST]
    assert len(read.vertices) == 10
    assert read.start == 1001
    np.testing.assert_array_equal(np.isfinite(read.vertices[list(LOST)]), False)
    present = PARTIAL.known if PARTIAL.known is not None and suffix != ".obj" else None
    if present is not None:
        np.testing.assert_array_equal(read.vertices[kept], PARTIAL.vertices[kept])
        assert read.known is not None
        np.testing.assert_array_equal(read.known[kept], present[kept])
        np.testing.assert_array_equal(read.known[list(LOST)], False)

    output = tmp_path / "made" / "g_%04d.ply"
    report = dynmesh.complete_file(path, output, source={"gaps": "lost"})
    assert report.empty == 3
    said = run("complete", path, tmp_path / "a.npz", "--gaps", "lost").stderr
    assert " 3 of the frames" in said
    assert PARTIAL.known is not None
    first = read.vertices[0]
    completer = dynmesh.Completer(PARTIAL.faces, first, method="detail")
    for number in range(1, 10):
        file = tmp_path / "made" / f"g_{1001 + number}.ply"
        expected = (
            completer.skip()
            if number in LOST
            else completer.push(read.vertices[number], PARTIAL.known[number])
        )
        np.testing.assert_array_equal(dynmesh.read(file).vertices[0], expected)


def test_a_mask_cannot_make_a_lost_frame_known(tmp_path: Path) -> None:
    path = written(tmp_path, PARTIAL, ".ply")
    everything = np.ones((10, 64), np.bool_)
    read = dynmesh.read(path, gaps="lost", known=everything)
    assert read.known is not None
    np.testing.assert_array_equal(read.known.all(axis=1), [i not in LOST for i in range(10)])
    zeros = dynmesh.read(path, gaps="lost", missing="zero")
    assert zeros.known is not None
    assert not zeros.known[list(LOST)].any()


def test_numbers_several_apart_survive(tmp_path: Path) -> None:
    """Every second frame of a longer recording, one of them lost."""
    times = np.arange(10, dtype=np.float64) * 2 + 100
    path = tmp_path / "in" / "f_%d.ply"
    dynmesh.write(path, replace(PARTIAL, start=100, times=times))
    names = sorted(file.name for file in path.parent.iterdir())
    assert names == [f"f_{100 + 2 * i}.ply" for i in range(10)]
    (path.parent / "f_106.ply").unlink()
    with pytest.raises(ValueError, match=r"f_106\.ply"):
        dynmesh.open(path.parent)
    read = dynmesh.read(path.parent, gaps="lost")
    np.testing.assert_array_equal(read.times, times)
    dynmesh.complete_file(path.parent, tmp_path / "out" / "f_%d.ply", source={"gaps": "lost"})
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == names


def test_times_in_names_are_no_gaps(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    for place, number in enumerate((20, 53, 87)):
        one = replace(PARTIAL, vertices=PARTIAL.vertices[place : place + 1], known=None)
        dynmesh.write(tmp_path / "in" / f"f_{number}.ply", one)
    assert len(dynmesh.read(tmp_path / "in").vertices) == 3
    with pytest.raises(ValueError, match="in: "):
        dynmesh.open(tmp_path / "in", gaps="lost")
