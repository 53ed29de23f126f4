"""Choosing, turning, scaling and resampling frames of a sequence."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._checks import check_positive
from .._errors import InputError
from ..attributes import ATTRIBUTES
from ..sequence import Positions
from .frame import Frame
from .header import Header
from .times import check_slice, frame_numbers, indices_of
from .units import metres_of

Axis: TypeAlias = Literal["x", "y", "z"]
Unit: TypeAlias = float | str
"""The name of a unit of length, or its metres."""

_SAME_TIME = 1e-6
"""Frames that are nearer to one another are one."""


@dataclass(frozen=True)
class Changes:
    """What is asked of a conversion; :func:`dynmesh.convert_file` explains the attributes.

    Raises:
        TypeError, ValueError: no sequence can be changed so; the rest is checked with a sequence.
    """

    frames: slice | range | None = None
    up: Axis | None = None
    unit: Unit | None = None
    to_up: Axis | None = None
    to_unit: Unit | None = None
    scale: float | None = None
    fps: float | None = None
    retime: float | None = None

    def __post_init__(self) -> None:
        """Refuses what no sequence can have."""
        if self.frames is not None:
            check_slice("frames", self.frames)
        for name in ("up", "to_up"):
            axis = getattr(self, name)
            if axis not in (None, "x", "y", "z"):
                told = f"must be 'x', 'y' or 'z', not {axis!r}"
                raise InputError(told, argument=name, value=axis)
        for name in ("unit", "to_unit"):
            if getattr(self, name) is not None:
                metres_of(getattr(self, name), name)
        for name in ("scale", "fps", "retime"):
            if getattr(self, name) is not None:
                check_positive(name, getattr(self, name))

    def of(self, header: Header) -> tuple["Conversion", range]:
        """What becomes of a sequence with this header, and the indices of the frames it takes.

        Raises:
            ValueError: there are no such frames, the file states another axis or unit, or one is
                needed that nothing states.
        """
        indices = range(header.n_frames)
        if self.frames is not None:
            header, indices = _cut(header, self.frames)
        header = made = replace(_stated(header, self.up, self.unit), fps=self.fps or header.fps)
        turn, factor, places = np.eye(3), float(self.scale or 1.0), None
        if self.to_up is not None:
            if header.up_axis is None:
                raise _unknown("up axis", "up", "to_up")
            turn = _turn("xyz".index(header.up_axis), "xyz".index(self.to_up))
            made = replace(made, up_axis=self.to_up)
        if self.to_unit is not None:
            if header.metres_per_unit is None:
                raise _unknown("unit of length", "unit", "to_unit")
            metres = metres_of(self.to_unit)
            factor *= header.metres_per_unit / metres
            made = replace(made, metres_per_unit=metres)
        if self.retime is not None:
            if header.fps is None:
                raise _unknown("frames per second", "fps", "retime")
            places = _places(header, header.fps, self.retime)
            made = replace(made, fps=float(self.retime), n_frames=len(places), times=None)
        return Conversion(header, made, turn, factor, places), indices


@dataclass(frozen=True, eq=False)
class Conversion:
    """What becomes of the frames of a sequence.

    Attributes:
        before: the header of the sequence.
        header: that of the result.
        turn: (3, 3), the rotation of the points.
        factor: by which they are scaled.
        places: where each frame of the result is among those of the sequence, counted from 0; None
            if these are the frames.
    """

    before: Header
    header: Header
    turn: NDArray[np.float64]
    factor: float
    places: NDArray[np.float64] | None

    def remarks(self) -> list[str]:
        """What the user should know of the result."""
        if self.places is None:
            return []
        between = np.count_nonzero(self.places % 1)
        return [
            f"resampled from {self.before.fps:g} to {self.header.fps:g} frames per second: "
            f"{self.header.n_frames} frames from {self.before.n_frames}, {between} of them by "
            "linear interpolation"
        ]

    def frames(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """Yields the frames of the result, for all frames of the sequence."""
        n_made, last = 0, Frame(np.empty((0, 3)))
        for n_taken, frame in enumerate(frames):
            errors = frame.standard_error
            moved = replace(
                frame,
                points=self._moved(frame.points),
                standard_error=None if errors is None else errors * np.float32(self.factor),
            )
            if self.places is None:
                yield moved
                continue
            while n_made < len(self.places) and self.places[n_made] <= n_taken:
                share = self.places[n_made] - (n_taken - 1)
                yield moved if share == 1 else _between(last, moved, share)
                n_made += 1
            last = moved

    def _moved(self, points: Positions) -> Positions:
        """Turns and scales points."""
        if self.factor == 1 and np.array_equal(self.turn, np.eye(3)):
            return points
        with np.errstate(invalid="ignore", over="ignore"):  # missing ones may be infinite
            moved = points.astype(np.float64) @ self.turn.T * self.factor
            made = moved.astype(points.dtype)
        if (np.isinf(made) & np.isfinite(moved)).any():
            raise InputError(
                f"takes points out of the range of {points.dtype}, by a factor of {self.factor:g}",
                argument="scale",
            )
        return made


def _between(before: Frame, after: Frame, share: float) -> Frame:
    """The frame between two, at this share of the way.

    A vertex is known where both know it, and otherwise as far from a known one as in the worse.
    """
    made: dict[str, NDArray[Any]] = {}
    others = after.attributes()
    for name, one in (("points", before.points), *before.attributes().items()):
        other = after.points if name == "points" else others[name]
        if name in ("points", "standard_error"):
            with np.errstate(invalid="ignore"):
                mean = one.astype(np.float64) * (1 - share) + other.astype(np.float64) * share
            made[name] = mean.astype(one.dtype)
        elif ATTRIBUTES[name].dtype.kind == "b":
            made[name] = one & other
        else:  # a negative generation is one of those that no known vertex determines
            lower = np.minimum(one, other)
            made[name] = np.where(lower < 0, lower, np.maximum(one, other))
    return Frame(**made)


def _turn(one: int, other: int) -> NDArray[np.float64]:
    """The quarter turn that takes one axis to another one."""
    turn = np.eye(3)
    if one != other:
        turn[:, one], turn[:, other] = np.eye(3)[other], -np.eye(3)[one]
    return turn


def _places(header: Header, fps: float, retime: float) -> NDArray[np.float64]:
    numbers = frame_numbers(header)
    seconds = (numbers - numbers[0]) / fps
    n_frames = int(np.floor(seconds[-1] * retime + _SAME_TIME)) + 1
    places = np.interp(np.arange(n_frames) / retime, seconds, np.arange(len(seconds)))
    whole = np.round(places)
    return np.where(np.abs(places - whole) < _SAME_TIME, whole, places)


def _unknown(what: str, remedy: str, argument: str) -> InputError:
    return InputError(f"the file states no {what}; give it by {remedy}", argument=argument)


def _stated(header: Header, up: Axis | None, unit: Unit | None) -> Header:
    """The header with the axis and unit that its file does not state.

    Raises:
        ValueError: the file states others.
    """
    metres = None if unit is None else metres_of(unit)
    if up is not None and header.up_axis not in (None, up):
        raise InputError(f"the file states {header.up_axis}, not {up}", argument="up", value=up)
    said = header.metres_per_unit
    if metres is not None and said is not None and not np.isclose(said, metres, rtol=1e-9):
        told = f"the file states units of {said:g} m, not {metres:g} m"
        raise InputError(told, argument="unit", value=unit)
    return replace(header, up_axis=up or header.up_axis, metres_per_unit=metres or said)


def _cut(header: Header, frames: slice | range) -> tuple[Header, range]:
    """The header of the frames with these numbers, and their indices.

    Raises:
        ValueError: there are none.
    """
    numbers = frame_numbers(header)
    indices = indices_of(numbers, frames)
    numbers = numbers[indices]
    consecutive = header.times is None and indices.step == 1
    made = replace(
        header,
        n_frames=len(indices),
        start=float(numbers[0]),
        times=None if consecutive else numbers,
    )
    return made, indices
