"""Sequences in memory: their checks and their repr."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from meshes import Mesh

import dynmesh
from dynmesh.sequence import numbers_of


@pytest.fixture
def numbered(mesh: Mesh) -> dynmesh.Sequence:
    """Ten frames, each of whose arrays hold the number of the frame, starting at frame 1001."""
    of_frame = np.tile(np.arange(10, dtype=np.int32)[:, None], (1, 49))
    return dynmesh.Sequence(
        np.repeat(of_frame[..., None], 3, axis=2).astype(np.float32),
        mesh.faces,
        of_frame % 2 == 0,
        generation=of_frame,
        age=of_frame,
        fps=25.0,
        start=1001,
        up_axis="z",
        name="/body",
    )


def test_a_sequence_is_a_collection_of_frames(numbered: dynmesh.Sequence) -> None:
    assert len(numbered) == 10
    assert [frame[0, 0] for frame in numbered] == list(range(10))
    for frame in (7, np.int64(7), -3):
        assert numbered[frame].shape == (49, 3)
        assert (numbered[frame] == 7).all()
    assert np.shares_memory(numbered[7], numbered.vertices)
    completed = list(dynmesh.complete(numbered.faces, numbered))
    np.testing.assert_array_equal(completed, numbered.vertices)


def test_an_empty_sequence_has_no_frames(numbered: dynmesh.Sequence) -> None:
    empty = numbered[4:4]
    assert (len(empty), list(empty), empty.start) == (0, [], 1005)
    assert empty.known is not None
    assert empty.known.shape == (0, 49)
    with pytest.raises(IndexError, match="frame: there are none, not 0"):
        empty[0]


@pytest.mark.parametrize(
    "frames",
    [
        slice(None),
        slice(3, None),
        slice(2, 9, 3),
        slice(-4, -1),
        slice(None, 100, 4),
        slice(7, 3),
        slice(20, 30),
        slice(9, None, 5),
    ],
)
@pytest.mark.parametrize("timed", [False, True])
def test_a_slice_cuts_everything_alike(
    numbered: dynmesh.Sequence, frames: slice, timed: bool
) -> None:
    times = 1001 + np.arange(10.0) ** 2 if timed else None
    whole = replace(numbered, times=times)
    part = whole[frames]
    kept = np.arange(10)[frames]
    for name in ("vertices", "known", "generation", "age"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[kept])
    assert part.vertices.base is whole.vertices
    assert (part.faces is whole.faces, part.fps, part.name) == (True, 25, "/body")
    numbers = (numbers_of(whole, 10))[kept]
    np.testing.assert_array_equal(numbers_of(part, len(part)), numbers)
    assert not len(part) or part.start == numbers[0]
    assert (part.times is None) == (not timed and frames.step is None)


def test_a_slice_is_written_at_its_times(numbered: dynmesh.Sequence, tmp_path: Path) -> None:
    dynmesh.write(tmp_path / "part.npz", numbered[2::3])
    again = dynmesh.read(tmp_path / "part.npz")
    np.testing.assert_array_equal(again.times, [1003, 1006, 1009])
    assert (again.start, again.fps) == (1003, 25)
