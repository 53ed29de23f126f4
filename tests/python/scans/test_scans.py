"""What cameras see: masks of vertices, and simulated scans."""

from typing import Any

import meshes
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import Array, Mesh, potato

from dynmesh import losses
from dynmesh.losses import Camera
from dynmesh.losses.visibility import depth_buffer, intrinsics_of, pose_of
from dynmesh.scans import PointScan
from dynmesh.topology import mean_edge_of

NEAR_X = Camera((4.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 60.0)
"""A camera that looks along -x at the origin, with z up and y to the right."""


def seen(mesh: Mesh, *cameras: Camera) -> Array:
    """Returns the mask of frame 1, since frame 0 is always complete."""
    frames = [mesh.vertices, mesh.vertices]
    return list(losses.camera_known(frames, mesh.faces, cameras))[1]


def in_image(vertices: Array, camera: Camera) -> Array:
    """Decides visibility by angles, unlike the implementation."""
    ray = vertices - camera.position
    ahead = np.subtract(camera.target, camera.position)
    right = np.cross(ahead, camera.up)
    up = np.cross(right, ahead)
    depth = ray @ (ahead / np.linalg.norm(ahead))
    half = np.radians(camera.field_of_view / 2)
    across = [np.arctan2(ray @ (axis / np.linalg.norm(axis)), depth) for axis in (right, up)]
    return np.asarray((depth > 0) & (np.abs(across) <= half).all(axis=0))


def meeting(mesh: Mesh, start: Any, rays: Array) -> Array:
    """Where rays meet triangles, (n, m), in their lengths (Moeller and Trumbore 1997), or inf."""
    a, b, c = mesh.vertices[mesh.faces.T].astype(np.float64)
    s = start - a
    q = np.cross(s, b - a)
    p = np.cross(rays[:, None], c - a)
    with np.errstate(divide="ignore", invalid="ignore"):  # degenerate triangles are met nowhere
        determinant = ((b - a) * p).sum(axis=2)
        u = (s * p).sum(axis=2) / determinant
        v = rays @ q.T / determinant
        t = ((c - a) * q).sum(axis=1) / determinant
        return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)


def between(mesh: Mesh, camera: Camera, points: Array) -> Array:
    """Which triangles are between a camera and points, (n, m)."""
    return meeting(mesh, camera.position, points - camera.position) < 1 - 1e-7


def seen_by_rays(mesh: Mesh, camera: Camera) -> Array:
    own = (mesh.faces == np.arange(len(mesh.vertices))[:, None, None]).any(axis=2)
    hidden = (between(mesh, camera, mesh.vertices) & ~own).any(axis=1)
    return np.asarray(in_image(mesh.vertices, camera) & ~hidden)


def square(x: float, size: float = 1.0, n: int = 12) -> Mesh:
    """A flat grid perpendicular to x."""
    faces = meshes.sheet(n).faces
    z, y = (a.ravel() for a in np.indices((n, n)) / (n - 1) - 0.5)
    return Mesh(faces, np.stack([np.full(n * n, x), size * y, size * z], axis=1))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_closed_meshes_hide_what_exact_rays_say(seed: int) -> None:
    """Two cameras see what any of them sees."""
    rng = np.random.default_rng(seed)
    apart = rng.normal(size=3)
    first, second = potato(rng), potato(rng)
    mesh = meshes.join(first, Mesh(second.faces, second.vertices + apart))
    positions = 4 * (directions := rng.normal(size=(2, 3)))
    positions /= np.linalg.norm(directions, axis=1, keepdims=True)
    ups = rng.normal(size=(2, 3))
    cameras = [
        Camera(tuple(p), (0, 0, 0), tuple(u), 35.0) for p, u in zip(positions, ups, strict=True)
    ]
    expected = [seen_by_rays(mesh, camera) for camera in cameras]
    assert np.mean(expected) < 0.9
    np.testing.assert_array_equal(seen(mesh, *cameras), np.any(expected, axis=0))


