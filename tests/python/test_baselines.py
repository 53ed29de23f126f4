"""The paper's baselines against dense least squares, and against published figures."""

from typing import Any

import meshes
import numpy as np
import reference
from hypothesis import given
from hypothesis import strategies as st
from meshes import Array, Mesh

import dynmesh


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
    system = np.concatenate([dense_laplacian(mesh), np.eye(len(known))[known]])
    right = np.concatenate([np.zeros_like(points), (points - origin)[known]])
    expected = origin + np.linalg.lstsq(system, right, rcond=None)[0]
    holed = np.where(known[:, None], points, np.nan)
    completed = dynmesh.baselines.least_squares_mesh(
        mesh.faces, holed, known, previous=previous if on_motion else None
    )
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
    completed = dynmesh.baselines.laplacian_interpolation(
        mesh.faces,
        holed,
        known,
        objective=objective,
        weights=weights,
        reference=mesh.vertices if weights == "inverse_distance" else None,
        previous=previous if on_motion else None,
    )
    np.testing.assert_array_equal(completed[known], points[known])
    np.testing.assert_allclose(completed, expected, rtol=0, atol=1e-9)


def test_systems_can_be_reused(rng: np.random.Generator) -> None:
    mesh = meshes.sheet(9)
    k = len(mesh.vertices)
    squares = dynmesh.baselines.LeastSquaresMesh(mesh.faces, k)
    smooth = dynmesh.baselines.LaplacianInterpolation(mesh.faces, k)
    masks = rng.random((3, k)) < 0.3
    for known in (masks[0], masks[1], masks[1], masks[2], np.ones(k, bool)):
        points = mesh.vertices + 0.1 * rng.normal(size=mesh.vertices.shape)
        for system, once in [
            (squares, dynmesh.baselines.least_squares_mesh),
            (smooth, dynmesh.baselines.laplacian_interpolation),
        ]:
            again = system.complete(points, known)
            np.testing.assert_array_equal(again, once(mesh.faces, points, known))
