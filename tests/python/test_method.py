"""The method compared with its literal implementation, and its identities."""

import meshes
import numpy as np
import pytest
import reference
from hypothesis import given
from hypothesis import strategies as st
from meshes import Mesh

import dynmesh


@given(
    meshes.meshes(),
    st.data(),
    st.booleans(),
    st.integers(0, 4),
    st.sampled_from(["follow", "hold"]),
)
def test_random_meshes_equal_the_transcription(
    mesh: Mesh, data: st.DataObject, revisit: bool, extra: int, disconnected: str
) -> None:
    edges = reference.directed_edges(mesh.faces)
    h = reference.mean_edge(edges, mesh.vertices)
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    completer = dynmesh.Completer(
        mesh.faces,
        mesh.vertices,
        revisit=revisit,
        extra_iterations=extra,
        disconnected=disconnected,  # type: ignore[arg-type]
        method="motion",
    )
    frame = mesh.vertices
    for _ in range(2):
        known = data.draw(meshes.masks(len(frame)))
        points = mesh.vertices + 0.3 * rng.normal(size=mesh.vertices.shape)
        expected, generation = reference.complete_frame(
            edges, frame, points, known, h, revisit=revisit, extra_iterations=extra
        )
        if disconnected == "follow":
            expected = reference.follow(edges, mesh.vertices, frame, expected, generation)
        completed = completer.push(points, known)
        np.testing.assert_array_equal(completer.generation, generation)
        np.testing.assert_allclose(completed, expected, rtol=1e-7, atol=1e-7)
        assert completer.report.known == known.sum()
        assert completer.report.filled == (generation > 0).sum()
        assert completer.report.disconnected == (generation < 0).sum()
        assert completer.report.iterations == max(generation.max(), 0) + extra
        frame = completed


@pytest.mark.parametrize("revisit", [True, False])
def test_a_recursion_that_diverges_stays_finite(revisit: bool) -> None:
    mesh = meshes.sheet(12)
    rng = np.random.default_rng(0)
    completer = dynmesh.Completer(
        mesh.faces, mesh.vertices.astype(np.float32), revisit=revisit, method="motion"
    )
    largest = 0.0
    for _ in range(4000):
        points = mesh.vertices + 0.3 * rng.normal(size=mesh.vertices.shape)
        completed = completer.push(points.astype(np.float32), rng.random(144) < 0.02)
        assert np.isfinite(completed).all()
        largest = max(largest, float(np.abs(completed).max()))
    assert largest > 1e6  # it does diverge
