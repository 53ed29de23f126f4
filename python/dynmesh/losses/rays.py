"""Intersections of the rays of a camera with triangles, exact but for rounding.

Points are given as (x, y, z) such that their image is (x / z, y / z), and z is positive in front of
the camera. A triangle that crosses the plane of the camera needs no clipping, as no point of it is
projected: a ray is compared with the planes through the camera and the sides of the triangle.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from .._arrays import Floats, Integers, Positions

TOLERANCE = 1e-9
"""Triangles are enlarged by this share of their size, so that no ray slips between two of them."""

_PAIRS_AT_ONCE = 1 << 18
"""The number of pairs of a triangle and a ray that are compared at a time. It bounds the memory;
more pairs would not fit in the processor's cache."""


class Triangles:
    """The triangles that rays within an image can meet.

    Attributes:
        number: (t,) their numbers among all triangles.
        low: (t, 2) lower corners of their bounding boxes in the image.
        high: (t, 2) upper corners.
        depth: (t,) lower bounds of z, wherever a ray meets them.
    """

    def __init__(self, corners: Floats, least: Any, most: Any) -> None:
        """Selects those in the image, whose bounds are two numbers or one for both axes.

        The corners are (3, m, 3), as numpy is slow along short last axes. A triangle with a corner
        that is not finite is left out, as is one that is seen edge-on.
        """
        normals = np.cross(np.roll(corners, -1, axis=0), np.roll(corners, -2, axis=0))
        # a . (b x c): six times the volume between triangle and camera, 0 if it is seen edge-on.
        volumes = np.einsum("tx,tx->t", corners[0], normals[0])
        depth = corners[:, :, 2]
        image = corners[:, :, :2] / np.where(depth > 0, depth, 1)[:, :, None]
        low, high = image.min(axis=0), image.max(axis=0)
        # A triangle that crosses the plane of the camera has an unbounded image; one behind the
        # camera has an empty one.
        crosses = depth.min(axis=0) <= 0
        low[crosses], high[crosses] = -np.inf, np.inf
        low[depth.max(axis=0) <= 0] = np.inf
        # Comparisons are False for triangles with a corner that is not finite.
        touches = (low <= most).all(axis=1) & (high >= least).all(axis=1)
        self.number = np.flatnonzero(touches & (volumes != 0))
        self.low, self.high = low[self.number], high[self.number]
        # Beyond the sides, by the tolerance, a triangle can be met nearer than its corners are.
        z = corners[:, self.number, 2]
        self.depth = z.min(axis=0) - 2 * TOLERANCE * np.ptp(z, axis=0)
        self._volumes = np.abs(volumes[self.number])  # both sides are met
        self._normals = normals[:, self.number] * np.sign(volumes[self.number])[:, None]

    def meet(self, triangle: Integers, ray: Floats) -> tuple[Integers, Floats, Floats, Floats]:
        """Compares (n,) of these triangles with (n, 3) rays, pair by pair.

        A ray p meets the triangle at p times volume / (u + v + w), where u, v, w are the volumes
        that p spans with the sides: none is negative if it passes inside. Returns the numbers of
        the pairs that meet, their volumes, their sums u + v + w, and (3, n) u, v and w, which are
        the parts of the corners in the point where they meet, times the sum.
        """
        # Here, numpy takes rows several times as fast as it indexes them.
        normals = (np.take(normal, triangle, axis=0) for normal in self._normals)
        u, v, w = (np.einsum("px,px->p", normal, ray) for normal in normals)
        whole = u + v + w
        inside = (whole > 0) & (np.minimum(np.minimum(u, v), w) >= -TOLERANCE * whole)
        pair = np.flatnonzero(inside)
        shares = np.stack([u[pair], v[pair], w[pair]])
        return pair, self._volumes[triangle[pair]], whole[pair], shares


def in_axes(points: Positions, origin: Any, axes: Floats) -> Floats:
    """Returns (k, 3) positions in other axes, the columns of a matrix; NaN if one is not finite."""
    x, y, z = np.isfinite(points).T  # numpy is slow along short last axes
    finite = (x & y & z)[:, None]
    return np.asarray((np.where(finite, points, np.nan) - origin) @ axes)


def pairs(
    low: Integers, high: Integers, columns: int, starts: Integers
) -> Iterator[tuple[Integers, Integers]]:
    """Yields pairs of a box and an item in one of its cells, a portion at a time.

    Boxes reach from the cells `low` to `high`, (n, 2) columns and rows of a grid. The items of its
    cells, row by row, are those from `starts` of a cell to that of the next.
    """
    # Runs of consecutive items, one for each row of cells of each box.
    n_rows = high[:, 1] - low[:, 1] + 1
    box = np.repeat(np.arange(len(low)), n_rows)
    row = _ranges(low[:, 1], n_rows)
    first = starts[row * columns + low[box, 0]]
    lengths = starts[row * columns + high[box, 0] + 1] - first
    filled = lengths > 0
    box, first, lengths = box[filled], first[filled], lengths[filled]
    ends = np.cumsum(lengths)
    limits = np.searchsorted(ends, np.arange(0, int(lengths.sum()), _PAIRS_AT_ONCE))
    for run in map(slice, limits, [*limits[1:], len(ends)]):
        yield np.repeat(box[run], lengths[run]), _ranges(first[run], lengths[run])


def _ranges(starts: Integers, lengths: Integers) -> Integers:
    """Returns consecutive integers from each start, as many as its length, as one array."""
    before = np.cumsum(lengths) - lengths
    return np.asarray(np.repeat(starts - before, lengths) + np.arange(lengths.sum()))
