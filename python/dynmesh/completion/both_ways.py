"""Two estimates of a frame, from the frames before it and from those after it, as one."""

import numpy as np
from numpy.typing import NDArray

from ..files import Frame

_SHARED = 0.4
"""The share of the variances of the two estimates that their mean keeps. It would be a half, if
their errors were independent and equal: they are neither, and how far they disagree is added."""


def combined(one: Frame, other: Frame) -> Frame:
    """Returns the mean of two estimates, weighed for each vertex by how far it may be off.

    The weights are s^(-3/2) for the standard error s of a vertex, rather than s^(-2), since s is
    known roughly. A vertex that both observed exactly stays where it was observed. One that the one
    accepted and the other rejected as an outlier is where the latter estimates it.

    Args:
        one: an estimate of a frame, with generation, age and standard errors.
        other: another one of the same frame.
    """
    ages, errors, generations = (
        np.stack([getattr(frame, name) for frame in (one, other)])
        for name in ("age", "standard_error", "generation")
    )
    weights = _weights(ages, errors.astype(np.float64))
    points = np.stack([one.points, other.points]).astype(np.float64)
    mean = np.einsum("wk,wkc->kc", weights, points)
    spread = np.einsum("wk,wkc->k", weights, (points - mean) ** 2) / 3
    variance = np.einsum("wk,wk->k", weights, np.where(weights > 0, errors, 0.0) ** 2)
    observed = ages == 0
    rejected = observed.any(axis=0) & ~observed.all(axis=0)
    exact = ((errors == 0) & observed).all(axis=0)
    heavier = weights.argmax(axis=0)[None]
    return Frame(
        np.where(exact[:, None], one.points, mean).astype(one.points.dtype),
        generation=np.take_along_axis(generations, heavier, 0)[0],
        age=np.where(rejected, ages.max(axis=0), ages.min(axis=0)),
        standard_error=np.sqrt(_SHARED * variance + spread).astype(np.float32),
    )


def _weights(ages: NDArray[np.integer], errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, k), of which the two add up to 1."""
    rejected = (ages[::-1] > 0) & (ages == 0)  # by the other, though observed
    certain, unknown = (errors == 0) & ~rejected, np.isinf(errors)
    with np.errstate(divide="ignore"):
        weights = errors**-1.5
    weights = np.where(certain.any(axis=0), certain, np.where(rejected | unknown, 0.0, weights))
    weights[:, weights.sum(axis=0) == 0] = 1
    return np.asarray(weights / weights.sum(axis=0))
