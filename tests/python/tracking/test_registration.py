"""Registration of a template with a scan, as a function."""

import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array, Mesh, sheet
from scans_of_meshes import TORUS, bent, edge, error, person, scan
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import dynmesh
from dynmesh.scans import PointScan


def register(mesh: Mesh, *scan: Array, **options: Any) -> dynmesh.registration.Registration:
    return dynmesh.register(mesh.faces, mesh.vertices, *scan, **options)


def test_a_template_comes_back_from_any_rotation(rng: np.random.Generator) -> None:
    mesh, _ = person()
    for rotation in Rotation.random(6, random_state=7):
        truth = rotation.apply(mesh.vertices) + np.array([5.0, -3, 2])
        found = register(mesh, *scan(mesh, truth, rng))
        assert error(mesh, truth, found.vertices) < 0.3
        assert (found.quality, found.reason) == ("good", "")
        rigid = mesh.vertices @ found.transform[:3, :3].T + found.transform[:3, 3]
        assert error(mesh, truth, rigid) < 1


def test_all_that_can_be_given(rng: np.random.Generator) -> None:
    """Another unit, no normals, cameras, standard errors, threads and single precision."""
    truth = Rotation.from_euler("xyz", [1, 2, 3]).apply(bent(TORUS.vertices, 0.1))
    points, normals = scan(TORUS, truth, rng)
    axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    cameras = [camera for up in axes for camera in dynmesh.losses.orbit(truth, 4, up=up)(0)]
    viewpoints = np.array([camera.position for camera in cameras])
    single = (1000 * TORUS.vertices).astype(np.float32)
    found: Any = dynmesh.register(
        TORUS.faces, single, points, viewpoints=viewpoints, scale=True, uncertainty=True, threads=2
    )
    assert found.vertices.dtype == np.float32
    assert error(TORUS, truth, found.vertices) < 0.5
    assert np.isfinite(found.standard_error[found.observed]).all()
    assert abs(np.cbrt(np.linalg.det(found.transform[:3, :3])) - 0.001) < 2e-5
    trained = register(
        TORUS,
        points,
        normals,
        training=[bent(TORUS.vertices, share) for share in (0.05, 0.1, 0.15)],
    )
    assert error(TORUS, truth, trained.vertices) < 0.5


def test_a_pair_of_points_and_normals_is_what_its_parts_are(rng: np.random.Generator) -> None:
    """As in the list of scans that `dynmesh.track` takes."""
    points, normals = scan(TORUS, bent(TORUS.vertices, 0.1), rng)
    apart = dynmesh.register(TORUS.faces, TORUS.vertices, points, normals)
    for pair in ((points, normals), PointScan(points, normals, None)):
        together = dynmesh.register(TORUS.faces, TORUS.vertices, pair)
        np.testing.assert_array_equal(together.vertices, apart.vertices)
    with_normals = dynmesh.register(
        TORUS.faces, TORUS.vertices, PointScan(points, None, None), normals
    )
    np.testing.assert_array_equal(with_normals.vertices, apart.vertices)
    with pytest.raises(ValueError, match="normals: are those of the scan"):
        dynmesh.register(TORUS.faces, TORUS.vertices, (points, normals), normals)


@pytest.mark.parametrize("ratio", [0.5, 25.4])
def test_any_scale_is_found(ratio: float, rng: np.random.Generator) -> None:
    mesh, truth = person()
    turned = Rotation.from_euler("xyz", [1, 2, 3]).apply(truth)
    points, normals = scan(mesh, turned, rng)
    found = register(mesh, ratio * points, normals, scale=True)
    assert error(mesh, turned, found.vertices / ratio) < 0.5
    assert found.quality == "good"
    assert abs(found.scale * found.growth / ratio - 1) < 0.02
    assert abs(np.cbrt(np.linalg.det(found.transform[:3, :3])) / ratio - 1) < 0.05


def test_points_may_be_sparse(rng: np.random.Generator) -> None:
    """Wider than the edges, the distances between points leave most vertices without one."""
    mesh, _ = person()
    points, normals = scan(mesh, mesh.vertices, rng, n=1000)
    found = register(mesh, points, normals)
    assert not found.observed.mean() > 0.5
    assert found.quality == "good"
    lower = points[:, 2] < np.median(points[:, 2])
    found = register(mesh, points[lower], normals[lower])
    assert found.quality != "good"
    (few,) = dynmesh.losses.depth_images([mesh.vertices], mesh.faces, 4, width=160, height=120)
    assert dynmesh.register(mesh.faces, mesh.vertices, few).quality == "good"


