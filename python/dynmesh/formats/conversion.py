"""Conversion of sequences to other axes and units, and comparison of those that are to be alike."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import permutations
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._arrays import Positions
from .._checks import check_choice, check_positive
from .._errors import InputError, locating
from .._report import counted, some_of
from ..frame import Frame, Frames, Indices, frame_at
from ..header import RANGE, Axis, Header
from .times import check_slice, indices_of

UNITS = {
    "m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0,
    "inch": 0.0254, "foot": 0.3048, "yard": 0.9144,
}  # fmt: skip
"""The names of units, in metres."""

_SHORT = {"in": "inch", "ft": "foot", "yd": "yard"}


def metres_of(value: object, argument: str = "unit") -> float:
    """Returns the metres of a unit: a name, or a number of metres."""
    if isinstance(value, str) and (name := _SHORT.get(value, value)) in UNITS:
        return UNITS[name]
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < math.inf:
        return float(value)
    raise InputError(
        f"must be one of {', '.join(UNITS)}, or a number of metres above 0, not {value!r}",
        argument=argument,
        value=value,
    )


def agreed(
    stated: float | None, given: object, argument: str, file: Path | None = None
) -> float | None:
    """Returns the metres of a unit that a file states, or that is given of one that states none."""
    if given is None:
        return stated
    said = metres_of(given, argument)
    if stated is not None and not math.isclose(stated, said):
        message = f"the file states units of {stated:g} m, not {said:g} m"
        raise InputError(message, argument=argument, value=given, file=file)
    return said


def explaining(ratio: float, tolerance: float) -> list[tuple[str, str]]:
    """Returns pairs of units that differ by about a ratio of sizes, the usual ones first.

    Args:
        ratio: how many times as large, in numbers, something in the second unit is as the same in
            the first.
        tolerance: the largest factor by which it may be off.
    """
    usual = list(UNITS)
    pairs = permutations(usual, 2)
    off = {pair: abs(math.log(ratio * UNITS[pair[1]] / UNITS[pair[0]])) for pair in pairs}
    near = [pair for pair in off if off[pair] < math.log(tolerance)]
    return sorted(near, key=lambda pair: sorted(map(usual.index, pair)))


Unit: TypeAlias = float | str
"""The name of a unit of length, or its metres."""


@dataclass(frozen=True)
class Changes:
    """What is asked of a conversion; :func:`dynmesh.convert` explains the attributes."""

    frames: slice | range | None = None
    up: Axis | None = None
    unit: Unit | None = None
    to_up: Axis | None = None
    to_unit: Unit | None = None
    scale: float | None = None
    fps: float | None = None

    def __post_init__(self) -> None:
        if self.frames is not None:
            check_slice("frames", self.frames)
        for name in ("up", "to_up"):
            if getattr(self, name) is not None:
                check_choice(name, getattr(self, name), Axis)
        for name in ("unit", "to_unit"):
            if getattr(self, name) is not None:
                metres_of(getattr(self, name), name)
        for name in ("scale", "fps"):
            if getattr(self, name) is not None:
                check_positive(name, getattr(self, name))

    def of(self, header: Header) -> tuple["Conversion", range]:
        """What becomes of a sequence with this header, and the indices of the frames it takes."""
        indices = range(n_frames := header.n_frames)
        if self.frames is not None:
            numbers = header.numbers
            indices = indices_of(numbers, self.frames)
            numbers = numbers[indices]
            times = None if header.times is None and indices.step == 1 else numbers
            header = replace(header, n_frames=len(indices), start=float(numbers[0]), times=times)
        up, metres = header.up_axis, agreed(header.metres_per_unit, self.unit, "unit")
        if self.up is not None and up not in (None, self.up):
            message = f"the file states {up}, not {self.up}"
            raise InputError(message, argument="up", value=self.up)
        up = self.up or up
        turn, factor = np.eye(3), float(self.scale or 1.0)
        if self.to_up is not None:
            if up is None:
                raise _unknown("up axis", "up", "to_up")
            turn = _turn("xyz".index(up), "xyz".index(self.to_up))
            up = self.to_up
        if self.to_unit is not None:
            if metres is None:
                raise _unknown("unit of length", "unit", "to_unit")
            factor *= metres / metres_of(self.to_unit)
            metres = metres_of(self.to_unit)
        fps = self.fps or header.fps
        changed = {
            RANGE: len(indices) < n_frames,
            "frame rate": fps != header.fps,
            "up axis": not np.array_equal(turn, np.eye(3)),
            "unit of length": self.to_unit is not None and factor != (self.scale or 1),
        }
        result = replace(header, up_axis=up, metres_per_unit=metres, fps=fps)
        names = tuple(name for name, is_changed in changed.items() if is_changed)
        return Conversion(result, turn, factor, names), indices


@dataclass(frozen=True, eq=False)
class Conversion:
    """What becomes of the frames of a sequence.

    Attributes:
        header: that of the result.
        turn: (3, 3), the rotation of the points.
        factor: by which they are scaled.
        changed: what is another one than before, in words.
    """

    header: Header
    turn: NDArray[np.float64]
    factor: float
    changed: tuple[str, ...]

    def frames(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """Yields the frames of the result, for all frames of the sequence."""
        for number, frame in enumerate(frames):
            with locating(frame=number):
                points = self.moved(frame.points)
            errors = frame.standard_error
            scaled = None if errors is None else errors * np.float32(self.factor)
            yield replace(frame, points=points, standard_error=scaled)

    def moved(self, points: Positions) -> Positions:
        """Turns and scales points."""
        if self.factor == 1 and np.array_equal(self.turn, np.eye(3)):
            return points
        with np.errstate(invalid="ignore", over="ignore"):  # missing ones may be infinite
            moved = points.astype(np.float64) @ self.turn.T * self.factor
            result = moved.astype(points.dtype)
        if (np.isinf(result) & np.isfinite(points)).any():
            raise InputError(
                f"takes points out of the range of {points.dtype}, by a factor of {self.factor:g}",
                argument="scale",
            )
        return result


def _turn(one: int, other: int) -> NDArray[np.float64]:
    """The quarter turn that takes one axis to another one."""
    turn = np.eye(3)
    if one != other:
        turn[:, one], turn[:, other] = np.eye(3)[other], -np.eye(3)[one]
    return turn


def _unknown(what: str, remedy: str, argument: str) -> InputError:
    return InputError(f"the file states no {what}; give it by `{remedy}`", argument=argument)


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
    _check_alike(other, reader, "metres_per_unit", "unit in metres", "to_unit")
    _check_alike(other, reader, "up_axis", "up axis", "to_up")


def comparable(completed: Frames, reference: Frames) -> Indices:
    """Returns the indices, in the reference, of the frames of a sequence of the same mesh and rate.

    Equally many frames are those of the reference in their order, others those with their numbers.
    """
    check_same_mesh(completed, reference)
    _check_alike(completed, reference, "fps", "rate in frames per second", "fps")
    return places_of(completed, reference.path, reference.header.numbers)


def places_of(frames: Frames, other: Path, numbers: NDArray[np.float64]) -> Indices:
    """Returns the indices of the frames among those of another file, which have these numbers."""
    ours = frames.header.numbers
    if len(ours) == len(numbers):
        return range(len(ours))
    missing = [f"{number:.15g}" for number in ours if number not in numbers]
    if missing:
        raise InputError(
            f"has {counted(len(ours), 'frame')}, but {other} has {len(numbers)}, and none of the "
            f"numbers {some_of(missing, 3)}",
            file=frames.path,
        )
    return [*map(int, np.searchsorted(numbers, ours))]


def _check_alike(other: Frames, reader: Frames, name: str, what: str, argument: str) -> None:
    theirs, ours = getattr(other.header, name), getattr(reader.header, name)
    if None in (theirs, ours) or theirs == ours:
        return
    if isinstance(ours, str) or not math.isclose(theirs, ours, rel_tol=1e-5):  # rounded in files
        raise InputError(
            f"its {what} is {theirs}, but {ours} in {reader.path}; dynmesh convert, with "
            f"`{argument}` {ours}, makes them alike",
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
        there = frame.points[frame.present].astype(np.float64)
        sizes.append(float(np.linalg.norm(np.ptp(there, axis=0))) if len(there) else 0.0)
    if min(sizes) == 0:
        return
    ratio = sizes[0] / sizes[1]
    if max(ratio, 1 / ratio) > _MUCH and (pairs := explaining(1 / ratio, _SAME)):
        ours, theirs = pairs[0]
        raise InputError(
            f"is {ratio:.4g} times as large as {reference.path}, as if it were in {ours} and that "
            f"in {theirs}; dynmesh convert, with `scale` {1 / ratio:.4g}, makes them comparable",
            file=completed.path,
        )
