"""Sequences in which the files of some frames are missing."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from sequences import assert_refused, sea

import dynmesh

LOST = (3, 4, 8)


PARTIAL = sea(10, 8, share=0.5, whole=[0], start=1001, fps=None)


KNOWN: Any = PARTIAL.known


def written(folder: Path, suffix: str) -> Path:
    """The sequence in files, without those of the lost frames."""
    path = folder / f"scans/f_%04d{suffix}"
    holes = np.where(KNOWN[:, :, None], PARTIAL.vertices, np.float32(np.nan))
    missing = replace(PARTIAL, vertices=holes, known=None)
    dynmesh.write(path, missing if suffix == ".obj" else PARTIAL)
    for lost in LOST:
        path.with_name(path.name % (1001 + lost)).unlink()
    return path


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_lost_frames_are_frames_without_observations(tmp_path: Path, suffix: str) -> None:
    path = written(tmp_path, suffix)
    assert_refused(path, r"1004.* gaps are lost", lambda given: dynmesh.open(given))
    read: Any = dynmesh.read(path, gaps="lost")
    kept, lost = np.setdiff1d(range(10), LOST), list(LOST)
    assert (len(read.vertices), read.start) == (10, 1001)
    assert not np.isfinite(read.vertices[lost]).any()
    seen = KNOWN[kept]
    np.testing.assert_array_equal(read.vertices[kept][seen], PARTIAL.vertices[kept][seen])
    if suffix == ".ply":
        np.testing.assert_array_equal(read.known[kept], seen)
        assert not read.known[lost].any()

    output = tmp_path / "made" / "g_%04d.ply"
    report = dynmesh.complete_file(path, output, source={"gaps": "lost"})
    assert report.empty == 3
    said = run("complete", path, tmp_path / "a.npz", "--gaps", "lost").stderr
    assert " 3 of the frames" in said
    completer = dynmesh.Completer(PARTIAL.faces, read.vertices[0], method="detail")
    made = dynmesh.read(output).vertices
    for number in range(1, 10):
        points = read.vertices[number], KNOWN[number]
        expected = completer.skip() if number in LOST else completer.push(*points)
        np.testing.assert_array_equal(made[number], expected)


def test_a_mask_cannot_make_a_lost_frame_known(tmp_path: Path) -> None:
    path = written(tmp_path, ".ply")
    everything = np.ones((10, 64), np.bool_)
    read: Any = dynmesh.read(path, gaps="lost", known=everything)
    np.testing.assert_array_equal(read.known.all(axis=1), [i not in LOST for i in range(10)])
    zeros: Any = dynmesh.read(path, gaps="lost", missing="zero")
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
