"""Registration of a template with one scan."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from meshes import Array, Mesh
from scipy.spatial.transform import Rotation
from test_tracking import bent, bumpy_torus, edge, error, scan_of

import dynmesh


@cache
def person() -> tuple[Mesh, Array]:
    """A person, and another pose."""
    frames = dynmesh.synth.walker(12)
    vertices = frames.vertices.astype(np.float64)
    return Mesh(frames.faces.astype(np.int64), vertices[0]), vertices[1]


def scan(mesh: Mesh, vertices: Array, rng: np.random.Generator, n: int = 4000) -> Any:
    return scan_of(mesh, vertices, n, rng, noise=0.05 * edge(mesh))


@pytest.fixture(scope="module")
def torus() -> Mesh:
    return bumpy_torus(24)


def test_a_template_comes_back_from_any_rotation(rng: np.random.Generator) -> None:
    mesh, _ = person()
    for rotation in Rotation.random(6, random_state=7):
        truth = rotation.apply(mesh.vertices) + np.array([5.0, -3, 2])
        found = dynmesh.register(mesh.faces, mesh.vertices, *scan(mesh, truth, rng))
        assert error(mesh, truth, found.vertices) < 0.3
        assert found.quality == "good"
        assert found.reason == ""
        rigid = mesh.vertices @ found.transform[:3, :3].T + found.transform[:3, 3]
        assert error(mesh, truth, rigid) < 1


def test_all_that_can_be_given(torus: Mesh, rng: np.random.Generator) -> None:
    """Another unit, no normals, cameras, standard errors, threads and single precision."""
    truth = Rotation.from_euler("xyz", [1, 2, 3]).apply(bent(torus.vertices, 0.1))
    points, normals = scan(torus, truth, rng)
    axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    cameras = [camera for up in axes for camera in dynmesh.degrade.orbit(truth, 4, up=up)(0)]
    viewpoints = np.array([camera.position for camera in cameras])
    single = (1000 * torus.vertices).astype(np.float32)
    found = dynmesh.register(
        torus.faces, single, points, viewpoints=viewpoints, scale=True, uncertainty=True, threads=2
    )
    assert found.vertices.dtype == np.float32
    assert error(torus, truth, found.vertices) < 0.5
    assert found.standard_error is not None
    assert np.isfinite(found.standard_error[found.observed]).all()
    assert abs(np.cbrt(np.linalg.det(found.transform[:3, :3])) - 0.001) < 1e-6
    trained = dynmesh.register(
        torus.faces,
        torus.vertices,
        points,
        normals,
        training=[bent(torus.vertices, share) for share in (0.05, 0.1, 0.15)],
    )
    assert error(torus, truth, trained.vertices) < 0.5


def test_numbers_of_vertices_points_and_landmarks_mean_nothing(
    torus: Mesh, rng: np.random.Generator
) -> None:
    truth = bent(torus.vertices, 0.3) + 1.0
    points, normals = scan(torus, truth, rng)
    marks = np.array([5, 120, 260, 400])
    found = dynmesh.register(
        torus.faces, torus.vertices, points, normals, landmarks=(marks, truth[marks])
    )
    order = rng.permutation(len(torus.vertices))
    new = np.argsort(order)
    of_marks = rng.permutation(len(marks))
    again = dynmesh.register(
        new[torus.faces],
        torus.vertices[order],
        points,
        normals,
        landmarks=(new[marks][of_marks], truth[marks][of_marks]),
    )
    assert np.abs(again.vertices[new] - found.vertices).max() < 0.01 * edge(torus)


def test_depth_images(torus: Mesh) -> None:
    truth = Rotation.from_euler("y", 0.4).apply(torus.vertices)
    (scan,) = dynmesh.degrade.depth_images([truth], torus.faces, 6, width=160, height=120)
    found = dynmesh.register_depth(
        torus.faces, torus.vertices, scan.depth, scan.intrinsics, scan.poses
    )
    assert error(torus, truth, found.vertices) < 0.5


def scan_of_half(mesh: Mesh, rng: np.random.Generator) -> Any:
    points, normals = scan(mesh, mesh.vertices, rng)
    kept = points[:, 0] > np.median(points[:, 0])
    return points[kept], normals[kept]


def test_wrong_scans_are_not_good(torus: Mesh, rng: np.random.Generator) -> None:
    mesh, _ = person()
    wrong = {
        "another body": scan(mesh, mesh.vertices, rng),
        "half of it": scan_of_half(torus, rng),
    }
    for name, (points, normals) in wrong.items():
        size = np.ptp(torus.vertices) / np.ptp(points)
        found = dynmesh.register(torus.faces, torus.vertices, size * points, normals)
        assert found.quality != "good", name
        assert found.reason, name
