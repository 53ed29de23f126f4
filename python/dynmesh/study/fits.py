"""Lines fitted to measurements."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class LinearFit(NamedTuple):
    """The slope and intercept of a line, and the coefficient of determination."""

    slope: float
    intercept: float
    r_squared: float


def fit_line(x: NDArray[np.float64], measured: NDArray[np.float64]) -> LinearFit:
    """Fit a line to what was measured at `x`, by least squares."""
    slope, intercept = np.polyfit(x, measured, 1)
    correlation = np.corrcoef(x, measured)[0, 1]
    return LinearFit(float(slope), float(intercept), float(correlation**2))
