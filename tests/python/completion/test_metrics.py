"""Metrics, matrices, baselines and the method of the paper against their formulas."""

from typing import Any

import leaders_reference
import meshes
import numpy as np
import pytest
import reference
from hypothesis import given
from hypothesis import strategies as st
from meshes import Array, Mesh

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


@given(meshes.meshes())
def test_cells_are_those_of_the_edges(mesh: Mesh) -> None:
    k = len(mesh.vertices)
    expected = np.zeros((k, k))
    expected[reference.directed_edges(mesh.faces)] = 1  # eq. (1)
    offsets, neighbours = dynmesh.topology.cells(mesh.faces, k)
    assert offsets.dtype == neighbours.dtype == np.int32
    for v in range(k):
        np.testing.assert_array_equal(
            neighbours[offsets[v] : offsets[v + 1]], np.flatnonzero(expected[v])
        )


def dense_laplacian(mesh: Mesh, *, inverse_distance: bool = False) -> Array:
    """Returns D - R, optionally with inverse distances as weights."""
    i, j = reference.directed_edges(mesh.faces)
    r = np.zeros((len(mesh.vertices), len(mesh.vertices)))
    edge = np.linalg.norm(mesh.vertices[i] - mesh.vertices[j], axis=1)
    r[i, j] = 1 / edge if inverse_distance else 1
    return np.asarray(np.diag(r.sum(axis=1)) - r)


@st.composite
def problems(draw: st.DrawFn) -> tuple[Mesh, Array, Array, Array]:
    """A mesh, points, a mask with a known vertex in each component, and a previous frame."""
    mesh = draw(meshes.meshes())
    known = draw(meshes.masks(len(mesh.vertices)))
    label = reference.components(reference.directed_edges(mesh.faces), len(known))
    for part in np.unique(label):
        known[draw(st.sampled_from(np.flatnonzero(label == part).tolist()))] = True
    rng = np.random.default_rng(len(known))
    points = mesh.vertices + 0.3 * rng.normal(size=mesh.vertices.shape)
    return mesh, points, known, mesh.vertices + 0.1 * rng.normal(size=points.shape)


@given(problems(), st.booleans())
def test_least_squares_meshes_are_dense_least_squares(problem: Any, on_motion: bool) -> None:
    mesh, points, known, previous = problem
    origin = previous if on_motion else np.zeros_like(points)
    rows = np.concatenate([dense_laplacian(mesh), np.eye(len(known))[known]])
    right = np.concatenate([np.zeros_like(points), (points - origin)[known]])
    expected = origin + np.linalg.lstsq(rows, right, rcond=None)[0]
    holed = np.where(known[:, None], points, np.nan)
    system = dynmesh.baselines.LeastSquaresMesh(mesh.faces, len(known))
    completed = system.complete(holed, known, previous=previous if on_motion else None)
    np.testing.assert_allclose(completed, expected, rtol=0, atol=1e-9)


@given(
    problems(),
    st.booleans(),
    st.sampled_from(["harmonic", "least_squares"]),
    st.sampled_from(["uniform", "inverse_distance"]),
)
def test_laplacian_interpolation_is_dense_algebra(
    problem: Any, on_motion: bool, objective: Any, weights: Any
) -> None:
    mesh, points, known, previous = problem
    origin = previous if on_motion else np.zeros_like(points)
    laplacian = dense_laplacian(mesh, inverse_distance=weights == "inverse_distance")
    unknown_columns = laplacian[:, ~known]
    pull = -laplacian[:, known] @ (points - origin)[known]
    if objective == "harmonic":
        unknown = np.linalg.solve(unknown_columns[~known], pull[~known])
    else:
        unknown = np.linalg.lstsq(unknown_columns, pull, rcond=None)[0]
    expected = points.copy()
    expected[~known] = origin[~known] + unknown
    holed = np.where(known[:, None], points, np.nan)
    system = dynmesh.baselines.LaplacianInterpolation(
        mesh.faces,
        len(known),
        objective=objective,
        weights=weights,
        reference=mesh.vertices if weights == "inverse_distance" else None,
    )
    completed = system.complete(holed, known, previous=previous if on_motion else None)
    np.testing.assert_array_equal(completed[known], points[known])
    np.testing.assert_allclose(completed, expected, rtol=0, atol=1e-9)


def test_systems_can_be_reused(rng: np.random.Generator) -> None:
    mesh = meshes.sheet(9)
    k = len(mesh.vertices)
    methods = dynmesh.baselines.LeastSquaresMesh, dynmesh.baselines.LaplacianInterpolation
    systems = [method(mesh.faces, k) for method in methods]
    masks = rng.random((3, k)) < 0.3
    for known in (masks[0], masks[1], masks[1], masks[2], np.ones(k, bool)):
        points = mesh.vertices + 0.1 * rng.normal(size=mesh.vertices.shape)
        for method, system in zip(methods, systems, strict=True):
            fresh = method(mesh.faces, k).complete(points, known)
            np.testing.assert_array_equal(system.complete(points, known), fresh)


@given(
    st.one_of(meshes.meshes(), meshes.meshes(300)),
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
    leaders = leaders_reference.Leaders(edges, mesh.vertices)
    frame = mesh.vertices
    for _ in range(2):
        known = data.draw(meshes.masks(len(frame)))
        points = mesh.vertices + 0.3 * rng.normal(size=mesh.vertices.shape)
        expected, generation = reference.complete_frame(
            edges, frame, points, known, h, revisit=revisit, extra_iterations=extra
        )
        if disconnected == "follow":
            expected = leaders.follow(frame, expected, known)
            leaders.learn(expected, known)
        completed = completer.push(points, known)
        np.testing.assert_array_equal(completer.generation, generation)
        exact = generation >= 0  # the rotations of others can be hardly determined
        np.testing.assert_allclose(completed[exact], expected[exact], rtol=1e-12, atol=1e-12)
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
