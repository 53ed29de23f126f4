"""Zeros that a sensor wrote into a first frame, in which they are taken as positions."""

import numpy as np

from ..sequence import Mask, Positions
from .connection import connected
from .finding import Indices

_FAR = 4.0  # times the median edge


def stray_zeros(points: Positions, observed: Mask, ends: Indices) -> Mask:
    """Returns a (k,) bool array: which vertices at exactly (0, 0, 0) do not belong there.

    Vertices at the origin that are connected by edges are considered together. They belong there if
    the edges to other vertices are about as long as edges elsewhere.

    Args:
        points: (k, 3) of one frame.
        observed: (k,) bool, the vertices to consider.
        ends: (e, 2) int64, the vertices of each edge.
    """
    zero = observed & ~points.any(axis=1)
    if not zero.any() or (zero == observed).all():
        return np.zeros(len(points), np.bool_)
    ends = ends[observed[ends].all(axis=1)]
    lengths = np.linalg.norm(np.diff(points[ends].astype(np.float64), axis=1)[:, 0], axis=1)
    n_zero = zero[ends].sum(axis=1)
    elsewhere = lengths[n_zero == 0]
    inside, leaving = ends[n_zero == 2], n_zero == 1
    group = connected(len(points), inside[:, 0], inside[:, 1])
    member = np.where(zero[ends[leaving, 0]], ends[leaving, 0], ends[leaving, 1])
    count = np.bincount(group[member], minlength=len(points))
    total = np.bincount(group[member], lengths[leaving], minlength=len(points))
    far = total > _FAR * count * (np.median(elsewhere) if len(elsewhere) else 0.0)
    alone = (count == 0) & (np.bincount(group[zero], minlength=len(points)) > 1)
    return np.asarray(zero & (far | alone)[group])
