"""The connectivity of a mesh, also as SciPy sparse matrices (paper, eq. 1 and 2)."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._arrays import triangles
from ._checks import check_integer
from ._extras import require
from .polygons import Faces

__all__ = ["RefusedFace", "TopologyReport", "adjacency", "cells", "laplacian"]


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


if TYPE_CHECKING:
    from scipy.sparse import csr_array


def adjacency(faces: Faces, n_vertices: int) -> "csr_array[np.float64]":
    """Returns R of eq. (1): 1 where two vertices share an edge, 0 elsewhere.

    Args:
        faces: (m, 3) integers, or other polygons; see :data:`dynmesh.polygons.Faces`.
        n_vertices: k.

    Returns:
        (k, k) float64, symmetric, with sorted rows.
    """
    sparse = require("scipy.sparse", extra="matrices")
    offsets, neighbours = cells(faces, n_vertices)
    shape = (n_vertices, n_vertices)
    matrix: csr_array[np.float64] = sparse.csr_array(
        (np.ones(len(neighbours)), neighbours, offsets), shape=shape
    )
    return matrix


def laplacian(faces: Faces, n_vertices: int) -> "csr_array[np.float64]":
    """Returns L = D - R of eq. (2), the combinatorial Laplacian; see :func:`adjacency`."""
    sparse = require("scipy.sparse", extra="matrices")
    r = adjacency(faces, n_vertices)
    degree = np.diff(r.indptr).astype(np.float64)
    matrix: csr_array[np.float64] = sparse.diags_array(degree, format="csr") - r
    return matrix
