"""Metrics and matrices against their formulas."""

import meshes
import numpy as np
import pytest
import reference
from hypothesis import given
from meshes import Mesh

import dynmesh


@given(meshes.meshes())
def test_nmsve_is_the_formula(mesh: Mesh) -> None:
    rng = np.random.default_rng(len(mesh.faces))
    completed = mesh.vertices + 0.1 * rng.normal(size=mesh.vertices.shape)
    expected = reference.nmsve(reference.directed_edges(mesh.faces), mesh.vertices, completed)
    value = dynmesh.metrics.nmsve(mesh.faces, mesh.vertices, completed)
    assert isinstance(value, float)
    assert value == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_sequences_are_measured_frame_by_frame(mesh: Mesh, rng: np.random.Generator) -> None:
    truth = np.stack([meshes.turned(mesh.vertices, 0.1 * i) for i in range(4)])
    completed = truth + 0.1 * rng.normal(size=truth.shape)
    each = [dynmesh.metrics.nmsve(mesh.faces, t, c) for t, c in zip(truth, completed, strict=True)]
    np.testing.assert_array_equal(dynmesh.metrics.nmsve(mesh.faces, truth, completed), each)
    error = dynmesh.metrics.vertex_error(truth, completed)
    np.testing.assert_allclose(error, np.linalg.norm(truth - completed, axis=2), rtol=1e-14)
    np.testing.assert_array_equal(dynmesh.metrics.vertex_error(truth[1], completed[1]), error[1])
    backwards = dynmesh.metrics.nmsve(mesh.faces, truth[::-1], completed[::-1])
    np.testing.assert_array_equal(backwards, each[::-1])


def test_summary_is_numpys(rng: np.random.Generator) -> None:
    errors = rng.exponential(size=(7, 31))
    summary = dynmesh.metrics.summary(errors)
    assert summary.mean == pytest.approx(errors.mean())
    assert summary.rms == pytest.approx(np.sqrt((errors**2).mean()))
    assert summary.p99 == pytest.approx(np.percentile(errors, 99))
    assert summary.maximum == errors.max()


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
