"""Zeros that a sensor wrote into a first frame, in which they are taken as positions."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..sequence import Mask, Positions
from .finding import Indices

_FAR = 4.0  # times the median edge
_SAMPLE = 10_000  # faces


def stray_zeros(points: Positions, observed: Mask, faces: NDArray[np.integer[Any]]) -> Mask:
    """Returns a (k,) bool array: which vertices at exactly (0, 0, 0) do not belong there.

    Vertices at the origin that are connected by edges are considered together. They belong there if
    the edges to other vertices are about as long as edges elsewhere. Little memory is needed unless
    there are many of them.

    Args:
        points: (k, 3) of one frame.
        observed: (k,) bool, the vertices to consider.
        faces: (m, 3); those with vertices that do not exist are ignored.
    """
    k = len(points)
    zero = observed & ~points.any(axis=1)
    if not zero.any() or (zero == observed).all():
        return np.zeros(k, np.bool_)
    faces = faces[((faces >= 0) & (faces < k)).all(axis=1)]
    faces = faces[observed[faces].all(axis=1)]
    at_zero = zero[faces].any(axis=1)
    elsewhere = lengths_of(points, edges_of(faces[~at_zero][:_SAMPLE]))
    ends = edges_of(faces[at_zero])
    n_zero = zero[ends].sum(axis=1)
    inside, leaving = ends[n_zero == 2], ends[n_zero == 1]
    group = connected(k, inside[:, 0], inside[:, 1])
    own = group[np.where(zero[leaving[:, 0]], leaving[:, 0], leaving[:, 1])]
    count = np.bincount(own, minlength=k)
    total = np.bincount(own, lengths_of(points, leaving), minlength=k)
    far = total > _FAR * count * (np.median(elsewhere) if len(elsewhere) else 0.0)
    alone = (count == 0) & (np.bincount(group[zero], minlength=k) > 1)
    return np.asarray(zero & (far | alone)[group])


def connected(n: int, a: Indices, b: Indices) -> Indices:
    """Labels `n` items with the smallest member of their group; a[i] and b[i] are connected."""
    label = np.arange(n)
    while True:
        before = label.copy()
        smaller = np.minimum(before[a], before[b])
        # Update the old roots too, so that whole groups are joined and not only their ends.
        for end in (a, b):
            np.minimum.at(label, before[end], smaller)
            np.minimum.at(label, end, smaller)
        while not np.array_equal(root := label[label], label):
            label = root
        if np.array_equal(label, before):
            return label


def edges_of(faces: NDArray[np.integer[Any]]) -> Indices:
    """Returns the three sides of each face, (3 m, 2)."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)


def lengths_of(points: Positions, ends: Indices) -> NDArray[np.float64]:
    """Returns the distances between the ends, (e,)."""
    sides = points[ends[:, 0]].astype(np.float64) - points[ends[:, 1]]
    return np.asarray(np.linalg.norm(sides, axis=1))
