"""Conversion between the times of frames and their rate and numbers.

If the frames per second are unknown, formats with times in seconds get the numbers of the frames.
"""

import math
import statistics
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._checks import check_integer, check_number
from .._errors import InputError, KindError
from ..header import Header
from .names import FrameNames, Number, usual_distance

broadcast = (23.976, 29.97, 59.94, 24000 / 1001, 30000 / 1001, 60000 / 1001)
"""Common frame rates that need more digits than some files store."""


_CLOCK = 1e8
"""Seconds since 1970 from which on numbers with decimals are clock times: 1973."""


class Timing(NamedTuple):
    """The timing of the frames, named like the fields of a header."""

    fps: float | None
    start: float
    times: NDArray[np.float64] | None = None


def spacing(times: Sequence[float]) -> float | None:
    """Returns the step between times; None if there is only one or they are uneven."""
    if len(times) < 2:
        return None
    step = (times[-1] - times[0]) / (len(times) - 1)
    return float(step) if np.allclose(np.diff(times), step, rtol=1e-6, atol=0) else None


def frame_number(time: float, fps: float | None, tolerance: float = 1e-9) -> float:
    """Returns the number of the frame at this time, without the rounding error of the division."""
    number = time * (fps or 1)
    rounded = (float(f"{number:.{digits}g}") for digits in range(1, 18))
    near = (
        candidate
        for candidate in rounded
        if math.isclose(candidate, number, rel_tol=tolerance, abs_tol=tolerance)
    )
    return next(near, number)


def listed_times(seconds: Sequence[float], fps: float | None = None) -> Timing:
    """Returns the timing of frames, each at its time, at this rate or else at the median rate."""
    if fps is None:
        step = statistics.median_low(np.diff(seconds).tolist())
        # Whole steps are those of frame numbers; the digits remove the rounding of the division.
        is_whole = step >= 1 and math.isclose(step, round(step))
        fps = None if is_whole else float(f"{1 / step:.12g}")
    numbers = [frame_number(second, fps) for second in seconds]
    return Timing(fps, numbers[0], None if spacing(numbers) == 1 else np.array(numbers))


def numbers_of_files(header: Header, names: FrameNames) -> list[Number]:
    """Returns the numbers of files with one frame each: those of the frames.

    They count from 0 if some would look missing, or the names cannot hold their decimals.
    """
    numbers: list[Number] = [header.number(frame) for frame in range(header.n_frames)]
    kept = all(names.number(names.name(number)) == number for number in numbers)
    most = 1.5 * usual_distance(numbers)
    is_even = all(after - before <= most for before, after in pairwise(numbers))
    return numbers if kept and is_even else [*range(len(numbers))]


def are_clock_times(numbers: Sequence[float]) -> bool:
    """Whether the numbers of frames are seconds since 1970, as recorders name their images."""
    return numbers[0] >= _CLOCK and any(number != int(number) for number in numbers)


def called(number: float, numbers: Sequence[float]) -> str:
    """Names the frame with this number; by the seconds from the first if they are clock times."""
    if are_clock_times(numbers):
        return f"the frame at {number - numbers[0]:.3f} s"
    return f"frame {number:.15g}"


def timing_of(numbers: Sequence[Number]) -> dict[str, Any]:
    """Returns the start, the times and the rate of a header of frames with these numbers."""
    if are_clock_times(numbers):
        return {"start": numbers[0], "times": np.array(numbers, np.float64), "fps": 1.0}
    is_counted = all(number == numbers[0] + at for at, number in enumerate(numbers))
    return {"start": numbers[0], "times": None if is_counted else np.array(numbers, np.float64)}


def index_of(header: Header, number: float, argument: str) -> int:
    """Returns the index of the frame with this number in its file."""
    check_number(argument, number)
    result = np.flatnonzero(header.numbers == number)
    if len(result) == 0:
        first, last = header.number(0), header.number(header.n_frames - 1)
        span = f"{first} to {last}" if first != last else str(first)
        raise InputError(f"there is no frame {number:g}, only {span}", argument=argument)
    return int(result[0])


def indices_of(
    numbers: NDArray[np.float64], frames: slice | range, argument: str = "frames"
) -> range:
    """Returns the indices, among these numbers, from one number to, but without, another one."""
    check_slice(argument, frames)
    end = float(numbers[-1] + np.diff(numbers[-2:]).max(initial=1))
    begin = numbers[0] if frames.start is None else frames.start
    stop = end if frames.stop is None else frames.stop
    first, last = np.searchsorted(numbers, (begin, stop)).tolist()
    if not (numbers[0] <= begin < stop <= end and first < last):
        raise InputError(
            f"must be some of {numbers[0]:.15g}:{end:.15g}, by their numbers, not {begin:.15g}:"
            f"{stop:.15g}",
            argument=argument,
        )
    return range(first, last, frames.step or 1)


def check_slice(argument: str, frames: slice | range) -> None:
    """Refuses what is no slice or range of numbers of frames."""
    if not isinstance(frames, slice | range):
        raise KindError(f"must be a slice, not {type(frames).__name__}", argument=argument)
    for bound in (frames.start, frames.stop):
        if bound is not None:
            check_number(argument, bound)
    if frames.step is not None:
        check_integer(argument, frames.step, 1)


def mean_rate(header: Header) -> float | None:
    """Returns the mean number of frames per second, which differs from `fps` if times have gaps."""
    times = header.times
    if header.fps is None or times is None or len(times) < 2:
        return header.fps
    return float(header.fps * (len(times) - 1) / (times[-1] - times[0]))
