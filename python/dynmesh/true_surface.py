"""Distances of vertices from the true surface, along which they may have slid."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .sequence import Positions

Floats = NDArray[np.float64]


class TrueSurface:
    """The surface of a mesh whose true positions are known.

    The distance of a vertex is measured along the normal of the nearest true vertex, which is
    sought from the vertex's own true position on, from neighbour to neighbour. So a limb that was
    found on another limb is far from the surface.
    """

    def __init__(self, faces: NDArray[np.integer[Any]], n_vertices: int) -> None:
        """Finds the neighbours of all vertices."""
        self._faces = faces
        sides = np.concatenate([faces[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])
        pairs = np.unique(np.concatenate([sides, sides[:, ::-1]]), axis=0)
        self._neighbours = pairs[:, 1]
        self._begins = np.searchsorted(pairs[:, 0], np.arange(n_vertices + 1))

    def distances(self, points: Positions, truth: Positions) -> Floats:
        """Returns (k,) the distances of (k, 3) points from the surface through (k, 3) others."""
        ours, true = points.astype(np.float64), truth.astype(np.float64)
        nearest = self._nearest(ours, true)
        normals = vertex_normals(self._faces, true)[nearest]
        off = ours - true[nearest]
        along = np.abs((off * normals).sum(axis=1))
        return np.asarray(np.where(normals.any(axis=1), along, np.linalg.norm(off, axis=1)))

    def _nearest(self, ours: Floats, true: Floats) -> NDArray[np.intp]:
        nearest = np.arange(len(ours))
        least = ((ours - true) ** 2).sum(axis=1)
        moving = nearest.copy()
        while len(moving):
            at = nearest[moving]
            begins, counts = self._begins[at], np.diff(self._begins)[at]
            for number in range(counts.max(initial=0)):
                some = counts > number
                here, other = moving[some], self._neighbours[begins[some] + number]
                squares = ((ours[here] - true[other]) ** 2).sum(axis=1)
                nearer = squares < least[here]
                nearest[here[nearer]], least[here[nearer]] = other[nearer], squares[nearer]
            moving = moving[nearest[moving] != at]
        return nearest


def vertex_normals(faces: NDArray[np.integer[Any]], points: Floats) -> Floats:
    """Returns the unit normals of (k, 3) vertices; 0 where there is none."""
    a, b, c = points[faces.T]
    of_faces = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for corner in faces.T:
        for axis in range(3):
            normals[:, axis] += np.bincount(corner, of_faces[:, axis], len(normals))
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.where(lengths > 0, lengths, 1))
