"""Adjacency and Laplacian of a mesh as SciPy sparse matrices (paper, eq. 1 and 2)."""

from typing import TYPE_CHECKING

import numpy as np

from ._extras import require
from .polygons import Faces
from .topology import cells

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def adjacency(faces: Faces, n_vertices: int) -> "csr_array[np.float64]":
    """Returns R of eq. (1): 1 where two vertices share an edge, 0 elsewhere.

    Args:
        faces: (m, 3) integers, or other polygons; see :data:`dynmesh.polygons.Faces`.
        n_vertices: k.

    Returns:
        (k, k) float64, symmetric, with sorted rows.

    Raises:
        ValueError, TypeError: see :func:`dynmesh.cells`.
        ImportError: SciPy is not installed.
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
