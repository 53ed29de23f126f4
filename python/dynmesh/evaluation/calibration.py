"""How well standard errors describe true errors."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]


WITHIN_50, WITHIN_90 = 1.538, 2.5
"""The standard errors of a coordinate within which these shares of the distances lie: the roots of
the quantiles of a chi-squared distribution with three degrees of freedom."""

FEWEST = 10
"""Frames with fewer filled-in vertices have no rank correlation."""


@dataclass(frozen=True)
class Calibration:
    """How well standard errors describe true errors, over the filled-in vertices of all frames.

    Attributes:
        vertices: the number of filled-in vertices with a finite standard error, over all frames.
        coverage_50: the share of them whose error is at most 1.538 standard errors: 0.5 if the
            standard errors are right.
        coverage_90: the same for 2.5 standard errors: 0.9.
        rms_ratio: the root mean square error over the root mean square standard error of a
            position, which is that of a coordinate times the root of 3: 1, and more if the standard
            errors are too small. NaN if all of them are 0.
        rank_correlation: Spearman's rank correlation of error and standard error, the mean over
            frames; None if no frame has one.
        generation_correlation: the same for generations in place of standard errors.
    """

    vertices: int
    coverage_50: float
    coverage_90: float
    rms_ratio: float
    rank_correlation: float | None
    generation_correlation: float | None


class Calibrating:
    """Gathers a :class:`Calibration`, one frame at a time."""

    def __init__(self) -> None:
        self._vertices = 0
        self._within = dict.fromkeys((WITHIN_50, WITHIN_90), 0)
        self._errors = self._expected = 0.0
        self._correlations: dict[str, list[float]] = {
            name: [] for name in ("standard_error", "generation")
        }

    def add(
        self,
        error: Floats,
        standard_error: Floats,
        *,
        filled: NDArray[np.bool_],
        generation: NDArray[Any] | None = None,
    ) -> None:
        """Add a frame.

        Args:
            error: (k,) the distances from the true positions.
            standard_error: (k,) in the same unit.
            filled: (k,) the vertices that were filled in; others are left out, and so are those
                without a finite standard error.
            generation: (k,), to compare.
        """
        counted = filled & np.isfinite(standard_error)
        off = error[counted].astype(np.float64)
        bars = standard_error[counted].astype(np.float64)
        self._vertices += len(off)
        for factor in self._within:
            self._within[factor] += int(np.count_nonzero(off <= factor * bars))
        self._errors += float(off @ off)
        self._expected += 3 * float(bars @ bars)
        compared = {"standard_error": standard_error, "generation": generation}
        for name, values in compared.items():
            if (
                values is not None
                and (result := rank_correlation(off, values[counted])) is not None
            ):
                self._correlations[name].append(result)

    def result(self) -> Calibration | None:
        """Return what was found, or None if no vertex was filled in."""
        if self._vertices == 0:
            return None
        ratio = math.sqrt(self._errors / self._expected) if self._expected > 0 else math.nan
        half, most = (within / self._vertices for within in self._within.values())
        means = [
            float(np.mean(result)) if result else None for result in self._correlations.values()
        ]
        return Calibration(self._vertices, half, most, ratio, *means)


def rank_correlation(a: Sequence[float] | Floats, b: Sequence[float] | Floats) -> float | None:
    """Return Spearman's rank correlation; equal values have their mean rank.

    None if there are fewer than :data:`FEWEST` values, or if all of one side are equal.
    """
    ranks = [_ranks(np.asarray(values)) for values in (a, b)]
    if len(ranks[0]) < FEWEST:
        return None
    first, second = (of_side - of_side.mean() for of_side in ranks)
    size = float(np.sqrt((first @ first) * (second @ second)))
    return float(first @ second) / size if size > 0 else None


def _ranks(values: NDArray[Any]) -> NDArray[np.float64]:
    _, number, counts = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(counts)
    return np.asarray((last - (counts - 1) / 2)[number], np.float64)
