"""Turning, scaling and resampling of a sequence while it is written."""

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .._checks import check_positive
from .._errors import InputError
from ..frames.attributes import ATTRIBUTES
from ..frames.header import Header
from ..frames.times import frame_numbers
from ..sequence import Positions
from .scans import given_unit
from .stated import Axis, Unit

_SAME_TIME = 1e-6
"""Frames that are nearer to one another are one."""


class Output(Protocol):
    """What takes frames in their order, such as a writer."""

    @property
    def header(self) -> Header:
        """The properties of all frames."""

    def append(self, points: Positions, **values: Any) -> None:
        """Takes the next frame, with the attributes of the header."""


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

    @classmethod
    def of(
        cls,
        header: Header,
        *,
        to_up: Axis | None = None,
        to_unit: Unit | None = None,
        scale: float | None = None,
        retime: float | None = None,
    ) -> "Conversion":
        """The conversion of a sequence with this header.

        Raises:
            TypeError, ValueError: the axis, the unit or the rate is needed, but not known, or an
                argument is refused.
        """
        turn, factor, places, made = np.eye(3), 1.0, None, header
        if scale is not None:
            check_positive("scale", scale)
            factor = float(scale)
        if to_up is not None:
            if header.up_axis is None:
                raise InputError(_unknown("up axis", "--up", "up"), argument="to_up")
            turn = _turn("xyz".index(header.up_axis), "xyz".index(to_up))
            made = replace(made, up_axis=to_up)
        if to_unit is not None:
            metres = given_unit("to_unit", to_unit)
            if header.metres_per_unit is None:
                raise InputError(_unknown("unit of length", "--unit", "unit"), argument="to_unit")
            factor *= header.metres_per_unit / metres
            made = replace(made, metres_per_unit=metres)
        if retime is not None:
            check_positive("retime", retime)
            if header.fps is None:
                raise InputError(_unknown("frames per second", "--fps", "fps"), argument="retime")
            places = _places(header, header.fps, retime)
            made = replace(made, fps=float(retime), n_frames=len(places), times=None)
        return cls(header, made, turn, factor, places)

    @property
    def moves(self) -> bool:
        """Whether frames change, so that they no longer fit into a scene."""
        return self.places is not None or self.factor != 1 or not np.array_equal(self.turn, _SAME)

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

    def output(self, output: Output) -> Output:
        """Returns what takes the frames of the sequence and passes those of the result on."""
        return _Converted(self, output) if self.moves else output

    def points(self, points: Positions) -> Positions:
        """Turns and scales points."""
        with np.errstate(invalid="ignore", over="ignore"):  # missing ones may be infinite
            moved = points.astype(np.float64) @ self.turn.T * self.factor
            made = moved.astype(points.dtype)
        if (np.isinf(made) & np.isfinite(moved)).any():
            raise InputError(
                f"takes points out of the range of {points.dtype}, by a factor of {self.factor:g}",
                argument="scale",
            )
        return made


_SAME = np.eye(3)


class _Converted:
    """Converts frames on their way to another output."""

    def __init__(self, conversion: Conversion, output: Output) -> None:
        self.header = conversion.before
        self._conversion = conversion
        self._output = output
        self._n_taken = self._n_passed = 0
        self._last: dict[str, NDArray[Any]] = {}

    def append(self, points: Positions, **values: Any) -> None:
        """Takes the next frame of the sequence."""
        frame = {"points": self._conversion.points(points), **values}
        errors = values.get("standard_error")
        if errors is not None:
            frame["standard_error"] = errors * np.float32(self._conversion.factor)
        places = self._conversion.places
        if places is None:
            self._output.append(**frame)
            return
        while self._n_passed < len(places) and places[self._n_passed] <= self._n_taken:
            share = places[self._n_passed] - (self._n_taken - 1)
            self._output.append(**(frame if share == 1 else _between(self._last, frame, share)))
            self._n_passed += 1
        self._last = frame
        self._n_taken += 1


def _between(
    before: dict[str, NDArray[Any]], after: dict[str, NDArray[Any]], share: float
) -> dict[str, NDArray[Any]]:
    """The frame between two, at this share of the way.

    A vertex is known where both know it, and otherwise as far from a known one as in the worse.
    """
    made: dict[str, NDArray[Any]] = {}
    for name, one in before.items():
        other = after[name]
        if name in ("points", "standard_error"):
            with np.errstate(invalid="ignore"):
                mean = one.astype(np.float64) * (1 - share) + other.astype(np.float64) * share
            made[name] = mean.astype(one.dtype)
        elif ATTRIBUTES[name].dtype.kind == "b":
            made[name] = one & other
        else:  # a negative generation is one of those that no known vertex determines
            lower = np.minimum(one, other)
            made[name] = np.where(lower < 0, lower, np.maximum(one, other))
    return made


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


def _unknown(what: str, option: str, keyword: str) -> str:
    return f"the file states no {what}: {option} (in Python, {keyword}=) says it"
