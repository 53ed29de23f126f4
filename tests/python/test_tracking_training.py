"""Training sequences and standard errors of a tracker."""

import numpy as np
import pytest
from meshes import Array, Mesh, join
from test_tracking import bent, bumpy_torus, edge, scan_of
from tracking_reference import TrackedTrained, vertex_normals

from dynmesh import Tracker


def waved(vertices: Array, time: float) -> Array:
    """Bends and twists the surface; times differ between the training frames and the sequence."""
    x, y, z = bent(vertices, 0.5 * np.sin(time)).T
    return np.stack([x, y + 0.15 * np.cos(1.3 * time) * z * x, z], axis=1)


def training(mesh: Mesh, n: int = 12) -> Array:
    return np.stack([waved(mesh.vertices, 0.37 + 0.71 * i) for i in range(n)])


def half(points: Array, normals: Array) -> tuple[Array, Array]:
    """What a sensor below the surface would not see is left out."""
    seen = normals[:, 2] > 0
    return points[seen], normals[seen]


def test_frames_equal_the_transcription(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(14)
    frames = training(mesh, 3)
    tracker = Tracker(mesh.faces, mesh.vertices, training=frames)
    plain = Tracker(mesh.faces, mesh.vertices)
    expected = TrackedTrained(mesh.faces, mesh.vertices, frames)
    for n in range(1, 4):
        scan = scan_of(mesh, waved(mesh.vertices, 0.4 * n), 1500, rng)
        tracked = tracker.push(*scan)
        assert np.abs(tracked - expected.track(*scan)[0]).max() < 0.1 * edge(mesh)
        assert tracker.report.prior_weight == pytest.approx(expected.prior_weight, abs=0.06)
        assert tracker.report.prior_share == pytest.approx(expected.prior_share, abs=0.06)
        moved = np.abs(tracked - plain.push(*scan)).max()
    assert tracker.report.prior_weight > 0.2
    assert moved > 0.01 * edge(mesh)


def test_a_useless_training_changes_nothing(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(20)
    order = rng.permutation(len(mesh.vertices))
    other = Tracker(mesh.faces, mesh.vertices, training=training(mesh)[:, order])
    plain = Tracker(mesh.faces, mesh.vertices)
    for n in range(1, 6):
        scan = half(*scan_of(mesh, waved(mesh.vertices, 0.1 * n), 3000, rng, noise=0.01))
        assert (other.push(*scan) == plain.push(*scan)).all()
        assert other.report.prior_weight == 0


def test_a_training_may_be_elsewhere(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(14)
    frames = training(mesh, 3)
    turn = np.array([[0.0, -1, 0], [0.6, 0, -0.8], [0.8, 0, 0.6]])
    here = Tracker(mesh.faces, mesh.vertices, training=frames, uncertainty=True)
    moved = Tracker(mesh.faces, mesh.vertices, training=frames @ turn.T + 30.0, uncertainty=True)
    for n in range(1, 4):
        points, normals = scan_of(mesh, waved(mesh.vertices, 0.4 * n), 1500, rng)
        tracked = here.push(points, normals)
        assert np.abs(moved.push(points, normals) - tracked).max() < 1e-4
        assert moved.standard_error == pytest.approx(here.standard_error, rel=1e-3)
    assert here.report.prior_weight > 0


def test_standard_errors_describe_the_distance_from_the_surface(
    rng: np.random.Generator,
) -> None:
    mesh = bumpy_torus(24)
    tracker = Tracker(mesh.faces, mesh.vertices, uncertainty=True)
    plain = Tracker(mesh.faces, mesh.vertices)
    assert (tracker.standard_error == 0).all()
    within, hidden = [], []
    for n in range(1, 12):
        truth = waved(mesh.vertices, 0.12 * n)
        scan = half(*scan_of(mesh, truth, 4000, rng, noise=0.01))
        tracked = tracker.push(*scan)
        assert (tracked == plain.push(*scan)).all()
        bars = tracker.standard_error
        assert (bars > 0).all()
        assert tracker.report.standard_error == pytest.approx(np.sqrt((bars**2).mean()))
        off = np.abs(((tracked - truth) * vertex_normals(mesh.faces, truth)).sum(axis=1))
        within.append((off <= 1.645 * bars).mean())
        hidden.append(bars[~tracker.observed].mean() / bars[tracker.observed].mean())
    assert 0.6 < np.mean(within) < 0.99
    assert np.mean(hidden) > 1.1


def test_where_no_point_is_connected_the_error_is_infinite(rng: np.random.Generator) -> None:
    seen, disconnected = bumpy_torus(14), bumpy_torus(10)
    k = len(seen.vertices)
    mesh = join(seen, Mesh(disconnected.faces, disconnected.vertices + 20.0))
    tracker = Tracker(mesh.faces, mesh.vertices, uncertainty=True)
    tracker.push(*scan_of(seen, bent(seen.vertices, 0.1), 1500, rng))
    assert np.isfinite(tracker.standard_error[:k]).all()
    assert np.isinf(tracker.standard_error[k:]).all()
    tracker.skip()
    assert np.isinf(tracker.standard_error).all()
