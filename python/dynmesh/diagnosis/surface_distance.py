"""How far points are from the surface of a mesh."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..normals import vertex_normals
from ..sequence import Positions

_Floats = NDArray[np.float64]

_SAMPLES = 5000
"""Of a surface; more take longer and change little."""

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
    """

    def __init__(self, faces: NDArray[np.integer[Any]], points: Positions) -> None:
        """Computes the normals."""
        self.faces = faces
        self.points = points.astype(np.float64)
        a, b, c = self.points[faces.T]
        sides = [np.linalg.norm(one - other, axis=1) for one, other in ((a, b), (b, c), (c, a))]
        self.mean_edge = float(np.mean(sides))
        self.size = float(np.linalg.norm(np.ptp(self.points, axis=0)))
        normals = vertex_normals(faces, self.points)
        used = np.flatnonzero(normals.any(axis=1))
        self._samples = self.points[used]
        self.normals = normals[used]

    def distances(self, points: _Floats) -> _Floats:
        """Returns how far (n, 3) points are from the surface, about."""
        every = max(1, -(-len(self._samples) // _SAMPLES))
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
        apart = points - all_samples[best]
        height = (apart * all_normals[best]).sum(axis=1)
        aside = np.sqrt(np.maximum((apart**2).sum(axis=1) - height**2, 0))
        return np.asarray(np.hypot(height, np.maximum(aside - reach, 0)))
