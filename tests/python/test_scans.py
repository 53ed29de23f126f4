"""Simulated scans: what cameras see of a surface, as points and as depth images."""

from typing import Any

import meshes
import numpy as np
import pytest
from meshes import Mesh
from test_degrade_cameras import NEAR_X, hidden_by_rays, potato, square

from dynmesh import degrade
from dynmesh.degrade import Camera
from dynmesh.degrade.depth_buffer import depth_buffer, intrinsics_of, pose_of
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.scans import DepthScan, PointScan

Array = meshes.Array


def scan(mesh: Mesh, *cameras: Camera, **options: Any) -> PointScan:
    options = {"noise": 0.0, **options}
    (found,) = degrade.scan_points([mesh.vertices], mesh.faces, cameras, points=400, **options)
    return found


def images(mesh: Mesh, *cameras: Camera, **options: Any) -> DepthScan:
    options = {"noise": 0.0, **options}
    (found,) = degrade.depth_images(
        [mesh.vertices], mesh.faces, cameras, width=64, height=48, **options
    )
    return found


def two_bodies(seed: int) -> Mesh:
    rng = np.random.default_rng(seed)
    one, other = potato(rng), potato(rng)
    return meshes.join(one, Mesh(other.faces, other.vertices * 0.6 + rng.normal(size=3)))


def distances(points: Array, mesh: Mesh) -> Array:
    """From each point to the plane of the nearest triangle whose prism contains it."""
    a, b, c = mesh.vertices[mesh.faces.T]
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    best = np.full(len(points), np.inf)
    for i, point in enumerate(points):
        height = ((point - a) * normals).sum(axis=1)
        foot = point - height[:, None] * normals
        inside = np.ones(len(a), bool)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= (np.cross(q - p, foot - p) * normals).sum(axis=1) >= -1e-9
        best[i] = np.abs(height[inside]).min(initial=np.inf)
    return best


