"""Tracking on fewer vertices of a template, from which the others follow."""

import numpy as np
import pytest
from meshes import Mesh, bumpy_torus, turned
from scans_of_meshes import bent, edge, error, scan_of

from dynmesh import Tracker
from dynmesh.tracker import Resolution


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return bumpy_torus(64)  # 4 096 vertices


@pytest.mark.parametrize(("resolution", "limit"), [("best", 0.01), (1024, 0.06)])
def test_a_rigid_motion_bends_nothing(
    mesh: Mesh, resolution: Resolution, limit: float, rng: np.random.Generator
) -> None:
    tracker = Tracker(mesh.faces, mesh.vertices, resolution=resolution)
    for n in range(1, 5):
        truth = turned(mesh.vertices, 0.02 * n)
        tracked = tracker.push(*scan_of(mesh, truth, 6000, rng))
        assert error(mesh, truth, tracked) < limit


@pytest.mark.parametrize("resolution", ["best", 1024])
def test_a_bending_surface_is_followed(
    mesh: Mesh, resolution: Resolution, rng: np.random.Generator
) -> None:
    tracker = Tracker(mesh.faces, mesh.vertices, resolution=resolution)
    errors = []
    for n in range(1, 6):
        truth = bent(mesh.vertices, 0.02 * n)
        tracked = tracker.push(*scan_of(mesh, truth, 6000, rng, noise=0.05 * edge(mesh)))
        errors.append(error(mesh, truth, tracked))
        assert tracker.report.quality == "good"
    assert max(errors) < 0.15
    assert max(np.diff(errors)) < 0.05  # no frame leaps


def test_a_template_with_fewer_vertices_is_tracked_on_all_of_them(
    rng: np.random.Generator,
) -> None:
    mesh = bumpy_torus(24)
    scan = scan_of(mesh, bent(mesh.vertices, 0.1), 3000, rng)
    tracked = [
        Tracker(mesh.faces, mesh.vertices, resolution=one).push(*scan)
        for one in ("best", 576, 10_000)
    ]
    np.testing.assert_array_equal(tracked[0], tracked[1])
    np.testing.assert_array_equal(tracked[0], tracked[2])
