"""Tracking of a template in raw scans."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array, Mesh, sheet
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from tracking_reference import Tracked, vertex_normals

import dynmesh
from dynmesh import Tracker
from dynmesh.degrade.visibility import visible


def bumpy_torus(n: int) -> Mesh:
    """A closed surface on which every place differs from all others."""
    i, j = (a.ravel() for a in np.indices((n, n)))
    u, v = 2 * np.pi * i / n, 2 * np.pi * j / n
    bump = 0.25 * np.sin(2 * u + v) + 0.2 * np.sin(3 * u)
    r = (3 + np.cos(v)) * (1 + 0.3 * bump)
    vertices = np.stack([r * np.cos(u), r * np.sin(u), np.sin(v) * (1 + bump)], axis=1)
    a, b = i * n + j, i * n + (j + 1) % n
    c, d = (i + 1) % n * n + j, (i + 1) % n * n + (j + 1) % n
    faces = np.concatenate([np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)])
    return Mesh(faces, vertices)


def bent(vertices: Array, amount: float) -> Array:
    """Bends the surface about y, more the farther out."""
    x, y, z = vertices.T
    angle = amount * x / 4
    return np.stack([x * np.cos(angle), y, z + x * np.sin(angle)], axis=1)


def scan_of(
    mesh: Mesh, vertices: Array, n: int, rng: np.random.Generator, noise: float = 0.0
) -> tuple[Array, Array]:
    """Random points of the surface, with normals interpolated between the vertices."""
    face = mesh.faces[rng.integers(len(mesh.faces), size=n)]
    share = rng.dirichlet([1, 1, 1], size=n)
    points = np.einsum("ni,nij->nj", share, vertices[face])
    normals = np.einsum("ni,nij->nj", share, vertex_normals(mesh.faces, vertices)[face])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return points + noise * rng.normal(size=points.shape), normals


def edge(mesh: Mesh) -> float:
    a, b = mesh.vertices[mesh.faces[:, 0]], mesh.vertices[mesh.faces[:, 1]]
    return float(np.linalg.norm(a - b, axis=1).mean())


def error(mesh: Mesh, truth: Array, tracked: Array) -> float:
    """The mean distance from the true vertices, in mean edges."""
    return float(np.linalg.norm(truth - tracked, axis=1).mean() / edge(mesh))


@pytest.mark.parametrize("speed", [0.1, 1.2])
def test_frames_equal_the_transcription(speed: float, rng: np.random.Generator) -> None:
    mesh = bumpy_torus(14)
    tracker = Tracker(mesh.faces, mesh.vertices)
    expected = Tracked(mesh.faces, mesh.vertices)
    searches = []
    for n in range(1, 4):
        truth = bent(mesh.vertices, speed * n) + 0.1 * n
        points, normals = scan_of(mesh, truth, 900, rng, noise=0.01)
        kept = points[:, 1] > (-1.0 if n == 2 else -9.0)
        points, normals = points[kept], normals[kept]
        found, observed = expected.track(points, normals)
        assert np.abs(tracker.push(points, normals) - found).max() < 1e-6
        assert (tracker.observed == observed).all()
        assert tracker.report.known == observed.sum()
        searches.append(expected.searches)
        assert error(mesh, truth, found) < (1 if speed < 0.5 else 10)
    assert (max(searches) > 1) == (speed > 0.5)


def planes_of(points: Array, rng: np.random.Generator) -> Array:
    """The normals of the planes through the 12 nearest points, with signs that mean nothing."""
    _, near = cKDTree(points).query(points, 12)
    arms = points[near] - points[near].mean(axis=1, keepdims=True)
    normals = np.linalg.svd(arms)[2][:, 2]
    return np.asarray(normals * rng.choice([-1.0, 1.0], (len(points), 1)))


def test_signs_of_estimated_normals_mean_nothing(rng: np.random.Generator) -> None:
    """Without normals and viewpoints; points that no vertex explains draw the nearest one."""
    mesh = bumpy_torus(14)
    tracker = Tracker(mesh.faces, mesh.vertices)
    expected = Tracked(mesh.faces, mesh.vertices)
    points, _ = scan_of(mesh, bent(mesh.vertices, 1.2) + 0.1, 900, rng)
    found, _ = expected.track(points, planes_of(points, rng), sided=False)
    assert np.abs(tracker.push(points) - found).max() < 1e-6
    assert expected.searches > 1


def test_normals_are_estimated(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(24)
    sensors = 9 * np.array(
        [[1.0, 0, 1], [-1, 0, 1], [1, 0, -1], [-1, 0, -1], [0, 1, 0], [0, -1, 0]]
    )
    given, seen, disconnected = (Tracker(mesh.faces, mesh.vertices) for _ in range(3))
    for n in range(1, 4):
        truth = bent(mesh.vertices, 0.1 * n)
        points, normals = scan_of(mesh, truth, 6000, rng)
        limit = error(mesh, truth, given.push(points, normals)) + 0.2
        assert error(mesh, truth, seen.push(points, viewpoints=sensors)) < limit
        assert error(mesh, truth, disconnected.push(points)) < limit


def test_what_a_sensor_cannot_see_is_not_observed(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(30)
    tracker = Tracker(mesh.faces, mesh.vertices)
    points, normals = scan_of(mesh, mesh.vertices, 9000, rng)
    sensor = (20.0, 0.0, 0.0)
    tracker.push(points, normals, viewpoints=np.array([sensor]))
    camera = dynmesh.degrade.Camera(sensor, (0, 0, 0), (0, 0, 1))
    seen = visible(mesh.vertices, mesh.faces, camera)
    assert (tracker.observed == seen).mean() > 0.9
    assert tracker.observed[mesh.vertices[:, 0] < -2].mean() < 0.05


def test_parts_that_are_missing_keep_their_shape(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(24)
    tracker = Tracker(mesh.faces, mesh.vertices)
    for n in range(1, 13):
        truth = bent(mesh.vertices, 0.04 * n)
        points, normals = scan_of(mesh, truth, 6000, rng, noise=0.01)
        missing = (points[:, 1] > 0) & (3 <= n < 8)
        tracked = tracker.push(points[~missing], normals[~missing])
        assert error(mesh, truth, tracked) < 0.6
        assert (tracker.age[mesh.vertices[:, 1] > 1.2] > 0).all() == (3 <= n < 8)
    assert error(mesh, truth, tracked) < 0.4


def test_hidden_legs_do_not_drift(rng: np.random.Generator) -> None:
    """The scan ends at the waist of a body at rest; what is below must not be drawn to its edge."""
    walker = dynmesh.synth.walker(1)
    mesh = Mesh(walker.faces.astype(np.int64), walker.vertices[0].astype(np.float64))
    tracker = Tracker(mesh.faces, mesh.vertices)
    waist = np.median(mesh.vertices[:, 2])
    for _ in range(10):
        points, normals = scan_of(mesh, mesh.vertices, 8000, rng, noise=0.02 * edge(mesh))
        above = points[:, 2] > waist
        tracked = tracker.push(points[above], normals[above])
    distance = np.linalg.norm(tracked - mesh.vertices, axis=1)
    assert distance[mesh.vertices[:, 2] < waist].mean() < 1.2 * edge(mesh)


def test_a_sheet_is_seen_from_both_sides(rng: np.random.Generator) -> None:
    """Sensors above a wavy sheet see its front, or its back if its faces are turned over."""
    plane = sheet(20)
    for faces in (plane.faces, plane.faces[:, ::-1]):
        mesh = Mesh(np.ascontiguousarray(faces), plane.vertices)
        tracker = Tracker(mesh.faces, mesh.vertices)
        for n in range(1, 6):
            truth = mesh.vertices.copy()
            truth[:, 2] += 0.1 * n * np.sin(0.5 * truth[:, 0]) + 0.2 * n
            points, normals = scan_of(mesh, truth, 4000, rng)
            normals *= np.sign(normals[:, 2:])  # as seen from above
            sensors = np.array([[10.0, 10, 30], [10, -10, 30]])
            tracked = tracker.push(points, normals, viewpoints=sensors)
        assert tracker.observed.mean() > 0.9
        assert np.abs(tracked - truth)[:, 2].max() < 0.8


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
    assert errors[23] > 3
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


def test_a_lost_template_is_found_again(rng: np.random.Generator) -> None:
    """Between two frames, the subject turns by 120 degrees."""
    walker = dynmesh.synth.walker()
    mesh = Mesh(walker.faces.astype(np.int64), walker.vertices[0].astype(float))
    plain = Tracker(mesh.faces, mesh.vertices)
    tracker = Tracker(mesh.faces, mesh.vertices, recover=True)
    turn = Rotation.from_rotvec([np.radians(120), 0, 0])
    for n in range(4):
        truth = walker.vertices[n].astype(float)
        if n > 1:
            truth = turn.apply(truth)
        points, normals = scan_of(mesh, truth, 10_000, rng)
        lost, found = plain.push(points, normals), tracker.push(points, normals)
        assert tracker.report.recovered == (n == 2)
        assert error(mesh, truth, found) < 0.5
        if n < 2:
            np.testing.assert_array_equal(found, lost)
        else:
            assert plain.report.far > 0.05
            assert error(mesh, truth, lost) > 5


def test_a_state_of_another_kind_is_refused() -> None:
    mesh = bumpy_torus(12)
    tracker = Tracker(mesh.faces, mesh.vertices)
    completer = dynmesh.Completer(mesh.faces, mesh.vertices)
    pairs: list[tuple[Any, Any]] = [(tracker, completer), (completer, tracker)]
    for one, other in pairs:
        with pytest.raises(ValueError, match="state: not a"):
            one.restore(other.state())
    with pytest.raises(ValueError, match="32-bit positions"):
        tracker.restore(Tracker(mesh.faces, mesh.vertices.astype(np.float32)).state())


def extremes() -> dict[str, Any]:
    """Scans that say little or nothing, all valid."""
    one = np.array([[3.0, 0, 0]])
    return {
        "none": (one[:0], one[:0]),
        "one": (one, one),
        "the same a thousand times": (one.repeat(1000, axis=0), one.repeat(1000, axis=0)),
        "on a line": (np.linspace([-5.0, 0, 0], [5, 0, 0], 500), None),
        "without normals": (one.repeat(3, axis=0), None),
        "with normals of 0": (one, 0 * one),
        "very far": (1e100 * one, one),
    }


@pytest.mark.parametrize("kind", extremes())
def test_scans_that_say_nothing_leave_the_template(kind: str, rng: np.random.Generator) -> None:
    mesh = bumpy_torus(14)
    tracker = Tracker(mesh.faces, mesh.vertices)
    first = tracker.push(*scan_of(mesh, mesh.vertices, 1500, rng))
    tracked = tracker.push(*extremes()[kind])
    assert np.isfinite(tracked).all()
    assert np.abs(tracked - first).max() < 0.5 * edge(mesh)


def distances_from(points: Array, corners: Array) -> tuple[Array, NDArray[np.int64]]:
    """The distance of each point from the nearest of some triangles, and which one that is."""
    a, b, c = (corners[None, :, i] for i in range(3))
    p = points[:, None]
    candidates = []
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        share = np.clip(((p - start) * side).sum(2) / (side**2).sum(2), 0, 1)
        candidates.append(np.linalg.norm(start + share[..., None] * side - p, axis=2))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    height = ((p - a) * normal).sum(2)
    foot = p - height[..., None] * normal
    inside = [
        (np.cross(end - start, foot - start) * normal).sum(2) >= 0
        for start, end in ((a, b), (b, c), (c, a))
    ]
    candidates.append(np.where(np.all(inside, axis=0), np.abs(height), np.inf))
    all_distances = np.min(candidates, axis=0)
    return all_distances.min(axis=1), all_distances.argmin(axis=1)


def test_the_report_says_how_far_the_points_are(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(20)
    tracker = Tracker(mesh.faces, mesh.vertices)
    edges = np.unique(np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]],
        mesh.faces[:, [2, 0]]]), axis=1), axis=0)  # fmt: skip
    mean_edge = np.linalg.norm(np.diff(mesh.vertices[edges], axis=1), axis=2).mean()
    for n in range(1, 4):
        points, normals = scan_of(mesh, bent(mesh.vertices, 0.1 * n), 1500, rng, noise=0.02)
        if n > 1:  # a part of something else, and some opposite normals
            part = np.linalg.norm(points - points[0], axis=1).argsort()[:200]
            points[part] += 3 * mean_edge * normals[part[0]]
            normals[part] *= -1
            normals[::11] *= -1
        frame = tracker.push(points, normals)
        distance, nearest = distances_from(points, frame[mesh.faces])
        is_near = distance <= mean_edge
        a, b, c = (frame[mesh.faces[nearest]][:, i] for i in range(3))
        is_opposite = (np.cross(b - a, c - a) * normals).sum(1) < 0
        report = tracker.report
        assert report.points > 1480  # a few at the rim of the part are stray
        assert report.far == pytest.approx((~is_near).mean(), abs=0.01 if n > 1 else 1e-9)
        assert (report.far > 0.01) == (n > 1)
        assert report.disagreeing == pytest.approx((is_near & is_opposite).mean(), abs=0.003)
        assert (report.disagreeing > 0.05) == (n > 1)
        rms = np.sqrt((distance[is_near] ** 2).mean())
        assert report.distance == pytest.approx(rms, rel=0.03)
    state = tracker.state()
    tracker.skip()
    assert tracker.report.points == 0
    assert np.isnan([tracker.report.far, tracker.report.distance]).all()
    tracker.restore(state)
    assert tracker.report.far == report.far
    assert tracker.report.distance == report.distance