@pytest.mark.parametrize("seed", range(2))
def test_no_point_lies_behind_another_surface(seed: int) -> None:
    mesh = two_bodies(seed)
    other = Camera((0.0, 5.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 50.0)
    found = scan(mesh, NEAR_X, other)
    assert len(found.points) == 400
    np.testing.assert_allclose(distances(found.points, mesh), 0, atol=1e-9)
    hidden = [rays_hidden(mesh, camera, found.points) for camera in (NEAR_X, other)]
    assert not np.logical_and.reduce(hidden).any()
    assert any(each.any() for each in hidden)  # one camera does not see what the other sees


def rays_hidden(mesh: Mesh, camera: Camera, points: Array) -> Array:
    """By exact rays, to points that belong to no triangle."""
    whole = Mesh(mesh.faces, np.concatenate([mesh.vertices, points]))
    return hidden_by_rays(whole, camera, np.arange(len(mesh.vertices), len(whole.vertices)))


def test_points_cover_the_seen_area_evenly() -> None:
    near, far = square(0.0), square(-3.0)
    beside = Mesh(far.faces, far.vertices + np.array([0, 2.0, 0]))
    found = scan(meshes.join(near, beside), NEAR_X)
    share = (found.points[:, 0] > -1).mean()
    assert abs(share - 0.5) < 4 * np.sqrt(0.25 / 400)  # as large, though farther away


@pytest.mark.parametrize("turned", [False, True])
def test_normals_point_to_the_camera(turned: bool) -> None:
    sheet = square(0.0)
    faces = sheet.faces[:, ::-1] if turned else sheet.faces
    found = scan(Mesh(faces, sheet.vertices), NEAR_X)
    assert found.normals is not None
    np.testing.assert_allclose(found.normals, [[1, 0, 0]] * 400, atol=1e-12)


def test_noise_has_its_size() -> None:
    flat = square(0.0, 2.5, 30)
    edge = mean_edge_of(flat.vertices, flat.faces)
    heights = scan(flat, NEAR_X, noise=0.5).points[:, 0]
    assert 0.85 < heights.std() / (0.5 * edge) < 1.15
    (depth,), _, _ = images(flat, NEAR_X, noise=0.5)
    measured = depth[depth > 0]
    assert len(measured) > 400
    assert 0.85 < measured.std() / (0.5 * edge) < 1.15
    assert abs(measured.mean() - 4.0) < 0.1 * edge


def test_the_depth_buffer_is_that_of_a_ray_for_each_pixel() -> None:
    mesh = two_bodies(7)
    width, height = 24, 18
    buffer = depth_buffer(mesh.vertices, mesh.faces, NEAR_X, width, height)
    a, b, c = mesh.vertices[mesh.faces.T]
    pose, inverse = pose_of(NEAR_X), np.linalg.inv(intrinsics_of(NEAR_X, width, height))
    for row in range(height):
        for column in range(width):
            ray = pose[:3, :3] @ inverse @ [column, row, 1.0]
            matrix = np.stack([a - b, a - c, np.broadcast_to(ray, a.shape)], axis=2)
            u, v, t = np.linalg.solve(matrix, (a - pose[:3, 3])[:, :, None])[:, :, 0].T
            inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
            nearest = t[inside].min(initial=np.inf)
            assert buffer.depth[row, column] == pytest.approx(nearest, rel=1e-9)


def test_equal_seeds_give_equal_scans() -> None:
    mesh = two_bodies(1)
    frames = [mesh.vertices, mesh.vertices * 1.1, mesh.vertices * 1.2]
    options: Any = {"noise": 0.1, "missing": 0.2, "holes": 0.2, "outliers": 0.1}

    def points(n: int, seed: int) -> list[Array]:
        given = frames[:n], mesh.faces, 2
        clouds = degrade.scan_points(*given, seed=seed, points=300, **options)
        return [np.hstack([cloud.points, np.asarray(cloud.normals)]) for cloud in clouds]

    def depth(n: int, seed: int) -> list[Array]:
        given = frames[:n], mesh.faces, 2
        scans = degrade.depth_images(*given, seed=seed, width=60, height=40, **options)
        return [np.stack(scan.depth) for scan in scans]

    for make in (points, depth):
        whole, again, shorter, other = make(3, 5), make(3, 5), make(2, 5), make(3, 6)
        for one, same in zip(whole + whole[:2], again + shorter, strict=True):
            np.testing.assert_array_equal(one, same)
        assert not np.array_equal(whole[1], other[1])


def test_shares_are_lost_and_moved() -> None:
    flat = square(0.0)
    edge = mean_edge_of(flat.vertices, flat.faces)
    assert 200 < len(scan(flat, NEAR_X, missing=0.4).points) < 280
    away = scan(flat, NEAR_X, outliers=0.2).points
    distant = np.abs(away[:, 0]) > 1e-9
    assert 40 < distant.sum() < 120
    assert np.abs(away[:, 0]).max() <= 10 * edge + 1e-9


def test_holes_are_patches_that_stay() -> None:
    mesh = meshes.sheet(30)
    camera = Camera((15.0, 15.0, 60.0), (15.0, 15.0, 0.0), (1.0, 0.0, 0.0), 60.0)
    seen = np.zeros((3, 30, 30), bool)
    options: Any = {"points": 4000, "noise": 0.0, "holes": 0.5}
    clouds = degrade.scan_points([mesh.vertices] * 3, mesh.faces, [camera], **options)
    for filled, cloud in zip(seen, clouds, strict=True):
        filled[tuple(np.floor(cloud.points[:, :2]).astype(int).T)] = True
    first, second, third = seen[:, :29, :29]
    assert first.mean() > 0.95
    assert 0.3 < second.mean() < 0.75
    assert (second == third).mean() > 0.8


def test_surfaces_edge_on_return_nothing() -> None:
    flat = square(0.0, 1.0)
    vertices = meshes.turned(flat.vertices, np.radians(88.0))
    assert len(scan(Mesh(flat.faces, vertices), NEAR_X).points) < 40


def test_frames_without_a_surface_are_empty() -> None:
    mesh = potato(np.random.default_rng(2))
    gone = np.full_like(mesh.vertices, np.nan)
    first, second = degrade.scan_points([mesh.vertices, gone], mesh.faces, 1, points=50)
    assert (len(first.points), len(second.points)) == (50, 0)
    _, empty = degrade.depth_images([mesh.vertices, gone], mesh.faces, 1, width=20, height=10)
    assert not empty.depth[0].any()
