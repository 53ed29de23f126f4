"""Paths over time, and how bones carry one another."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ._skin import Floats, rigid_motions

Keys = tuple[tuple[float, ...], ...]
"""Times, each with the values at that time."""


def track(times: Floats, keys: Keys) -> Floats:
    """Return (values, n) smooth paths through `keys`, held constant before and after.

    Piecewise cubic, monotone between keys (Fritsch and Butland 1984): constant values stay
    constant.
    """
    table = np.array(keys)
    knots, values = table[:, 0], table[:, 1:].T
    widths = np.diff(knots)
    secants = np.diff(values) / widths
    before, after = secants[:, :-1], secants[:, 1:]
    turning = before * after <= 0.0
    slopes = np.zeros_like(values)
    slopes[:, 1:-1] = 2.0 * before * after / np.where(turning, np.inf, before + after)
    i = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(widths) - 1)
    u = np.clip((times - knots[i]) / widths[i], 0.0, 1.0)
    eased = values[:, i] + np.diff(values)[:, i] * u * u * (3.0 - 2.0 * u)
    bulge = slopes[:, i] * (1.0 - u) - slopes[:, i + 1] * u
    return np.asarray(eased + widths[i] * u * (1.0 - u) * bulge)


def turn(axis: int, degrees: Floats) -> Floats:
    """Return rotations (n, 3, 3) about a coordinate axis."""
    angle = np.radians(degrees)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrices = np.zeros((len(angle), 3, 3))
    matrices[:, axis, axis] = 1.0
    matrices[:, i, i] = matrices[:, j, j] = np.cos(angle)
    matrices[:, j, i] = np.sin(angle)
    matrices[:, i, j] = -np.sin(angle)
    return matrices


def chained(joints: ArrayLike, parents: Sequence[int | None], turns: Sequence[Floats]) -> Floats:
    """Return the motions of bones (n, b, 8), dual quaternions, each turned in that of its parent.

    Args:
        joints: (b, 3) where each bone is joined to its parent at rest.
        parents: the number of each bone's parent, a lower one.
        turns: (n, 3, 3) of each bone.
    """
    rotations: list[Floats] = []
    shifts: list[Floats] = []
    for joint, parent, turned in zip(np.asarray(joints, float), parents, turns, strict=True):
        before = np.eye(3) if parent is None else rotations[parent]
        origin = np.zeros(3) if parent is None else shifts[parent]
        rotations.append(before @ turned)
        shifts.append(origin + (before - rotations[-1]) @ joint)
    return rigid_motions(rotations, shifts, parents)
