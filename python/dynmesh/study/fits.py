"""Lines fitted to measurements."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Numbers = Sequence[float] | NDArray[np.floating]


class LinearFit(NamedTuple):
    """The slope and intercept of a line, and the coefficient of determination."""

    slope: float
    intercept: float
    r_squared: float


def fit_line(x: Numbers, measured: Numbers) -> LinearFit:
    """Fit a line to what was measured at `x`, by least squares."""
    at, values = np.asarray(x, np.float64), np.asarray(measured, np.float64)
    slope, intercept = np.polyfit(at, values, 1)
    residual, spread = values - (slope * at + intercept), values - values.mean()
    r_squared = 1 - residual @ residual / (spread @ spread)
    return LinearFit(float(slope), float(intercept), float(r_squared))