@pytest.mark.parametrize(
    ("frames", "frame", "n", "n_landmarks", "missing"),
    [
        pytest.param(
            20, 1, 20_000, 4, (), id="exchanged legs, of which landmarks on the trunk say nothing"
        ),
        pytest.param(12, 3, 2000, 0, (), id="a body that is turned front to back"),
        pytest.param(12, 3, 2000, 0, (0.16, 0.28), id="exchanged shins below unmeasured knees"),
    ],
)
def test_what_explains_the_points_by_stretching_is_not_found(
    rng: np.random.Generator,
    frames: int,
    frame: int,
    n: int,
    n_landmarks: int,
    missing: tuple[float, ...],
) -> None:
    sequence = dynmesh.synth.walker(frames)
    mesh = Mesh(sequence.faces.astype(np.int64), sequence.vertices[0].astype(np.float64))
    truth = sequence.vertices[frame].astype(np.float64)
    points, normals = scan(mesh, truth, rng, n=n)
    height = (points[:, 2] - points[:, 2].min()) / np.ptp(points[:, 2])
    kept = np.searchsorted(missing, height) != 1
    marks = rng.choice(np.flatnonzero(mesh.vertices[:, 2] > 1), n_landmarks, replace=False)
    landmarks = (marks, truth[marks]) if n_landmarks else None
    found = register(mesh, points[kept], normals[kept], landmarks=landmarks)
    assert error(mesh, truth, found.vertices) < 0.5
    assert found.quality == "good"


@pytest.mark.parametrize(
    ("axis", "above"),
    [pytest.param(0, 0.18, id="an arm"), pytest.param(2, 1.5, id="a head")],
)
def test_what_was_not_scanned_stays_where_it_was(
    rng: np.random.Generator, axis: int, above: float
) -> None:
    mesh, _ = person()
    points, normals = scan(mesh, mesh.vertices, rng)
    kept = mesh.vertices[cKDTree(mesh.vertices).query(points)[1], axis] < above
    found = register(mesh, points[kept], normals[kept], align=False)
    assert found.far < 0.01
    assert found.hole > 0.03
    assert found.overlap < 0.005
    assert found.quality == "doubtful"
    assert "of the template" in found.reason


def test_a_landmark_of_a_part_without_points_holds_and_is_not_blamed(
    rng: np.random.Generator,
) -> None:
    mesh, truth = person()
    points, normals = scan(mesh, truth, rng)
    hand = int(mesh.vertices[:, 0].argmax())
    away = np.linalg.norm(points - truth[hand], axis=1) > 10 * edge(mesh)
    marks = np.array([hand])
    position = truth[marks] + 3 * edge(mesh) * np.array([[1.0, 0, 0]])
    found = register(mesh, points[away], normals[away], landmarks=(marks, position))
    assert np.linalg.norm(found.vertices[hand] - position[0]) < 0.5 * edge(mesh)
    rest = np.linalg.norm(truth - truth[hand], axis=1) > 20 * edge(mesh)
    off = np.linalg.norm(found.vertices - truth, axis=1)[rest]
    assert off.mean() < 0.5 * edge(mesh)
    assert found.quality == "good" or "landmarks" not in found.reason


def test_landmarks_on_limbs_that_moved(rng: np.random.Generator) -> None:
    """Two hands and a foot do not tell how the body has moved."""
    mesh, truth = person()
    marks = np.array([412, 3077, 9120])
    found = register(mesh, *scan(mesh, truth, rng), landmarks=(marks, truth[marks]))
    assert error(mesh, truth, found.vertices) < 1
    assert found.quality == "good"


@pytest.mark.parametrize("frame", [8, 9])
def test_far_poses(frame: int, rng: np.random.Generator) -> None:
    """A handstand, in which closest points exchange limbs: distances along the body tell them."""
    mesh, _ = person()
    truth = dynmesh.synth.walker(12).vertices[frame].astype(np.float64)
    truth = Rotation.from_euler("xyz", [1, 2, 3]).apply(truth)
    found = register(mesh, *scan(mesh, truth, rng, 20_000))
    assert error(mesh, truth, found.vertices) < 1.5
    assert found.quality != "ruined"