@given(meshes.meshes(), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_triangles_through_the_plane_of_the_camera_hide_what_exact_rays_say(
    mesh: Mesh, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    position, target, up = (tuple(vector) for vector in rng.normal(size=(3, 3)))
    camera = Camera(position, target, up, 120.0)
    np.testing.assert_array_equal(seen(mesh, camera), seen_by_rays(mesh, camera))


def test_a_triangle_seen_edge_on_does_not_hide_its_own_vertices() -> None:
    rng = np.random.default_rng(8)
    for _ in range(300):
        a, b = rng.uniform(-0.5, 0.5, (2, 3))
        c = a + rng.uniform(0.2, 0.8) * (np.array(NEAR_X.position) - a)
        assert seen(Mesh(np.array([[0, 1, 2]]), np.stack([a, b, c])), NEAR_X).all()


def test_vertices_in_one_place_do_not_hide_each_other() -> None:
    sheet = square(0.0)
    known = seen(meshes.join(sheet, sheet), NEAR_X)
    assert known.all()


def test_what_is_not_finite_is_not_seen_and_hides_nothing() -> None:
    for value in (np.nan, np.inf, -np.inf):
        front, back = square(1.0), square(-1.0)
        front.vertices[::2, 1] = value
        known = seen(meshes.join(front, back), NEAR_X)
        assert not known[:144:2].any()
        assert known[1:144:2].all()
        assert known[144:].all()


def test_moving_cameras_are_asked_for_every_frame_after_the_first() -> None:
    mesh = potato(np.random.default_rng(7))
    cameras = losses.orbit(mesh.vertices, 2, degrees_per_frame=30.0)
    asked = []

    def logged(frame: int) -> list[Camera]:
        asked.append(frame)
        return cameras(frame)

    masks = list(losses.camera_known([mesh.vertices] * 4, mesh.faces, logged))
    assert masks[0].all()
    assert asked == [1, 2, 3]
    for frame in (1, 2, 3):
        np.testing.assert_array_equal(masks[frame], seen(mesh, *cameras(frame)))
    assert (masks[1] != masks[2]).any()


def test_cameras_orbit_the_middle_of_the_mesh() -> None:
    box = np.array([[1.0, 2, 3], [3, 5, 9]], np.float32)  # a diagonal of 7 around (2, 3.5, 6)
    cameras = losses.orbit(box, 4, degrees_per_frame=10.0, elevation=30.0, distance=3.0)
    level, height = 21 * np.cos(np.pi / 6), 21 * 0.5
    offsets = np.array([np.subtract(camera.position, camera.target) for camera in cameras(0)])
    expected = [[level, 0, height], [0, level, height], [-level, 0, height], [0, -level, height]]
    np.testing.assert_allclose(offsets, expected, atol=1e-9)
    for camera in cameras(0):
        assert camera.target == (2.0, 3.5, 6.0)
        assert camera.field_of_view == 40.0
    np.testing.assert_allclose(cameras(9)[0].position, cameras(0)[1].position, atol=1e-9)
    (ahead,) = losses.orbit(box, up=(5, 0, 0), elevation=0.0)(0)
    np.testing.assert_allclose(ahead.position, [2, 3.5 + 14, 6], atol=1e-9)
    assert ahead.up == (1.0, 0.0, 0.0)


def scan(mesh: Mesh, *cameras: Camera, **options: Any) -> PointScan:
    options = {"noise": 0.0, **options}
    (found,) = losses.scan_points([mesh.vertices], mesh.faces, cameras, points=400, **options)
    return found


def two_bodies(seed: int) -> Mesh:
    rng = np.random.default_rng(seed)
    one, other = potato(rng), potato(rng)
    return meshes.join(one, Mesh(other.faces, other.vertices * 0.6 + rng.normal(size=3)))


@pytest.mark.parametrize("seed", range(2))
def test_no_point_lies_behind_another_surface(seed: int) -> None:
    mesh = two_bodies(seed)
    other = Camera((0.0, 5.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 50.0)
    found = scan(mesh, NEAR_X, other)
    assert len(found.points) == 400
    surface = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    closest: Any = trimesh.proximity.closest_point_naive
    _, distances, _ = closest(surface, found.points)
    np.testing.assert_allclose(distances, 0, atol=1e-9)
    hidden = [between(mesh, camera, found.points).any(axis=1) for camera in (NEAR_X, other)]
    assert not np.logical_and.reduce(hidden).any()
    assert any(each.any() for each in hidden)  # one camera does not see what the other sees


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
    found: Any = scan(Mesh(faces, sheet.vertices), NEAR_X)
    np.testing.assert_allclose(found.normals, [[1, 0, 0]] * 400, atol=1e-12)


@pytest.mark.parametrize("options", [{"noise": 0.5}, {}])
def test_noise_has_its_size(options: Any) -> None:
    flat = square(0.0, 2.5, 30)
    size = options.get("noise", 0.02) * mean_edge_of(flat.vertices, flat.faces)
    given: Any = {"frames": [flat.vertices], "faces": flat.faces, "cameras": [NEAR_X], **options}
    (cloud,) = losses.scan_points(**given, points=400)
    assert 0.85 < cloud.points[:, 0].std() / size < 1.15
    (seen,) = losses.depth_images(**given, width=64, height=48)
    measured = seen.depth[0][seen.depth[0] > 0]
    assert len(measured) > 400
    assert 0.85 < measured.std() / size < 1.15
    assert abs(measured.mean() - 4.0) < 0.2 * size


def test_the_depth_buffer_is_that_of_a_ray_for_each_pixel() -> None:
    mesh = meshes.join(two_bodies(7), square(-9.0, 40.0))  # behind which no pixel sees anything
    width, height = 24, 18
    buffer = depth_buffer(mesh.vertices, mesh.faces, NEAR_X, width, height)
    pose, inverse = pose_of(NEAR_X), np.linalg.inv(intrinsics_of(NEAR_X, width, height))
    row, column = np.indices((height, width)).reshape(2, -1)
    rays = np.stack([column, row, np.ones(len(row))], axis=1) @ (pose[:3, :3] @ inverse).T
    nearest = meeting(mesh, pose[:3, 3], rays).min(axis=1)
    np.testing.assert_allclose(buffer.depth.ravel(), nearest, rtol=1e-9)


def test_holes_are_patches_that_stay() -> None:
    mesh = meshes.sheet(30)
    camera = Camera((15.0, 15.0, 60.0), (15.0, 15.0, 0.0), (1.0, 0.0, 0.0), 60.0)
    seen = np.zeros((3, 30, 30), bool)
    options: Any = {"points": 4000, "noise": 0.0, "holes": 0.5}
    clouds = losses.scan_points([mesh.vertices] * 3, mesh.faces, [camera], **options)
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
    first, second = losses.scan_points([mesh.vertices, gone], mesh.faces, 1, points=50)
    assert (len(first.points), len(second.points)) == (50, 0)
    _, empty = losses.depth_images([mesh.vertices, gone], mesh.faces, 1, width=20, height=10)
    assert not empty.depth[0].any()
