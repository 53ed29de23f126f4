"""Tracking of a template in raw scans."""

from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Mesh, bumpy_torus, turned
from numpy.typing import NDArray
from scans_of_meshes import bent, edge, error, person, scan_of, vertex_normals
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import dynmesh
from dynmesh import Tracker, losses
from dynmesh.losses.visibility import visible
from dynmesh.tracker import Resolution
from dynmesh.tracking.placing import push_scan


@pytest.mark.parametrize("n", [50, 900, 20_000])
def test_points_on_a_still_surface_move_nothing(n: int, rng: np.random.Generator) -> None:
    mesh = bumpy_torus(24)
    tracker = Tracker(mesh.faces, mesh.vertices)
    for _ in range(3):
        tracked = tracker.push(*scan_of(mesh, mesh.vertices, n, rng))
        assert np.abs(tracked - mesh.vertices).max() < 1e-6 * edge(mesh)


def collared(gap: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A ball whose upper half ends in a fold, like a closed lip, this far outside of the lower one.

    Its edges have a length of about 1.
    """
    angles = np.radians([*np.linspace(4, 100, 18), *range(98, 80, -5), *np.linspace(80, 176, 18)])
    radii = 10 + gap * np.repeat([1, 0.5, 0], [18, len(angles) - 36, 18])
    n, rings = 60, len(angles)
    around = np.linspace(0, 2 * np.pi, n, endpoint=False)
    across, up = radii * np.sin(angles), radii * np.cos(angles)
    x, y = np.outer(across, np.cos(around)), 1.3 * np.outer(across, np.sin(around))
    rows = np.stack([x, y, np.repeat(0.8 * up[:, None], n, axis=1)], axis=2).reshape(-1, 3)
    poles = [[0, 0, 0.8 * (10 + gap)], [0, 0, -8]]
    a = np.arange(rings * n).reshape(rings, n)
    b = np.roll(a, -1, axis=1)
    sides = [[a[:-1], a[1:], b[:-1]], [b[:-1], a[1:], b[1:]]]
    caps = [[np.full(n, rings * n), a[0], b[0]], [np.full(n, rings * n + 1), b[-1], a[-1]]]
    faces = [np.stack([np.ravel(c) for c in corners], axis=1) for corners in (*sides, *caps)]
    return np.concatenate([rows, poles]), np.concatenate(faces)


@pytest.mark.parametrize("cameras", [4, 2])
@pytest.mark.parametrize("gap", [0.15, 0.25])
def test_layers_that_touch_stay_apart(gap: float, cameras: int) -> None:
    vertices, faces = collared(gap)
    tracker = Tracker(faces, vertices)
    around = losses.orbit(vertices, cameras, up=(0, 0, 1))(0)
    still = np.repeat(vertices[None], 9, axis=0)
    for scan in losses.scan_points(still, faces, around, points=8000, noise=0):
        tracked = push_scan(tracker, scan)
        assert np.linalg.norm(tracked - vertices, axis=1).max() < 0.02


def test_noise_does_not_accumulate(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(24)
    tracker = Tracker(mesh.faces, mesh.vertices)
    scans = (scan_of(mesh, mesh.vertices, 3000, rng, noise=0.05 * edge(mesh)) for _ in range(40))
    errors = [error(mesh, mesh.vertices, tracker.push(*scan)) for scan in scans]
    assert max(errors) < 0.05
    assert np.mean(errors[20:]) < 1.3 * np.mean(errors[:20])


@pytest.mark.parametrize(("noise", "limit"), [(0.02, 0.25), (0.6, 0.5)])
def test_noisy_points_draw_the_template_less(
    noise: float, limit: float, rng: np.random.Generator
) -> None:
    sequence = dynmesh.synth.sequence("bust")
    mesh = Mesh(sequence.faces.astype(np.int64), sequence.vertices[0].astype(np.float64))
    tracker = Tracker(mesh.faces, mesh.vertices)
    errors = []
    for truth in sequence.vertices[1:13].astype(np.float64):
        scan = scan_of(mesh, truth, 6000, rng, noise=noise * edge(mesh))
        errors.append(error(mesh, truth, tracker.push(*scan)))
    assert np.mean(errors[3:]) < limit


@pytest.mark.parametrize(("spacing", "noise"), [(4, 0.05), (4, 0.2), (8, 0.05)])
def test_points_of_a_line_scanner_are_tracked(
    spacing: float, noise: float, rng: np.random.Generator
) -> None:
    """They are dense along lines that lie mean edges apart."""
    frames = dynmesh.synth.walker().vertices[:4].astype(np.float64)
    mesh = Mesh(person()[0].faces, frames[0])
    tracker = Tracker(mesh.faces, frames[0])
    for frame in frames[1:]:
        points, _ = scan_of(mesh, frame, 500_000, rng)
        lines = points[:, 2] / (spacing * edge(mesh))
        points = points[np.abs(lines - np.rint(lines)) < 0.01]
        points += noise * edge(mesh) * rng.normal(size=points.shape)
        tracked = tracker.push(points)
        assert tracker.report.quality == "good", tracker.report.reason
    assert error(mesh, frame, tracked) < 0.03 * spacing + noise


@pytest.mark.parametrize(("axis", "degrees"), [("x", 70), ("y", 50)])
def test_the_way_from_the_template_to_the_first_scan_predicts_nothing(
    axis: str, degrees: float, rng: np.random.Generator
) -> None:
    """A prediction would carry the mesh on beyond scans that do not move."""
    mesh, _ = person()
    turn = Rotation.from_euler(axis, degrees, degrees=True)
    middle = mesh.vertices.mean(axis=0)
    tracker = Tracker(mesh.faces, turn.apply(mesh.vertices - middle) + middle)
    errors = [
        error(
            mesh, mesh.vertices, tracker.push(*scan_of(mesh, mesh.vertices, 6000, rng, noise=0.01))
        )
        for _ in range(3)
    ]
    assert max(errors[1:]) < 1.2 * errors[0]


def test_what_a_sensor_cannot_see_is_not_observed(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(30)
    tracker = Tracker(mesh.faces, mesh.vertices)
    points, normals = scan_of(mesh, mesh.vertices, 9000, rng)
    sensor = (20.0, 0.0, 0.0)
    camera = dynmesh.losses.Camera(sensor, (0, 0, 0), (0, 0, 1))
    seen = visible(mesh.vertices, mesh.faces, camera)
    measured = seen[cKDTree(mesh.vertices).query(points)[1]]
    tracker.push(points[measured], normals[measured], viewpoints=np.array([sensor]))
    assert (tracker.observed == seen).mean() > 0.9
    assert tracker.observed[mesh.vertices[:, 0] < -2].mean() < 0.05


def test_hidden_legs_do_not_drift(rng: np.random.Generator) -> None:
    """The scan ends at the waist of a body at rest; what is below must not be drawn to its edge."""
    mesh, _ = person()
    tracker = Tracker(mesh.faces, mesh.vertices)
    waist = np.median(mesh.vertices[:, 2])
    for _ in range(5):
        points, normals = scan_of(mesh, mesh.vertices, 8000, rng, noise=0.02 * edge(mesh))
        above = points[:, 2] > waist
        tracked = tracker.push(points[above], normals[above])
    distance = np.linalg.norm(tracked - mesh.vertices, axis=1)
    assert distance[mesh.vertices[:, 2] < waist].mean() < 1.2 * edge(mesh)


def test_half_of_a_horse_is_found_again(data: Path) -> None:
    """Half of the scan is missing for ten frames, while the legs move by up to 28 edges each."""
    horse = dynmesh.read(data / "horse_gallop.npz")
    mesh = Mesh(horse.faces.astype(np.int64), horse.vertices[0].astype(np.float64))
    tracker = Tracker(mesh.faces, mesh.vertices)
    errors = []
    for n, frame in enumerate(horse.vertices[:25]):
        truth = frame.astype(np.float64)
        normals = vertex_normals(mesh.faces, truth)
        depth = truth[:, 2]
        kept = depth > np.median(depth) if 14 <= n < 24 else np.full(len(truth), True)
        errors.append(error(mesh, truth, tracker.push(truth[kept], normals[kept])))
    assert max(errors[:14]) < 1.5
    assert errors[23] > 2
    assert errors[24] < 0.6


def test_a_recorded_cloth_stays_in_its_scans(data: Path) -> None:
    """It would turn in its own plane without its boundary, and leave a quarter of the points."""
    path = data / "kinect_cloth_scans.npz"
    if not path.exists():
        pytest.skip("the folder of recorded sequences has no kinect_cloth_scans.npz")
    with np.load(path) as stored:
        points, offsets = stored["points"].astype(float), stored["offsets"]
        template, faces = stored["template_vertices"].astype(float), stored["template_faces"]
    tracker = Tracker(faces, template)
    for first, end in pairwise(offsets):
        tracked = tracker.push(points[first:end], viewpoints=np.zeros((1, 3)))
    edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    lengths, lengths_of_template = (
        np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1) for x in (tracked, template)
    )
    # The nearest vertex is at most 0.7 edges from a point of the surface.
    distance = cKDTree(tracked).query(points[offsets[-2] :])[0] / lengths_of_template.mean()
    assert np.percentile(distance, 95) < 1.2
    held = [0, 992]
    moved = np.linalg.norm(tracked[held] - template[held], axis=1) / lengths_of_template.mean()
    assert moved.max() < 2
    assert np.mean(np.abs(lengths / lengths_of_template - 1) < 0.1) > 0.9


def test_stray_points_do_not_hide_where_a_cloth_ends(data: Path) -> None:
    flag = dynmesh.read(data / "flag_sim_50x50.npz")
    frames = flag.vertices[:6].astype(np.float64)
    mesh = Mesh(flag.faces.astype(np.int64), frames[0])
    box = np.stack([frames.min(axis=(0, 1)), frames.max(axis=(0, 1))])
    camera = dynmesh.losses.orbit(box, 1, distance=6, up=(0, 1, 0))(0)
    scans = partial(dynmesh.losses.scan_points, frames[1:], mesh.faces, camera, points=15_000)
    errors = []
    for outliers in (0, 0.1):
        tracker = Tracker(mesh.faces, mesh.vertices)
        for scan in scans(noise=0.05, outliers=outliers):
            tracked = push_scan(tracker, scan)
        errors.append(error(mesh, frames[-1], tracked))
    assert errors[1] < 1.3 * errors[0]


def test_points_of_other_things_are_ignored(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(24)
    tracker, alone = (Tracker(mesh.faces, mesh.vertices) for _ in range(2))
    wall = np.concatenate([rng.uniform(-8, 8, (4000, 2)), np.full((4000, 1), -2.5)], axis=1)
    upwards = np.broadcast_to([0.0, 0, 1], wall.shape)
    for n in range(1, 6):
        truth = bent(mesh.vertices, 0.04 * n)
        points, normals = scan_of(mesh, truth, 6000, rng)
        limit = error(mesh, truth, alone.push(points, normals)) + 0.3
        points[::100] += rng.normal(size=points[::100].shape)
        tracked = tracker.push(np.concatenate([points, wall]), np.concatenate([normals, upwards]))
        assert error(mesh, truth, tracked) < limit


@pytest.mark.parametrize(
    ("moved", "noise", "resolution", "limit"),
    [
        (turned, 0, "best", 0.01),
        (turned, 0, 1024, 0.06),
        (bent, 0.05, "best", 0.15),
        (bent, 0.05, 1024, 0.15),
    ],
)
def test_a_fine_surface_is_followed(
    moved: Any, noise: float, resolution: Resolution, limit: float, rng: np.random.Generator
) -> None:
    fine = bumpy_torus(64)  # 4 096 vertices
    tracker = Tracker(fine.faces, fine.vertices, resolution=resolution)
    errors = []
    for n in range(1, 6):
        truth = moved(fine.vertices, 0.02 * n)
        tracked = tracker.push(*scan_of(fine, truth, 6000, rng, noise=noise * edge(fine)))
        errors.append(error(fine, truth, tracked))
        assert tracker.report.quality == "good"
    assert max(errors) < limit
    assert max(np.diff(errors)) < 0.05  # no frame leaps


def test_what_is_left_of_a_motion_along_the_surface_is_found_later(
    rng: np.random.Generator,
) -> None:
    """A hand closes steadily, so that its skin slides along its scans."""
    frames = dynmesh.synth.hand(31)
    hand = Mesh(frames.faces.astype(np.int64), frames.vertices[0].astype(np.float64))
    tracker = Tracker(hand.faces, hand.vertices)
    for truth in frames.vertices[1:11].astype(np.float64):
        tracked = tracker.push(*scan_of(hand, truth, 8000, rng))
    assert error(hand, truth, tracked) < 0.29


@pytest.mark.parametrize(("rate", "is_trained"), [(1.02, False), (0.98, False), (1.02, True)])
def test_the_rest_shape_grows_with_the_surface(
    rate: float, is_trained: bool, rng: np.random.Generator
) -> None:
    frames = dynmesh.synth.hand(31)
    hand = Mesh(frames.faces.astype(np.int64), frames.vertices[0].astype(np.float64))
    training = frames.vertices[::3] if is_trained else None
    tracker = Tracker(hand.faces, hand.vertices, training=training)
    errors = []
    for n in range(1, 17):
        size = rate**n
        tracked = tracker.push(*scan_of(hand, size * hand.vertices, 8000, rng))
        errors.append(error(hand, size * hand.vertices, tracked) / size)
    assert max(errors) < 0.05


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