def test_a_registration_ends_when_it_is_interrupted(rng: np.random.Generator) -> None:
    def interrupt(*_: Any) -> None:
        raise InterruptedError

    mesh, truth = person()
    measured = scan(mesh, truth, rng)
    begin = time.perf_counter()
    register(mesh, *measured)
    whole = time.perf_counter() - begin
    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.1 * whole)
        with pytest.raises(InterruptedError):
            register(mesh, *measured)
    finally:
        signal.signal(signal.SIGALRM, before)
    assert time.perf_counter() - begin < 1.7 * whole


def test_the_search_goes_on_if_the_best_coarse_pose_has_a_twisted_leg(data: Path) -> None:
    horse = dynmesh.read(data / "horse_gallop.npz")
    first, other = horse.vertices[[0, 18]].astype(np.float64)
    mesh = Mesh(horse.faces.astype(np.int64), first)
    n_right = 0
    for seed in (1, 3, 7):
        truth = Rotation.random(random_state=seed).apply(other)
        box = np.stack([truth.min(axis=0), truth.max(axis=0)])
        ways = [dynmesh.losses.orbit(box, 4, up=up) for up in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
        cameras = [camera for around in ways for camera in around(0)]
        (seen,) = dynmesh.losses.scan_points([truth], mesh.faces, cameras, noise=0.05)
        found = dynmesh.register(mesh.faces, mesh.vertices, seen.points, seen.normals)
        n_right += error(mesh, truth, found.vertices) < 0.5 and found.quality == "good"
    assert n_right > 1


@pytest.mark.parametrize(
    ("file", "frame", "has_normals", "limit"),
    [
        ("horse_gallop", 9, True, 0.7),
        ("horse_gallop", 18, True, 0.6),
        ("crane", 60, True, 0.2),
        ("crane", 100, True, 0.3),
        ("crane", 110, False, 0.2),
    ],
)
def test_neither_twisted_limbs_nor_sharp_joints_nor_dense_parts_lead_astray(
    file: str, frame: int, has_normals: bool, limit: float, data: Path, rng: np.random.Generator
) -> None:
    """Each face has as many points, though some of the horse are a thousand times as large."""
    frames = dynmesh.read(data / f"{file}.npz")
    first, other = frames.vertices[[0, frame]].astype(np.float64)
    mesh = Mesh(frames.faces.astype(np.int64), first)
    for rotation in Rotation.random(2, random_state=0):
        truth = rotation.apply(other)
        points, normals = scan(mesh, truth, rng, 20000)
        found = register(mesh, points, *([normals] if has_normals else []))
        assert error(mesh, truth, found.vertices) < limit


def test_vertices_without_edges_tell_no_size_and_no_shape(rng: np.random.Generator) -> None:
    angle = 0.5 * TORUS.vertices[:, 2]
    twisted = Rotation.from_euler("z", angle[:, None]).apply(TORUS.vertices)
    given = scan(TORUS, twisted, rng)
    lone = 100 * rng.normal(size=(2 * len(TORUS.vertices), 3))
    alone = register(TORUS, *given)
    among = dynmesh.register(TORUS.faces, np.concatenate([TORUS.vertices, lone]), *given)
    assert alone.stretch > 0.01
    assert among.stretch == pytest.approx(alone.stretch, rel=0.2)


def test_the_inside_of_a_shell_need_not_be_measured(rng: np.random.Generator) -> None:
    """A sensor behind the shell sees the inside of what is hidden from the other."""
    x, y, _ = sheet(40).vertices.T / 39
    u, v = np.pi * (y - 0.5), np.pi * (0.1 + 0.8 * x)
    r = 1 + 0.1 * np.sin(3 * u + v) + 0.1 * np.cos(2 * v)
    round_ = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=1)
    shell = Mesh(sheet(40).faces, r[:, None] * round_)
    points, normals = scan(shell, shell.vertices, rng)
    sensors = np.array([[0.0, 6, 0], [-6, 0, 0]])
    seen = ((sensors[0] - points) * normals).sum(axis=1) > 0
    given = points[seen], normals[seen]
    found = register(shell, *given, viewpoints=sensors, align=False)
    assert found.quality == "good"
