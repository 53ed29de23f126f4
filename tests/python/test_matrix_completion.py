"""Matrix completion, the offline baseline of the study."""

import meshes
import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.matrix_completion import _problem, complete_at_once, shrunk

Floats = NDArray[np.float64]


@pytest.mark.parametrize("shape", [(4, 9), (9, 4)])
def test_shrunk_is_the_proximal_operator_of_the_nuclear_norm(shape: tuple[int, int]) -> None:
    matrix = np.random.default_rng(0).normal(size=shape)
    left, values, right = np.linalg.svd(matrix, full_matrices=False)
    expected = (left * np.maximum(values - 1.5, 0)) @ right
    np.testing.assert_allclose(shrunk(matrix, 1.5), expected, atol=1e-10)
    assert not shrunk(matrix, 1.01 * values[0]).any()


def objective(x: Floats, m: Floats, kept: Floats, graph: Floats, a: float, b: float) -> float:
    fit = 0.5 * np.sum(kept * (x - m) ** 2)
    return float(fit + a * np.linalg.norm(x, "nuc") + 0.5 * b * np.trace(x @ graph @ x.T))


@pytest.mark.parametrize("b", [0.0, 0.3])
def test_a_solution_is_a_minimum(b: float) -> None:
    mesh = meshes.sheet(4)
    rng = np.random.default_rng(1)
    frames = mesh.vertices + 0.3 * rng.normal(size=(3, 16, 3))
    known = rng.random((3, 16)) < 0.6
    problem = _problem(mesh.faces, frames, known)
    kept = np.repeat(known, 3, axis=0).astype(float)
    x = problem.solve(np.zeros((9, 16)), kept, 0.2, b, 3000)
    # Independent of the code: the matrix of the text, from the faces.
    adjacency = np.zeros((16, 16))
    for face in mesh.faces:
        adjacency[np.ix_(face, face)] = 1
    np.fill_diagonal(adjacency, 0)
    graph = (np.diag(adjacency.sum(0)) - adjacency) / adjacency.sum(0).mean()
    displaced = (frames - frames[0]).transpose(0, 2, 1).reshape(9, 16)
    least = objective(x, displaced, kept, graph, 0.2, b)
    for scale in (1e-2, 1e-4):
        for _ in range(30):
            other = x + scale * rng.normal(size=x.shape)
            assert objective(other, displaced, kept, graph, 0.2, b) >= least
        assert objective((1 + scale) * x, displaced, kept, graph, 0.2, b) >= least
        assert objective((1 - scale) * x, displaced, kept, graph, 0.2, b) >= least


def stretched(n: int) -> tuple[meshes.Mesh, Floats]:
    """A sheet that stretches and shears: displacements of rank two."""
    mesh = meshes.sheet(8)
    rng = np.random.default_rng(2)
    by = rng.normal(size=(n, 2))
    by[0] = 0
    modes = np.stack([mesh.vertices * [1, 0, 0], mesh.vertices[:, [1, 0, 2]]])
    return mesh, mesh.vertices + np.einsum("nm,mkc->nkc", 0.2 * by, modes)


@pytest.mark.parametrize("smoothness", [(0.0,), (0.0, 0.01)])
def test_frames_of_low_rank_are_recovered(smoothness: tuple[float, ...]) -> None:
    mesh, frames = stretched(20)
    rng = np.random.default_rng(3)
    known = rng.random(frames.shape[:2]) < 0.7
    known[0] = True
    held_out = rng.random(known.shape) < 0.05
    held_out[0] = False
    observed = np.where(known[..., None], frames, np.nan)  # what is unknown is not used
    completed = complete_at_once(mesh.faces, observed, known, held_out, smoothness)
    np.testing.assert_array_equal(completed[known], frames[known])
    moved = np.linalg.norm((frames - frames[0])[~known])
    assert np.linalg.norm((completed - frames)[~known]) < 0.02 * moved
    later = observed.copy()
    later[-1, known[-1]] += 1.0
    other = complete_at_once(mesh.faces, later, known, held_out, smoothness)
    assert np.abs(other - completed)[5].max() > 0  # offline: the last frame changes the fifth
