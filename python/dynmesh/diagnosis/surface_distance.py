"""How far points are from the surface of a mesh, and the rigid motion that brings them near."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..sequence import Positions

_Floats = NDArray[np.float64]

_SAMPLES = 5000
_FEW_SAMPLES = 2000
"""Of a surface, for distances and for the motion; more take longer and change little."""

_NEAR = 0.01

_AT_ONCE = 1_000_000
"""Pairs of which the distances are computed at once; many more would not fit in the cache."""


class Surface:
    """A mesh whose vertices, or some of them, stand for the planes around them.

    Attributes:
        points: (n, 3) the vertices.
        faces: (m, 3) triangles.
        normals: unit normals at the vertices of triangles that have an area.
        mean_edge: the mean length of the sides of the triangles.
        size: the diagonal of the bounding box.
        unit: the distance that counts as near: a mean edge, or 1 % of the size if that is less.
    """

    def __init__(self, faces: NDArray[np.integer[Any]], points: Positions) -> None:
        """Computes the normals."""
        self.faces = faces
        self.points = points.astype(np.float64)
        a, b, c = self.points[faces.T]
        sides = [np.linalg.norm(one - other, axis=1) for one, other in ((a, b), (b, c), (c, a))]
        self.mean_edge = float(np.mean(sides))
        self.size = float(np.linalg.norm(np.ptp(self.points, axis=0)))
        self.unit = min(self.mean_edge, _NEAR * self.size)
        weighted = np.cross(b - a, c - a)
        normals = np.zeros_like(self.points)
        for corner in faces.T:
            for axis in range(3):
                normals[:, axis] += np.bincount(corner, weighted[:, axis], len(normals))
        lengths = np.linalg.norm(normals, axis=1)
        used = np.flatnonzero(lengths > 0)
        self._samples = self.points[used]
        self.normals = normals[used] / lengths[used, None]

    def nearest(
        self, points: _Floats, most_samples: int = _SAMPLES
    ) -> tuple[_Floats, _Floats, _Floats]:
        """Returns for (n, 3) points the nearest samples, their normals, and the distances."""
        every = max(1, -(-len(self._samples) // most_samples))
        all_samples, all_normals = self._samples[::every], self.normals[::every]
        reach = self.mean_edge / 2 * np.sqrt(every)  # half of the way between two samples, about
        middle = all_samples.mean(axis=0)
        theirs = (all_samples - middle).astype(np.float32)
        squares = (theirs**2).sum(axis=1)
        best = np.zeros(len(points), np.int64)
        step = max(1, _AT_ONCE // len(theirs))
        for first in range(0, len(points), step):
            ours = (points[first : first + step] - middle).astype(np.float32)
            best[first : first + step] = (squares - 2 * ours @ theirs.T).argmin(axis=1)
        samples, normals = all_samples[best], all_normals[best]
        apart = points - samples
        height = (apart * normals).sum(axis=1)
        aside = np.sqrt(np.maximum((apart**2).sum(axis=1) - height**2, 0))
        return samples, normals, np.hypot(height, np.maximum(aside - reach, 0))

    def distances(self, points: _Floats) -> _Floats:
        """Returns how far (n, 3) points are from the surface, about."""
        return self.nearest(points)[2]

    def drawn(self, points: _Floats, steps: int = 8) -> _Floats:
        """Returns the points after the rigid motion that brings most of them near the surface.

        What is far shrinks from a twentieth of the size to the unit; see :func:`motion_onto`. The
        points stay where they are if that is no worse.
        """
        if len(points) < 6:
            return points
        last, start = self.unit, self.size / 20
        moved = points
        for scale in np.geomspace(max(start, last), last, steps):
            samples, normals, distances = self.nearest(moved, _FEW_SAMPLES)
            heights = ((moved - samples) * normals).sum(axis=1)
            rotation, shift = motion_onto(moved, normals, heights, distances / scale)
            moved = moved @ rotation.T + shift
        return moved if self.typical(moved) < self.typical(points) else points

    def typical(self, points: _Floats) -> float:
        """Returns the mean distance of the nearest three quarters from the surface, in units."""
        distances = np.sort(self.nearest(points)[2] / self.unit)
        return float(distances[: -(-3 * len(distances) // 4)].mean()) if len(points) else 0.0


def motion_onto(
    points: _Floats, normals: _Floats, heights: _Floats, apart: _Floats
) -> tuple[_Floats, _Floats]:
    """Returns the rotation and the shift that bring points nearest to planes (Chen, Medioni 1991).

    Args:
        points: (n, 3), at least 6.
        normals: (n, 3) of the plane of each point.
        heights: (n,) signed distances from these.
        apart: (n,) how far points are in multiples of what is far. Far ones count little, with the
            weights of Geman and McClure.
    """
    weights = 1 / (1 + apart**2) ** 2
    middle = np.average(points, axis=0, weights=weights)
    size = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
    rows = np.concatenate([np.cross((points - middle) / size, normals), normals], axis=1)
    system = (rows * weights[:, None]).T @ rows
    # A motion that no plane determines, as around the axis of a cylinder, stays small.
    system += 1e-6 * np.trace(system) * np.eye(6)
    motion = np.linalg.solve(system, -(rows * weights[:, None]).T @ heights)
    rotation = _rotation(motion[:3] / size)
    return rotation, middle + motion[3:] - rotation @ middle


def _rotation(vector: _Floats) -> _Floats:
    """Returns the rotation about a vector by its length (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / (angle or 1.0)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
