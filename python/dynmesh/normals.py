"""Normals of surfaces."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def vertex_normals(faces: NDArray[np.integer[Any]], points: Floats) -> Floats:
    """Returns the unit normals of (k, 3) vertices; 0 where there is none."""
    a, b, c = points[faces.T]
    of_faces = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for corner in faces.T:
        for axis in range(3):
            normals[:, axis] += np.bincount(corner, of_faces[:, axis], len(normals))
    return unit(normals)


def unit(vectors: NDArray[Any]) -> Floats:
    """Returns vectors of length 1; zero remains zero."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1))
