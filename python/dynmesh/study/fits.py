"""Lines fitted to measurements."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class LinearFit:
    """A line through measurements, by least squares.

    Attributes:
        slope: the change of the measured quantity for each unit.
        intercept: the measured quantity at zero.
        r_squared: the coefficient of determination.
    """

    slope: float
    intercept: float
    r_squared: float

    @classmethod
    def of(
        cls,
        x: Sequence[float] | NDArray[np.floating],
        measured: Sequence[float] | NDArray[np.floating],
    ) -> "LinearFit":
        """Fit a line to what was measured at `x`."""
        at, values = np.asarray(x, np.float64), np.asarray(measured, np.float64)
        slope, intercept = np.polyfit(at, values, 1)
        residual = values - (slope * at + intercept)
        spread = values - values.mean()
        r_squared = 1 - residual @ residual / (spread @ spread)
        return cls(float(slope), float(intercept), float(r_squared))
