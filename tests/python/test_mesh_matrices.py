"""Cells, adjacency and Laplacian."""

import meshes
import numpy as np
import reference
from hypothesis import given
from meshes import Mesh

import dynmesh


@given(meshes.meshes())
def test_matrices_are_the_papers(mesh: Mesh) -> None:
    k = len(mesh.vertices)
    i, j = reference.directed_edges(mesh.faces)
    expected = np.zeros((k, k))
    expected[i, j] = 1  # eq. (1)
    np.testing.assert_array_equal(dynmesh.adjacency(mesh.faces, k).toarray(), expected)
    laplacian = dynmesh.laplacian(mesh.faces, k)
    np.testing.assert_array_equal(laplacian.toarray(), np.diag(expected.sum(axis=1)) - expected)
    assert laplacian.dtype == np.float64

    offsets, neighbours = dynmesh.cells(mesh.faces, k)
    assert offsets.dtype == neighbours.dtype == np.int32
    for v in range(k):
        np.testing.assert_array_equal(
            neighbours[offsets[v] : offsets[v + 1]], np.flatnonzero(expected[v])
        )
