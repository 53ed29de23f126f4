"""Measures of meshes: edges, size, normals, and which way is up."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats, Positions
from ._checks import check_complete
from ._errors import InputError, locating
from .polygons import Faces
from .topology import cells


def mean_edge_of(first_frame: Positions, faces: Faces) -> float:
    """Returns the mean length of the edges, the unit of noise and outliers."""
    with locating(frame=0):
        check_complete(None, first_frame)
    offsets, neighbours = cells(faces, len(first_frame))
    vertices = np.repeat(np.arange(len(first_frame)), np.diff(offsets))
    edges = first_frame.astype(np.float64)[vertices] - first_frame[neighbours]
    lengths = np.linalg.norm(edges, axis=1)
    if not lengths.any():
        raise InputError("frame 0 must have edges longer than 0, but has none", argument="frames")
    return float(lengths.mean())


def size_of(points: Positions) -> float:
    """The diagonal of the bounding box; 1 if there is none."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0 if len(points) else 1.0


def likely_up(first: Positions, said: str | None) -> str:
    """Returns the up axis: as a file states it, else z for a flat sheet or what is tall, else y.

    That is tall which is much higher in z than in y, and not much lower than it is wide.
    """
    if said is not None:
        return said
    finite = first[np.isfinite(first).all(axis=1)]
    _, y, z = extent = np.ptp(finite, axis=0) if len(finite) else np.ones(3)
    is_flat = extent.argmin() == 2 and z < _FLAT * extent.max()
    is_tall = z > _TALL * y and z > 0.9 * extent.max()
    return "z" if is_flat or is_tall else "y"


_FLAT, _TALL = 0.25, 2.0
"""How high a sheet is at most, by its longest side; and something tall, by the other axis."""


def assumed(up: str) -> str:
    """The remark on an up axis that is a guess."""
    return f"assuming that {up} is up, as no file states it"


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
