"""Tracking with training and standard errors, and templates that are lost."""

import numpy as np
import pytest
from meshes import Array, Mesh, bumpy_torus, join, turned
from scans_of_meshes import bent, edge, error, person, scan_of, torus_scan, vertex_normals

import dynmesh
from dynmesh import Tracker
from dynmesh.scans import DepthScan
from dynmesh.tracker import Resolution


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


def test_a_training_tells_the_shape_of_what_is_not_seen(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(20)
    trained = Tracker(mesh.faces, mesh.vertices, training=training(mesh))
    plain = Tracker(mesh.faces, mesh.vertices)
    for n in range(1, 8):
        truth = waved(mesh.vertices, 0.1 * n)
        scan = half(*scan_of(mesh, truth, 3000, rng, noise=0.01))
        made, without = trained.push(*scan), plain.push(*scan)
    assert trained.report.prior_weight == 1
    assert error(mesh, truth, made) < 0.8 * error(mesh, truth, without)


def test_a_useless_training_changes_nothing(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(20)
    order = rng.permutation(len(mesh.vertices))
    other = Tracker(mesh.faces, mesh.vertices, training=training(mesh)[:, order])
    plain = Tracker(mesh.faces, mesh.vertices)
    for n in range(1, 6):
        scan = half(*scan_of(mesh, waved(mesh.vertices, 0.1 * n), 3000, rng, noise=0.01))
        assert (other.push(*scan) == plain.push(*scan)).all()
        assert other.report.prior_weight == 0


@pytest.mark.parametrize("resolution", ["best", 288])
def test_standard_errors_describe_the_distance_from_the_surface(
    resolution: Resolution, rng: np.random.Generator
) -> None:
    """Points tell the distance along normals well, and hidden parts follow a shape that changes."""
    mesh = bumpy_torus(24)
    tracker = Tracker(mesh.faces, mesh.vertices, uncertainty=True, resolution=resolution)
    plain = Tracker(mesh.faces, mesh.vertices, resolution=resolution)
    assert (tracker.standard_error == 0).all()
    seen, unseen = [], []
    for n in range(1, 16):
        truth = bent(mesh.vertices, 0.06 * n)
        scan = half(*scan_of(mesh, truth, 4000, rng, noise=0.02))
        tracked = tracker.push(*scan)
        assert (tracked == plain.push(*scan)).all()
        bars = tracker.standard_error
        assert (bars > 0).all()
        assert tracker.report.standard_error == pytest.approx(np.sqrt((bars**2).mean()))
        off = np.abs(((tracked - truth) * vertex_normals(mesh.faces, truth)).sum(axis=1))
        errors = off / tracker.standard_error
        seen.extend(errors[tracker.observed])
        unseen.extend(errors[~tracker.observed])
    assert 0.4 < np.mean(np.array(seen) < 0.674) < 0.75
    assert 0.8 < np.mean(np.array(seen) < 1.645) < 0.97
    assert np.mean(np.array(unseen) < 1.645) > 0.85
    assert np.mean(np.array(unseen) > 3) < 0.03


def test_unseen_vertices_of_a_lost_surface_may_be_as_far_from_it_as_points_are(
    rng: np.random.Generator,
) -> None:
    mesh, _ = person()
    tracker = Tracker(mesh.faces, mesh.vertices, uncertainty=True)
    tracker.push(*scan_of(mesh, mesh.vertices, 6000, rng, noise=0.01))
    cosine, sine = np.cos(0.8), np.sin(0.8)
    fallen = mesh.vertices @ np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    tracked = tracker.push(*scan_of(mesh, fallen, 6000, rng, noise=0.01))
    assert tracker.report.far > 0.05
    off = np.abs(((tracked - fallen) * vertex_normals(mesh.faces, fallen)).sum(axis=1))
    within = off <= 1.645 * tracker.standard_error
    assert within[~tracker.observed].mean() > 0.6


def test_where_nothing_was_measured_the_template_stays() -> None:
    mesh = bumpy_torus(16)
    tracker = Tracker(mesh.faces, mesh.vertices)
    points, normals = torus_scan(mesh, turned(mesh.vertices, 0.03))
    first = tracker.push(points, normals)
    empty = np.zeros((0, 3))
    for again in (
        tracker.skip(),
        tracker.push(empty, viewpoints=np.array([[9.0, 0, 0]])),
        tracker.push(np.add(points, [500, 0, 0]), normals),
    ):
        np.testing.assert_array_equal(again, first)
    assert (tracker.n_frames, int(tracker.age[0])) == (4, 3)
    assert not tracker.observed.any()
    assert tracker.report.disconnected == len(first)
    truth = turned(mesh.vertices, 0.06)
    assert np.abs(tracker.push(*torus_scan(mesh, truth)) - truth).max() < 0.3 * edge(mesh)
    assert tracker.age[0] == 0


@pytest.mark.parametrize("n_empty", [0, 2])
def test_a_first_scan_elsewhere_is_refused_and_later_ones_are_not(n_empty: int) -> None:
    """The first one is that in which something is seen."""
    mesh = bumpy_torus(24)
    tracker = Tracker(mesh.faces, mesh.vertices)
    for _ in range(n_empty):
        tracker.push(np.zeros((0, 3)))
        tracker.skip()
    before = tracker.state()
    points, normals = torus_scan(mesh, mesh.vertices)
    for wrong in (np.add(points, [30, 2, 1]), 1000 * points):
        with pytest.raises(ValueError, match=r"^points: "):
            tracker.push(wrong, normals)
        assert tracker.state() == before
    # What else is in a scan does not count.
    crowd = np.concatenate([np.add(points, [x, 0, 0]) for x in (0.0, 30, 60, 120, 180)])
    tracked = tracker.push(crowd, np.tile(normals, (5, 1)))
    assert np.abs(tracked - mesh.vertices).max() < 0.1 * edge(mesh)
    assert tracker.report.far > 0.5
    tracker.push(1000 * points, normals)


def test_a_template_that_is_lost_is_registered_anew_at_most_once_in_ten_frames() -> None:
    mesh = bumpy_torus(24)
    near, away = turned(mesh.vertices, 0.03), np.add(turned(mesh.vertices, 2.1), [40, 0, 0])
    first, jumped = torus_scan(mesh, near), torus_scan(mesh, away)
    plain = Tracker(mesh.faces, mesh.vertices)
    tracker = Tracker(mesh.faces, mesh.vertices, recover=True)
    np.testing.assert_array_equal(tracker.push(*first), plain.push(*first))
    assert not tracker.report.recovered
    assert np.abs(plain.push(*jumped) - away).max() > edge(mesh)
    assert plain.report.far > 0.05
    assert not plain.report.recovered
    assert np.abs(tracker.push(*jumped) - away).max() < 0.3 * edge(mesh)
    assert tracker.report.recovered
    assert tracker.report.far < 0.05
    # Nine frames are then not registered. A state holds the pause, too.
    other = Tracker(mesh.faces, mesh.vertices, recover=True, threads=2)
    other.restore(tracker.state())
    assert other.report.recovered
    with pytest.raises(ValueError, match="recover is True, not False"):
        plain.restore(tracker.state())
    beyond = np.add(away, [0, 40, 0])
    far = torus_scan(mesh, beyond)
    frames = [one.push(*far) for one in (tracker, other)]
    assert np.abs(frames[0] - beyond).max() > edge(mesh)
    for one in (tracker, other):
        assert not one.report.recovered
        for _ in range(7):
            one.skip()
        one.push(*far)
        assert not one.report.recovered
        frames.append(one.push(*far))
        assert one.report.recovered
    assert np.abs(frames[2] - beyond).max() < 0.3 * edge(mesh)
    np.testing.assert_array_equal(frames[1::2], frames[::2])


def test_a_subject_that_left_is_found_in_the_first_frame_in_which_it_is_back() -> None:
    """Frames without points are no searches, after which the next ones would have to wait."""
    mesh = bumpy_torus(24)
    tracker = Tracker(mesh.faces, mesh.vertices, recover=True)
    tracker.push(*torus_scan(mesh, turned(mesh.vertices, 0.03)))
    for _ in range(2):
        tracker.skip()
    back = np.add(turned(mesh.vertices, 2.1), [40, 0, 0])
    assert np.abs(tracker.push(*torus_scan(mesh, back)) - back).max() < 0.3 * edge(mesh)
    assert tracker.report.recovered


def test_a_registration_that_finds_nothing_leaves_no_trace(rng: np.random.Generator) -> None:
    mesh = bumpy_torus(16)
    points, normals = torus_scan(mesh, turned(mesh.vertices, 0.03))
    subject = points, normals
    crowd = np.concatenate([points, np.add(points, [6, 6, 3])]), np.tile(normals, (2, 1))
    rubbish = rng.uniform(-8, 8, points.shape), normals
    plain, tracker = (
        Tracker(mesh.faces, mesh.vertices, uncertainty=True, recover=on) for on in (False, True)
    )
    for scan in (crowd, subject, rubbish, rubbish):
        np.testing.assert_array_equal(tracker.push(*scan), plain.push(*scan))
        np.testing.assert_array_equal(tracker.standard_error, plain.standard_error)
        assert (plain.report.far > 0.05) == (scan is not subject)
        assert not tracker.report.recovered


def test_a_component_without_points_follows_the_others_and_may_be_anywhere() -> None:
    left = bumpy_torus(16)
    k = len(left.vertices)
    mesh = join(left, Mesh(left.faces, np.add(left.vertices, [20, 0, 0])))
    tracker = Tracker(mesh.faces, mesh.vertices, uncertainty=True)
    step = np.array([0.1, 0.05, 0])
    tracked = tracker.push(*torus_scan(left, left.vertices + step))
    assert np.abs(tracked - mesh.vertices - step).max() < 0.2 * edge(left)
    assert tracker.report.disconnected == k
    assert tracker.generation[-1] == -1
    assert np.isfinite(tracker.standard_error[:k]).all()
    assert np.isinf(tracker.standard_error[k:]).all()
    tracker.skip()
    assert np.isinf(tracker.standard_error).all()


def images_of(mesh: Mesh, vertices: Array, n_cameras: int = 2) -> DepthScan:
    """What cameras around the mesh see of it."""
    cameras = dynmesh.losses.orbit(mesh.vertices, n_cameras)
    return next(dynmesh.losses.depth_images([vertices], mesh.faces, cameras, width=96, height=96))


@pytest.mark.parametrize("change", ["rounding", "order"])
def test_what_is_found_in_depth_images_depends_on_the_surface_alone(change: str) -> None:
    """Not on rounding, or the order of the vertices."""
    mesh = bumpy_torus(24)
    order = np.arange(len(mesh.vertices))[:: -1 if change == "order" else 1]
    here = Tracker(mesh.faces, mesh.vertices)
    there = Tracker(np.argsort(order)[mesh.faces], mesh.vertices[order])
    for n in range(1, 5):
        depth, intrinsics, poses = images_of(mesh, turned(mesh.vertices, 0.02 * n))
        if change != "rounding":  # two by two pixels of each block of six by six
            row, column = np.indices((96, 96)) % 6
            depth = [np.where((row < 2) & (column < 2), image, 0) for image in depth]
        tracked = here.push_depth(depth, intrinsics, poses)
        if change == "rounding":
            poses = [pose.copy() for pose in poses]
            for pose in poses:
                pose[:3, 3] = np.nextafter(pose[:3, 3], 100)
        again = there.push_depth(depth, intrinsics, poses)
        # The preconditioner is rounded to single precision, where a last bit may decide.
        assert np.abs(again - tracked[order]).max() <= 1e-6


def test_the_agreement_counts_what_is_far_or_disagrees_but_no_strays(
    rng: np.random.Generator,
) -> None:
    mesh = bumpy_torus(24)
    tracker = Tracker(mesh.faces, mesh.vertices)
    points, normals = scan_of(mesh, mesh.vertices, 8000, rng)
    side = np.argsort(np.linalg.norm(points, axis=1))[:800]  # where faces are small
    over, strays = points[side] + 2 * edge(mesh) * normals[side], 30 * rng.normal(size=(100, 3))
    clouds = np.concatenate([points, over, points[:400], strays])
    towards = np.concatenate([normals, normals[side], -normals[:400], normals[:100]])
    tracker.push(clouds, towards)
    report = tracker.report
    assert report.points == pytest.approx(9200, rel=0.005)
    assert report.far == pytest.approx(800 / 9200, rel=0.02)
    assert report.disagreeing == pytest.approx(400 / 9200, rel=0.02)
    assert report.distance < 0.025 * edge(mesh)


def test_the_camera_that_stands_elsewhere_is_told() -> None:
    mesh = bumpy_torus(24)
    tracker = Tracker(mesh.faces, mesh.vertices)
    depth, intrinsics, poses = images_of(mesh, mesh.vertices, 4)
    poses[2] = poses[2].copy()
    poses[2][2, 3] += 2 * edge(mesh)
    tracker.push_depth([*depth[:3], 0 * depth[3]], intrinsics, poses)
    sensors, report = tracker.agreement_of_sensors, tracker.report
    far = np.array([one.far for one in sensors])
    points = np.array([one.points for one in sensors])
    assert far[2] > 2 * far[:2].max()
    assert points[3] == 0
    assert np.isnan(far[3])
    assert points.sum() == report.points
    assert far[:3] @ points[:3] == pytest.approx(report.far * report.points)
    tracker.skip()
    assert tracker.agreement_of_sensors == []
    assert np.isnan(tracker.report.far)
