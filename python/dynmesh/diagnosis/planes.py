"""The planes of a room, such as floor and walls, among the points of a scan.

The search is RANSAC (Fischler and Bolles 1981). It is written here since the libraries that offer
it for planes are either much larger than dynmesh (Open3D, PCL) or no longer maintained.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..sequence import Mask

_Floats = NDArray[np.float64]

_TRIALS = 1000
_EXAMINED = 2000
_MOST_PLANES = 8
_SHARE = 0.08
"""A plane holds at least this share of the points that are left; random triples miss planes that
hold much less."""


class Plane(NamedTuple):
    """A plane of a room: the points x with ``abs(normal @ x - offset) <= thickness``."""

    normal: _Floats
    offset: float
    thickness: float

    def holds(self, points: NDArray[np.floating[Any]]) -> Mask:
        """Returns which of the (n, 3) points belong to the plane."""
        return np.asarray(np.abs(points @ self.normal - self.offset) <= self.thickness)


def planes_of_room(
    points: NDArray[np.floating[Any]], *, thickness: float, size: float
) -> list[Plane]:
    """Finds the planes that are larger than a subject, the one with most points first.

    Args:
        points: (n, 3) finite positions.
        thickness: how far a point of a plane may be from it, at most. Where points are less
            scattered than this, the plane becomes thinner, so that less of the feet is lost.
        size: the largest extent of the subject. A smaller plane may be a part of it, and stays.

    Returns:
        At most 8 planes; none if there are fewer than 3 points. Equal input gives equal results.
    """
    rng = np.random.default_rng(0)
    left = points.astype(np.float64)
    planes: list[Plane] = []
    while len(left) >= 3 and len(planes) < _MOST_PLANES:
        if np.linalg.norm(np.ptp(left, axis=0)) <= size:
            break
        a, b, c = left[rng.integers(len(left), size=(3, _TRIALS))]
        normals = np.cross(b - a, c - a)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals /= np.where(lengths > 0, lengths, 1)
        some = left[:: -(-len(left) // _EXAMINED)]
        near = np.abs(some @ normals.T - (a * normals).sum(axis=1)) <= thickness
        counts = near.sum(axis=0) * (lengths[:, 0] > 0)
        # A part of the subject may hold more points than what is left of a wall.
        best = [i for i in np.argsort(-counts) if counts[i] >= max(3, _SHARE * len(some))]
        wide = (i for i in best if np.linalg.norm(np.ptp(some[near[:, i]], axis=0)) > size)
        found = (Plane(normals[i], float(a[i] @ normals[i]), thickness) for i in wide)
        fitted = (
            _fitted(_fitted(plane, left, thickness), left, thickness)
            for plane in found
            if extent_of(some[plane.holds(some)]) > size
        )
        plane = next((one for one in fitted if _is_room(one, left, size)), None)
        if plane is None:
            break
        inside = plane.holds(left)
        planes.append(plane)
        left = left[~inside]
    return planes


def _is_room(plane: Plane, points: _Floats, size: float) -> bool:
    """Whether so many points are on a plane, over more than the size of the subject."""
    inside = plane.holds(points)
    enough = np.count_nonzero(inside) >= max(3, _SHARE * len(points))
    return bool(enough and extent_of(points[inside]) > size)


def _fitted(plane: Plane, points: _Floats, most: float) -> Plane:
    """Returns the plane of least squares through its points, as thick as they scatter."""
    own = points[plane.holds(points)]
    if len(own) < 3:
        return plane
    middle = own.mean(axis=0)
    normal = np.linalg.eigh((own - middle).T @ (own - middle))[1][:, 0]
    heights = np.abs((own - middle) @ normal)
    scatter = 1.4826 * float(np.median(heights))
    return Plane(normal, float(middle @ normal), min(most, max(5 * scatter, 0.1 * most)))


def extent_of(points: _Floats) -> float:
    """Returns about the diameter, without the outermost fifth.

    A slab of the subject that continues into a wall is not large by this measure.
    """
    if len(points) == 0:
        return 0.0
    away = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    return 2 * float(np.quantile(away, 0.8))
