"""What standard errors say of distances, and how well they describe true errors."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .sequence import StandardErrorOf

Floats = NDArray[np.floating[Any]]


class Rule(NamedTuple):
    """What standard errors of a kind promise.

    Attributes:
        intervals: the distances within which these shares of the errors lie, in standard errors:
            the roots of the quantiles of a chi-squared distribution.
        coordinates: how many coordinates the distances have, its degrees of freedom.
    """

    intervals: dict[float, float]
    coordinates: int


RULES: dict[StandardErrorOf, Rule] = {
    "position": Rule({0.5: 1.538, 0.9: 2.5}, 3),
    "surface": Rule({0.5: 0.674, 0.9: 1.645}, 1),
}

FEWEST = 10
"""Frames with fewer filled-in vertices have no rank correlation."""


@dataclass(frozen=True)
class Calibration:
    """How well standard errors describe true errors, over the estimated vertices of all frames.

    Estimated are the filled-in vertices of a completed sequence, and all of a tracked one.

    Attributes:
        vertices: the number of estimated vertices with a finite standard error, over all frames.
        coverage_50: the share of them whose error is at most 1.538 standard errors, or 0.674 if
            they are of the surface: 0.5 if the standard errors are right.
        coverage_90: the same for 2.5 and 1.645 standard errors: 0.9.
        rms_ratio: the root mean square error over the root mean square standard error of a
            position, which is that of a coordinate times the root of 3, or of the surface: 1, and
            more if the standard errors are too small. NaN if all of them are 0.
        rank_correlation: Spearman's rank correlation of error and standard error, the mean over
            frames; None if no frame has one.
        generation_correlation: the same for generations in place of standard errors.
        standard_error_of: what they are of, and so the errors they are compared with: "position",
            distances from true positions, or "surface", distances from the true surface.
    """

    vertices: int
    coverage_50: float
    coverage_90: float
    rms_ratio: float
    rank_correlation: float | None
    generation_correlation: float | None
    standard_error_of: StandardErrorOf


class Calibrating:
    """Gathers a :class:`Calibration`, one frame at a time."""

    def __init__(self, standard_error_of: StandardErrorOf = "position") -> None:
        """Begin without a frame, for standard errors of one kind."""
        self._of: StandardErrorOf = standard_error_of
        self._rule = RULES[standard_error_of]
        self._vertices = 0
        self._within = dict.fromkeys(self._rule.intervals, 0)
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
            error: (k,) the distances from the true positions, or from the true surface.
            standard_error: (k,) in the same unit.
            filled: (k,) the vertices that were estimated; others are left out, and so are those
                without a finite standard error.
            generation: (k,), to compare.
        """
        counted = filled & np.isfinite(standard_error)
        off = error[counted].astype(np.float64)
        bars = standard_error[counted].astype(np.float64)
        self._vertices += len(off)
        for share, factor in self._rule.intervals.items():
            self._within[share] += int(np.count_nonzero(off <= factor * bars))
        self._errors += float(off @ off)
        self._expected += self._rule.coordinates * float(bars @ bars)
        compared = {"standard_error": standard_error, "generation": generation}
        for name, values in compared.items():
            if values is not None and (found := rank_correlation(off, values[counted])) is not None:
                self._correlations[name].append(found)

    def result(self) -> Calibration | None:
        """Return what was found, or None if no vertex was estimated."""
        if self._vertices == 0:
            return None
        ratio = math.sqrt(self._errors / self._expected) if self._expected > 0 else math.nan
        half, most = (within / self._vertices for within in self._within.values())
        means = [float(np.mean(found)) if found else None for found in self._correlations.values()]
        by_error, by_generation = means
        return Calibration(self._vertices, half, most, ratio, by_error, by_generation, self._of)


def estimated(generation: NDArray[Any], standard_error_of: StandardErrorOf) -> NDArray[np.bool_]:
    """Which vertices standard errors speak of: a tracked vertex that was seen is not exact."""
    return np.asarray((generation > 0) | (standard_error_of == "surface"))


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


class Distances:
    """How far off filled-in vertices may be, over all frames, in constant memory.

    Counts standard errors of a coordinate in bins a twentieth wide, relative to their value.
    """

    _STEP = math.log(1.05)

    def __init__(self) -> None:
        """Begin without a frame."""
        self._counts: Counter[float] = Counter()
        self._exact = 0

    def add(self, standard_error: Floats, filled: NDArray[np.bool_]) -> None:
        """Add a frame of (k,) standard errors; only `filled` vertices with finite ones count."""
        values = standard_error[filled & np.isfinite(standard_error)].astype(np.float64)
        positive = values[values > 0]
        self._exact += len(values) - len(positive)
        bins, counts = np.unique(np.rint(np.log(positive) / self._STEP), return_counts=True)
        self._counts.update(dict(zip(bins.tolist(), counts.tolist(), strict=True)))

    def within(self, share: float) -> float | None:
        """Return the distance within which this share of them is expected to be; None without any.

        Errors are taken to be normal and alike in all directions.
        """
        whole = self._exact + self._counts.total()
        if whole == 0:
            return None
        if self._exact >= share * whole:
            return 0.0
        counts = np.array([*self._counts.values()])
        bars = np.exp(np.array([*self._counts]) * self._STEP)
        low, high = 0.0, 10.0 * float(bars.max())
        for _ in range(60):
            middle = (low + high) / 2
            found = self._exact + float(counts @ [_chi(middle / bar) for bar in bars.tolist()])
            low, high = (middle, high) if found < share * whole else (low, middle)
        return high


def _chi(distance: float) -> float:
    """The distribution of chi with three degrees of freedom, in standard errors."""
    along_one = math.erf(distance / math.sqrt(2))
    return along_one - math.sqrt(2 / math.pi) * distance * math.exp(-(distance**2) / 2)


def in_words(within_90: float | None, metres_per_unit: float | None) -> str | None:
    """Say within which distance 90 % of the filled-in vertices are; None without any."""
    if within_90 is None:
        return None
    shown, unit = f"{within_90:.2g}", ", in the unit of the positions"
    if metres_per_unit is not None:
        shown, unit = f"{1000 * metres_per_unit * within_90:.2g} mm", ""
    return f"90 % of the filled-in vertices are expected to be within {shown}{unit}"
