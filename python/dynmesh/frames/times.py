"""Conversion between the times of frames and their rate and numbers.

If the frames per second are unknown, formats with times in seconds get the numbers of the frames.
"""

import math
import statistics
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..sequence import numbers_of
from .header import Header

broadcast = (23.976, 29.97, 59.94, 24000 / 1001, 30000 / 1001, 60000 / 1001)
"""Common frame rates that need more digits than some files store."""


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


def rate_of(step: float) -> float | None:
    """Returns frames per second; None for a step of one, as of frame numbers."""
    # The digits remove the rounding error of the division.
    return None if math.isclose(step, 1) else float(f"{1 / step:.12g}")


def frame_number(time: float, fps: float | None, tolerance: float = 1e-9) -> float:
    """Returns the number of the frame at this time, without the rounding error of the division."""
    number = time * (fps or 1)
    for near in shortened(number):
        if math.isclose(near, number, rel_tol=tolerance, abs_tol=tolerance):
            return near
    return number


def uneven(seconds: Sequence[float], fps: float | None = None) -> Timing:
    """Returns the timing of unevenly spaced frames, at this rate or else at the median rate."""
    if fps is None:
        fps = rate_of(statistics.median_low(np.diff(seconds).tolist()))
    times = np.array([frame_number(second, fps) for second in seconds])
    return Timing(fps, float(times[0]), times)


def frame_numbers(header: Header) -> NDArray[np.float64]:
    """Returns (n,) the number of each frame."""
    return numbers_of(header, header.n_frames)


def frame_seconds(header: Header) -> NDArray[np.float64]:
    """Returns (n,) the time of each frame in seconds, or its number if the rate is unknown."""
    return frame_numbers(header) / (header.fps or 1)


def mean_rate(header: Header) -> float | None:
    """Returns the mean number of frames per second, which differs from `fps` if times have gaps."""
    times = header.times
    if header.fps is None or times is None or len(times) < 2:
        return header.fps
    return float(header.fps * (len(times) - 1) / (times[-1] - times[0]))


def shortened(number: float) -> Iterator[float]:
    """Yields the number rounded to 1, 2, ..., 17 digits."""
    for digits in range(1, 18):
        yield float(f"{number:.{digits}g}")
