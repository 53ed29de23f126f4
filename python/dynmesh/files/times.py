"""Frames per second and the number of the first frame, told from times in seconds.

Where nobody knows the frames per second, formats that hold times get the numbers of the frames.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np


def spacing(times: Sequence[float]) -> float | None:
    """How far apart the times are; None where there is only one or they are not even."""
    if len(times) < 2:
        return None
    step = (times[-1] - times[0]) / (len(times) - 1)
    return float(step) if np.allclose(np.diff(times), step, rtol=1e-6, atol=0) else None


def first_frame(time: float, fps: float | None) -> float:
    """The number of the frame at this time, without what rounding has left of its division."""
    number = time * (fps or 1)
    near = (n for n in shortened(number) if math.isclose(n, number, rel_tol=1e-9, abs_tol=1e-9))
    return next(near, number)


def shortened(number: float) -> Iterator[float]:
    """Yields the number with 1, 2, ..., 17 digits."""
    for digits in range(1, 18):
        yield float(f"{number:.{digits}g}")
