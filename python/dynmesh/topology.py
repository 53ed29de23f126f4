"""The connectivity of a mesh, and its size."""

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._arrays import Floats, Integers, Positions, triangles
from ._checks import check_complete, check_integer
from ._errors import InputError, locating
from .polygons import Faces

__all__ = ["RefusedFace", "TopologyReport", "cells"]


@dataclass(frozen=True)
class RefusedFace:
    """A face that the half-edge mesh cannot represent.

    Attributes:
        index: the row of `faces`.
        kind: "degenerate": a vertex is repeated; "duplicate": an earlier face has the same three
            vertices; "flipped": a neighbouring face has the shared edge in the same direction;
            "non_manifold_edge": an edge already has two faces; "non_manifold_vertex": the faces
            around a vertex would not form a single fan.
        reason: what is wrong, with the vertices or the other face, as text.
    """

    index: int
    kind: Literal["degenerate", "duplicate", "flipped", "non_manifold_edge", "non_manifold_vertex"]
    reason: str


@dataclass(frozen=True)
class TopologyReport:
    """Statistics of the connectivity of a mesh.

    Attributes:
        components: the number of connected components, including isolated vertices.
        isolated_vertices: the number of vertices without an edge.
        boundary_edges: the number of edges with one face, among the faces that are not refused.
        refused_faces: a RefusedFace for each degenerate, duplicate, flipped or non-manifold face.
            Its edges still count in the cells.
    """

    components: int
    isolated_vertices: int
    boundary_edges: int
    refused_faces: list[RefusedFace] = field(repr=False)


def cells(faces: Faces, n_vertices: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The one-ring of every vertex.

    Args:
        faces: (m, 3) integers, or other polygons; see :data:`dynmesh.polygons.Faces`.
        n_vertices: the number of vertices, k.

    Returns:
        offsets (k + 1,) int32 and neighbours int32. The neighbours of vertex i, in ascending order,
        are neighbours[offsets[i]:offsets[i + 1]].
    """
    check_integer("n_vertices", n_vertices, 0, np.iinfo(np.int32).max)
    return _core.cells(triangles(faces, n_vertices), n_vertices)


def edges_of(faces: Faces, n_vertices: int) -> Integers:
    """Returns the vertices of each edge, (e, 2), the lesser first."""
    offsets, neighbours = cells(faces, n_vertices)
    own = np.repeat(np.arange(n_vertices), np.diff(offsets))
    return np.stack([own, neighbours], axis=1)[own < neighbours]


def components_of(edges: Integers, n_vertices: int) -> Integers:
    """Returns the first vertex of the component of each vertex, (k,), as edges join them."""
    first = np.arange(n_vertices)
    while True:
        lower = first.copy()
        for one, other in (edges.T, edges.T[::-1]):
            np.minimum.at(lower, one, first[other])
        lower = lower[lower]
        if np.array_equal(lower, first):
            return first
        first = lower


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


def size_of_surface(faces: NDArray[np.integer[Any]], points: Positions) -> float:
    """The same of the vertices that have a face."""
    return size_of(points[np.unique(faces)])


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
