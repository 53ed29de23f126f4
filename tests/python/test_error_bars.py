"""Standard errors compared with their literal implementation, their identities and true errors."""

import error_bars_reference
import meshes
import numpy as np
import pytest
from meshes import Array
from numpy.typing import NDArray

import dynmesh
from dynmesh.calibration import Calibrating

Masks = list[NDArray[np.bool_]]


def waving(vertices: Array, n: int) -> Array:
    """Frames of a surface that waves and turns."""
    frames = []
    for t in range(n):
        moved = meshes.turned(vertices, 0.05 * t).copy()
        moved[:, 2] += 0.3 * np.sin(vertices[:, 0] + 0.4 * t)
        frames.append(moved)
    return np.stack(frames)


@pytest.mark.parametrize("noise", [None, 0.05])
@pytest.mark.parametrize("in_bursts", [False, True])
def test_they_equal_the_transcription(
    noise: float | None, in_bursts: bool, rng: np.random.Generator
) -> None:
    mesh = meshes.join(meshes.sheet(8), meshes.sheet(4, 30.0))
    k = len(mesh.vertices)
    frames = waving(mesh.vertices, 12)
    if in_bursts:  # then the largest scale is that of recent frames
        size = np.where(np.arange(12) // 2 == 3, 1.0, 0.01)[:, None, None]
        frames = mesh.vertices + size * (frames - mesh.vertices)
    completer = dynmesh.Completer(
        mesh.faces, mesh.vertices, method="detail", uncertainty=True, noise=noise
    )
    without = dynmesh.Completer(mesh.faces, mesh.vertices, noise=noise)
    expected = error_bars_reference.WithBars(mesh.faces, mesh.vertices, noise)
    for n, points in enumerate(frames[1:], 1):
        known = rng.random(k) < 0.4
        if n % 3:
            known[20:60] = True  # so that some cells are known in two frames
        if n > 6:
            known[64:] = False  # disconnected
        if n == 4:
            known[:] = True
        if n == 5:
            known[:] = False
        completed = completer.push(points, known)
        np.testing.assert_array_equal(completed, without.push(points, known))
        expected.complete(points, known)
        seen = np.isfinite(expected.standard_error)
        np.testing.assert_array_equal(np.isfinite(completer.standard_error), seen)
        np.testing.assert_allclose(
            completer.standard_error[seen], expected.standard_error[seen], rtol=1e-4, atol=1e-9
        )


def test_a_walk_at_random_is_covered_as_promised(rng: np.random.Generator) -> None:
    mesh = meshes.sheet(20)
    k = len(mesh.vertices)
    steps = rng.normal(size=(40, 20, 20, 3))
    for axis in (1, 2) * 8:  # smooth over the sheet
        steps = (np.roll(steps, 1, axis) + 2 * steps + np.roll(steps, -1, axis)) / 4
    frames = mesh.vertices + 0.1 * steps.reshape(40, k, 3).cumsum(axis=0)
    completer = dynmesh.Completer(mesh.faces, frames[0], method="detail", uncertainty=True)
    calibrating = Calibrating()
    for points in frames[1:]:
        completed = completer.push(points, rng.random(k) < 0.3)
        calibrating.add(
            np.linalg.norm(completed - points, axis=1),
            completer.standard_error,
            filled=completer.generation > 0,
        )
    found = calibrating.result()
    assert found is not None
    assert 0.35 < found.coverage_50 < 0.8  # long tails
    assert 0.8 < found.coverage_90 < 0.98
    assert 0.7 < found.rms_ratio < 1.4
