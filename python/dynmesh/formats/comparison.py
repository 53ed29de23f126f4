"""Comparisons of sequences that are to have one mesh."""

import math

import numpy as np

from .._errors import InputError
from ..frame import Frames, frame_at
from .conversion import explaining

_SAME = 1.05
"""Two sequences are in different units if their sizes differ by the ratio of these, about."""
_MUCH = 2.0
"""A result that is wrong may differ by less than this factor, and is measured all the same."""


def check_same_mesh(other: Frames, reader: Frames) -> None:
    """Raises an error unless a file has the mesh of another one, and states no other unit or axis.

    What one of them does not state is not compared.
    """
    ours, theirs = reader.n_vertices, other.n_vertices
    if ours != theirs:
        raise InputError(f"has {theirs} vertices, but {reader.path} has {ours}", file=other.path)
    if not np.array_equal(other.faces, reader.faces):
        raise InputError(f"has other faces than {reader.path}", file=other.path)
    _check_alike(other, reader, "metres_per_unit", "unit in metres", "--to-unit")
    _check_alike(other, reader, "up_axis", "up axis", "--to-up")


def check_comparable(completed: Frames, reference: Frames) -> None:
    """Raises an error unless the sequences also have the same number of frames and rate."""
    check_same_mesh(completed, reference)
    ours, truth = completed.n_frames, reference.n_frames
    if ours != truth:
        raise InputError(
            f"has {ours} frames, but {reference.path} has {truth}", file=completed.path
        )
    _check_alike(completed, reference, "fps", "rate in frames per second", "--fps")


def _check_alike(other: Frames, reader: Frames, name: str, what: str, option: str) -> None:
    theirs, ours = getattr(other.header, name), getattr(reader.header, name)
    if None in (theirs, ours) or theirs == ours:
        return
    if isinstance(ours, str) or not math.isclose(theirs, ours, rel_tol=1e-5):  # rounded in files
        raise InputError(
            f"its {what} is {theirs}, but {ours} in {reader.path}; dynmesh convert {option} {ours} "
            "makes them alike",
            file=other.path,
        )


def remarks_of(*readers: Frames | None) -> tuple[str, ...]:
    """What of the motion of sequences is not read, with the names of their files."""
    there = [reader for reader in readers if reader is not None]
    return tuple(f"{one.path.name}: {remark}" for one in there for remark in one.remarks)


def check_same_size(completed: Frames, reference: Frames) -> None:
    """Refuses a sequence that is as much larger or smaller than its reference as another unit."""
    sizes = []
    for reader in (completed, reference):
        frame = frame_at(reader, 0)
        seen = frame.points[frame.observed].astype(np.float64)
        sizes.append(float(np.linalg.norm(np.ptp(seen, axis=0))) if len(seen) else 0.0)
    if min(sizes) == 0:
        return
    ratio = sizes[0] / sizes[1]
    if max(ratio, 1 / ratio) > _MUCH and (pairs := explaining(1 / ratio, _SAME)):
        ours, theirs = pairs[0]
        raise InputError(
            f"is {ratio:.4g} times as large as {reference.path}, as if it were in {ours} and that "
            f"in {theirs}; dynmesh convert --scale {1 / ratio:.4g} makes them comparable",
            file=completed.path,
        )
