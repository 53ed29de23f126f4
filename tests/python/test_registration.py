"""Registration of a template with a scan, as a function and a command, and what comes before."""

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from browser import Page, in_colour
from commands import dynmesh_command as run
from meshes import Array, Mesh, sheet
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from test_tracking import bent, bumpy_torus, edge, error, scan_of

import dynmesh
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.draw.figures import View
from dynmesh.scans import PointScan, write_ply
from dynmesh.tracking.landmarks import exchanged, read_landmarks
from dynmesh.tracking.placing import push_scan
from dynmesh.tracking.single_scan import open_single
from dynmesh.tracking.units import Units


@cache
def person() -> tuple[Mesh, Array]:
    """A person, and another pose."""
    frames = dynmesh.synth.walker(12)
    vertices = frames.vertices.astype(np.float64)
    return Mesh(frames.faces.astype(np.int64), vertices[0]), vertices[1]


def scan(mesh: Mesh, vertices: Array, rng: np.random.Generator, n: int = 4000) -> Any:
    return scan_of(mesh, vertices, n, rng, noise=0.05 * edge(mesh))


def register(mesh: Mesh, *scan: Array, **options: Any) -> dynmesh.Registration:
    return dynmesh.register(mesh.faces, mesh.vertices, *scan, **options)


TORUS = bumpy_torus(24)


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
    cameras = [camera for up in axes for camera in dynmesh.degrade.orbit(truth, 4, up=up)(0)]
    viewpoints = np.array([camera.position for camera in cameras])
    single = (1000 * TORUS.vertices).astype(np.float32)
    found = dynmesh.register(
        TORUS.faces, single, points, viewpoints=viewpoints, scale=True, uncertainty=True, threads=2
    )
    assert found.vertices.dtype == np.float32
    assert error(TORUS, truth, found.vertices) < 0.5
    assert found.standard_error is not None
    assert np.isfinite(found.standard_error[found.observed]).all()
    assert abs(np.cbrt(np.linalg.det(found.transform[:3, :3])) - 0.001) < 2e-5
    trained = register(
        TORUS,
        points,
        normals,
        training=[bent(TORUS.vertices, share) for share in (0.05, 0.1, 0.15)],
    )
    assert error(TORUS, truth, trained.vertices) < 0.5


def test_numbers_of_vertices_points_and_landmarks_mean_nothing(rng: np.random.Generator) -> None:
    truth = bent(TORUS.vertices, 0.3) + 1.0
    points, normals = scan(TORUS, truth, rng)
    marks = np.array([5, 120, 260, 400])
    found = register(TORUS, points, normals, landmarks=(marks, truth[marks]))
    order = rng.permutation(len(TORUS.vertices))
    new = np.argsort(order)
    of_marks = rng.permutation(len(marks))
    again = dynmesh.register(
        new[TORUS.faces],
        TORUS.vertices[order],
        points,
        normals,
        landmarks=(new[marks][of_marks], truth[marks][of_marks]),
    )
    assert np.abs(again.vertices[new] - found.vertices).max() < 0.01 * edge(TORUS)


@pytest.mark.parametrize("ratio", [0.5, 25.4])
def test_any_scale_is_found(ratio: float, rng: np.random.Generator) -> None:
    mesh, truth = person()
    turned = Rotation.from_euler("xyz", [1, 2, 3]).apply(truth)
    points, normals = scan(mesh, turned, rng)
    found = register(mesh, ratio * points, normals, scale=True)
    assert error(mesh, turned, found.vertices / ratio) < 0.5
    assert found.quality == "good"
    assert abs(found.growth / ratio - 1) < 0.02
    assert abs(np.cbrt(np.linalg.det(found.transform[:3, :3])) / ratio - 1) < 0.05


def test_wrong_scans_are_not_good(rng: np.random.Generator) -> None:
    """Of another body, of half of it, and of what the template is squeezed into."""
    mesh, _ = person()
    points, normals = scan(TORUS, TORUS.vertices, rng)
    half = points[:, 0] > np.median(points[:, 0])
    for wrong in (scan(mesh, mesh.vertices, rng), (points[half], normals[half])):
        size = np.ptp(TORUS.vertices) / np.ptp(wrong[0])
        found = register(TORUS, size * wrong[0], wrong[1])
        assert found.quality != "good"
        assert found.reason
    flat = TORUS.vertices * (1, 0.4, 1)
    found = register(TORUS, *scan(TORUS, flat, rng), align=False)
    assert found.far < 0.01
    assert found.quality != "good"


@pytest.mark.parametrize("seed", range(6))
def test_a_patch_of_a_surface(seed: int) -> None:
    """The template may fit better where it is than from any of the other rotations."""
    rng = np.random.default_rng(seed)
    points, normals = scan_of(TORUS, TORUS.vertices, 400, rng)
    kept = np.argsort(points @ rng.standard_normal(3))[: int(rng.integers(30, 120))]
    moved = points[kept] + 0.3 * rng.standard_normal(3)
    found = register(TORUS, moved, normals[kept])
    assert np.isfinite(found.vertices).all()


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
    (few,) = dynmesh.degrade.depth_images([mesh.vertices], mesh.faces, 4, width=160, height=120)
    images = few.depth, few.intrinsics, few.poses
    assert dynmesh.register_depth(mesh.faces, mesh.vertices, *images).quality == "good"


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


def test_the_search_goes_on_if_the_best_coarse_pose_has_a_twisted_leg(data: Path) -> None:
    horse = dynmesh.read(data / "horse_gallop.npz")
    first, other = horse.vertices[[0, 18]].astype(np.float64)
    mesh = Mesh(horse.faces.astype(np.int64), first)
    n_right = 0
    for seed in (1, 3, 7):
        truth = Rotation.random(random_state=seed).apply(other)
        box = np.stack([truth.min(axis=0), truth.max(axis=0)])
        ways = [dynmesh.degrade.orbit(box, 4, up=up) for up in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
        cameras = [camera for around in ways for camera in around(0)]
        (seen,) = dynmesh.degrade.scan_points([truth], mesh.faces, cameras, noise=0.05)
        found = dynmesh.register(mesh.faces, mesh.vertices, seen.points, seen.normals)
        n_right += error(mesh, truth, found.vertices) < 0.5 and found.quality == "good"
    assert n_right > 1


@pytest.mark.parametrize(
    ("file", "frame", "has_normals", "limit"),
    [
        ("horse_gallop", 9, True, 0.7),
        ("crane", 60, True, 0.2),
        ("crane", 100, True, 0.6),
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


SCAN, _ = scan_of(TORUS, TORUS.vertices, 6000, np.random.default_rng(0))
AWAY = np.array([30.0, -14, 52])
ANGLES = [[0.4, 0.2, -0.3], [1.9, 1.2, 0.6], [-2.6, 2.9, 1.1], [0, 3.1, 2.2]]
TURNS = [Rotation.from_euler("zxz", angles) for angles in ANGLES]


def found_in(scan: Array, mesh: Mesh = TORUS) -> dynmesh.Alignment:
    return dynmesh.find_alignment(mesh.faces, mesh.vertices, scan)


def moved(found: dynmesh.Alignment, vertices: Array = TORUS.vertices) -> Array:
    return np.asarray(vertices @ found.rotation.T + found.shift)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("side", ["whole", "one side"])
def test_a_template_that_was_moved_rigidly_is_found_again(turn: Rotation, side: str) -> None:
    scan = SCAN if side == "whole" else SCAN[SCAN[:, 1] > np.median(SCAN[:, 1])]
    found = found_in(turn.apply(scan) + AWAY)
    assert found.matches
    assert not found.lies_in_scan
    assert found.before > 5
    assert found.after < 0.3
    assert found.mean_edge == pytest.approx(mean_edge_of(TORUS.vertices, TORUS.faces), rel=0.05)
    off = np.abs(moved(found) - turn.apply(TORUS.vertices) - AWAY).max()
    assert off < 0.3 * found.mean_edge
    assert side != "whole" or found.ratio == pytest.approx(1, rel=0.1)


def test_a_template_that_lies_in_the_scan_stays() -> None:
    """Also in a scan of a part of it, or with more else than of it and some points far away."""
    found = found_in(SCAN)
    assert found.lies_in_scan
    assert found.matches
    assert found.after == found.before < 0.3
    np.testing.assert_array_equal(moved(found), TORUS.vertices)
    assert found_in(SCAN[np.argsort(SCAN[:, 0])[: len(SCAN) // 4]]).lies_in_scan
    others = [TURNS[1].apply(SCAN) + np.array([0, 0, height]) for height in (3, 6)]
    far = np.array([[1e6, 1e7 * i, -1e6] for i in range(20)])
    found = found_in(np.concatenate([SCAN, *others, far]))
    assert found.lies_in_scan
    assert not found.other_unit


@pytest.mark.parametrize("unit", [2.0**200, 2.0**-200, 1e4])
def test_the_unit_of_length_does_not_matter(unit: float) -> None:
    scan = TURNS[0].apply(SCAN) + AWAY
    expected = found_in(scan)
    found = found_in(unit * scan, Mesh(TORUS.faces, unit * TORUS.vertices))
    assert found.before == pytest.approx(expected.before, rel=1e-9)
    assert found.after == pytest.approx(expected.after, rel=1e-6)
    assert found.mean_edge / unit == pytest.approx(expected.mean_edge, rel=1e-9)
    np.testing.assert_allclose(found.rotation, expected.rotation, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found.shift / unit, expected.shift, rtol=1e-6)


def test_another_size_another_unit_and_another_shape() -> None:
    twice = found_in(2 * SCAN + AWAY)
    assert twice.ratio == pytest.approx(2, rel=0.1)
    assert not twice.other_unit
    assert not twice.lies_in_scan
    thousandth = found_in(1000 * SCAN)
    assert thousandth.ratio == pytest.approx(1000, rel=0.1)
    assert thousandth.other_unit
    assert not thousandth.matches
    assert thousandth.after == thousandth.before
    np.testing.assert_array_equal(moved(thousandth), TORUS.vertices)
    flat = found_in(TURNS[0].apply(sheet(40).vertices) + AWAY)
    assert not flat.other_unit
    assert not flat.matches
    assert not found_in(np.array([[1.0, 2, 3]])).matches
    dot = found_in(SCAN, Mesh(np.array([[0, 1, 2]]), np.tile([1.0, 2, 3], (3, 1))))
    assert not dot.matches
    assert np.isfinite(dot.rotation).all()


def written(folder: Path, torus: Mesh, rng: np.random.Generator) -> Array:
    """Writes a template and scans, and returns the true positions."""
    truth = Rotation.from_euler("xyz", [2, 1, 0.5]).apply(torus.vertices)
    dynmesh.write(folder / "body.obj", dynmesh.Sequence(torus.vertices[None], torus.faces))
    (folder / "scans").mkdir()
    points, normals = scan(torus, truth, rng)
    write_ply(folder / "scans" / "first.ply", PointScan(points, normals, None))
    mesh = dynmesh.Sequence(truth[None], torus.faces)
    dynmesh.write(folder / "scans" / "second.obj", mesh)
    return truth


def positions(path: Path) -> Array:
    return np.asarray(dynmesh.read(path).vertices[0], np.float64)


@pytest.mark.parametrize("name", ["first.ply", "second.obj", "third.stl", "fourth.glb"])
def test_a_scan_of_any_format(name: str, rng: np.random.Generator, tmp_path: Path) -> None:
    """A point cloud, or a mesh whose vertices are the points; the template keeps its materials."""
    truth = written(tmp_path, TORUS, rng)
    body, scan_file, made = tmp_path / "body.obj", tmp_path / "scans" / name, tmp_path / "made.obj"
    body.write_text("usemtl skin\n" + body.read_text())
    is_model = not scan_file.exists()
    if is_model:
        trimesh.Trimesh(truth, TORUS.faces, process=False).export(scan_file)
    told = json.loads(run("register", body, scan_file, made, "--json").stdout)
    assert told["quality"] == "good"
    assert "usemtl skin" in made.read_text()
    assert error(TORUS, truth, positions(made)) < 0.5
    if is_model:
        scan_file.write_bytes(scan_file.read_bytes()[:100])
        refused = run("register", body, scan_file, made, "--overwrite", code=1).stderr
        assert f"{name}: cannot be read as {name[-3:].upper()}" in refused


@pytest.mark.parametrize("suffix", ["obj", "ply"])
def test_meshes_as_scans_have_the_normals_of_their_faces(tmp_path: Path, suffix: str) -> None:
    dynmesh.write(tmp_path / f"scan.{suffix}", dynmesh.Sequence(TORUS.vertices[None], TORUS.faces))
    (scan,) = open_single(tmp_path / f"scan.{suffix}", None).frames()
    assert isinstance(scan, PointScan)
    assert scan.normals is not None
    corners = TORUS.vertices[TORUS.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    of_faces = across / np.linalg.norm(across, axis=1, keepdims=True)
    assert ((scan.normals[TORUS.faces[:, 0]] * of_faces).sum(axis=1) > 0.7).all()


def test_depth_images_of_one_moment_are_one_scan(tmp_path: Path) -> None:
    turned = Rotation.from_euler("xyz", [2, 1, 0.5]).apply(TORUS.vertices)
    truth = np.stack([TORUS.vertices, turned])
    dynmesh.write(tmp_path / "truth.npz", dynmesh.Sequence(truth, TORUS.faces, start=7))
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(truth[:1], TORUS.faces))
    depth, made = tmp_path / "depth", tmp_path / "made.obj"
    size = ("--depth", "160x120", "--cameras", "4", "--up", "z")
    run("degrade", tmp_path / "truth.npz", depth, *size)
    words = ("register", tmp_path / "body.obj", depth / "depth_00008_*.png", made)
    run(*words)
    assert error(TORUS, turned, positions(made)) < 0.5
    assert "holds 2 scans" in run(*words[:2], depth, tmp_path / "two.obj", code=1).stderr
    (depth / "depth_00008_1.png").unlink()
    assert "no image of camera '1' for frame 8" in run(*words, "--overwrite").stderr
    (depth / "cameras.json").rename(tmp_path / "rig.json")
    refused = run(*words, "--overwrite", code=2).stderr
    assert "depth images need cameras" in refused
    run(*words, "--overwrite", "--cameras", tmp_path / "rig.json")


def test_the_page(rng: np.random.Generator, tmp_path: Path, browser: Any) -> None:
    """A template that is elsewhere and in another unit, in its scan and one of something else."""
    written(tmp_path, TORUS, rng)
    template = TORUS.vertices / 1000 + [50, 0, 0]
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(template[None], TORUS.faces))
    wrong = rng.normal(size=(2000, 3)) * np.ptp(TORUS.vertices, axis=0) / 3
    write_ply(tmp_path / "scans" / "wrong.ply", PointScan(wrong, None, None))
    yellow = []
    for name, quality in (("first", "good"), ("wrong", "ruined")):
        files = tmp_path / "body.obj", tmp_path / "scans" / f"{name}.ply", tmp_path / f"{name}.obj"
        html, code = tmp_path / f"{name}.html", 0 if quality == "good" else 3
        run("register", *files, "--scale", "--page", html, code=code)
        page = Page(browser, html)
        captions = [f"{name}.ply, the scan", f"{name}.obj"]
        assert page.captions() == captions
        assert page.text("title").split()[0] == "distance"
        pictures = page.pictures(0, 1)
        areas = [in_colour(pixels).mean() for pixels in pictures]
        assert min(areas) > 0.005
        _, green, blue = pictures[1][in_colour(pictures[1])].mean(axis=0)
        yellow.append(green - blue)
        assert page.complaints == []
    assert yellow[1] > yellow[0] + 10


def seen(points: Array, width: float, height: float) -> Array:
    """Where a page shows points at first, in pixels, and how far in front, (n, 3)."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    x, y, z = View.of(points, "z", 60.0).axes @ ((points - middle) / np.ptp(points, axis=0).max()).T
    scale = height / 2 / (0.7 * max(1, height / width) - z * np.tan(np.radians(15)))
    return np.stack([width / 2 + scale * x, height / 2 - scale * y, z], axis=1)


def test_landmarks_are_picked_by_clicks(tmp_path: Path, browser: Any) -> None:
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(TORUS.vertices[None], TORUS.faces))
    scanned = 1000 * TORUS.vertices + 7
    write_ply(tmp_path / "cloud.ply", PointScan(scanned, None, None))
    html = tmp_path / "pick.html"
    words = ("view", tmp_path / "body.obj", "--scans", tmp_path / "cloud.ply", "-o", html)
    run(*words, "--pick", "marks.json", "--up", "z")
    page = browser.new_page()
    page.set_viewport_size({"width": 1400, "height": 700})
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(html.as_uri())
    page.wait_for_selector("#dynmesh-pairs[data-ready]", state="attached")

    def click(side: str, points: Array, index: int) -> None:
        box = page.locator(f"#dynmesh-{side}").bounding_box()
        x, y, _ = seen(points, box["width"], box["height"])[index]
        page.mouse.click(box["x"] + x, box["y"] + y)

    front = np.argsort(-seen(TORUS.vertices, 1, 1)[:, 2])[:40]
    vertices = front[[0, 13, 26, 39]]
    assert page.is_disabled("#dynmesh-save")
    for vertex in vertices:
        click("template", TORUS.vertices, front[20])  # and then another choice
        click("template", TORUS.vertices, vertex)
        click("scan", scanned, vertex)
    click("template", TORUS.vertices, front[20])
    page.mouse.move(200, 200)  # which turns the view and picks nothing
    page.mouse.down()
    page.mouse.move(240, 210, steps=3)
    page.mouse.up()
    assert page.locator("#dynmesh-pairs tr").count() == 5
    page.click("#dynmesh-undo")
    with page.expect_download() as download:
        page.click("#dynmesh-save")
    assert download.value.suggested_filename == "marks.json"
    download.value.save_as(tmp_path / "marks.json")
    made_of, positions_of = read_landmarks(tmp_path / "marks.json")
    np.testing.assert_array_equal(made_of, vertices)
    np.testing.assert_allclose(positions_of, scanned[vertices], rtol=1e-5)
    assert complaints == []
    files = tmp_path / "body.obj", tmp_path / "cloud.ply", tmp_path / "made.obj"
    run("register", *files, "--scale", "--landmarks", tmp_path / "marks.json")
    assert error(TORUS, TORUS.vertices, (positions(tmp_path / "made.obj") - 7) / 1000) < 0.3


def test_a_template_in_inches_and_a_scan_in_metres(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    """A vertex without faces does not count in the size."""
    truth = written(tmp_path, TORUS, rng)
    inches = np.concatenate([TORUS.vertices / 0.0254, [[1e5, 0, 0]]])
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(inches[None], TORUS.faces))
    words = ("register", tmp_path / "body.obj", tmp_path / "scans" / "first.ply")
    said = run(*words, tmp_path / "none.obj", code=1).stderr
    assert re.search(r"the scan is 0\.02\d* times as large as the template, as if", said)
    asked = "as if the template were in inch and the scan in m: if so, say it by "
    assert asked + "--template-unit and --scan-unit" in said
    units = ("--template-unit", "inch", "--scan-unit", "m")
    assert asked + "--scan-unit" in run(*words, tmp_path / "none.obj", *units[:2], code=1).stderr
    run(*words, tmp_path / "made.obj", *units)
    made = dynmesh.read(tmp_path / "made.obj")
    assert error(TORUS, truth, np.asarray(made.vertices[0, :-1], np.float64)) < 0.5
    assert made.metres_per_unit == 1


@pytest.mark.parametrize(
    ("ratio", "size", "pair"),
    [
        (0.00095, 1800, "in mm and the scan in m"),
        (950, 1.8, "in m and the scan in mm"),
        (0.00095, 0.5, "in m and the scan in km"),  # a template of half a millimetre is none
        (26, 70, "in inch and the scan in mm"),
        (3.3, 1.8, "in m and the scan in foot"),
        (1.3, 1.8, None),
        (7, 1.8, ""),
    ],
)
def test_units_that_explain_sizes(ratio: float, size: float, pair: str | None) -> None:
    told = Units(None, None).told(ratio, size)
    assert bool(told) == (pair is not None)
    assert (f"as if the template were {pair}" in told) == bool(pair)


def test_units_that_are_stated_and_wrong() -> None:
    assert "as if both were in the same unit" in Units(1, 0.001).told(0.00095, 1.8)


def test_a_wrong_scan_ends_with_code_3_and_its_cause(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    points, normals = scan(TORUS, written(tmp_path, TORUS, rng), rng, 1000)
    size = np.ptp(TORUS.vertices, axis=0).max()
    floor = rng.uniform(-3, 3, (1000, 3)) * size * [1, 1, 0] + points.min(axis=0) * [0, 0, 1]
    room = np.concatenate([points, floor])
    marks = [{"vertex": v, "position": list(TORUS.vertices[v] + size)} for v in (5, 120, 260)]
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    landmarks = ("--landmarks", tmp_path / "marks.json")
    wrong: dict[str, tuple[PointScan, tuple[Any, ...]]] = {
        "landmarks say where": (PointScan(2 * rng.normal(size=(1000, 3)), None, None), ()),
        ": the normals of the scan point inwards": (PointScan(points, -normals, None), ()),
        "such as a floor; --remove-planes": (PointScan(room, None, None), ()),
        "--scale finds it in any size": (PointScan(2.2 * points, normals, None), ()),
        "which --align does": (PointScan(points + 9 * size, normals, None), ("--no-align",)),
        ": all landmarks are ": (PointScan(points, normals, None), landmarks),
    }
    made = tmp_path / "made.obj"
    for cause, (one, options) in wrong.items():
        write_ply(tmp_path / "wrong.ply", one)
        words = (tmp_path / "body.obj", tmp_path / "wrong.ply", made)
        said = run("register", *words, *options, "--overwrite", code=3).stderr
        assert re.search("made.obj: (doubtful|ruined): ", said)
        assert cause in said
        assert ("--remove-planes" in said) == ("--remove-planes" in cause)
        # It is the room that is large.
        assert "--remove-planes" not in said or "--scale" not in said
        assert made.exists()
    (tmp_path / "marks.json").write_text(json.dumps([marks[0] | {"vertex": 99999}]))
    said = run("register", *words, *landmarks, "--overwrite", code=1).stderr
    assert "marks.json: landmarks: landmark 0 is of vertex 99999" in said


def test_normals_that_point_inwards_are_named_where_tracking_begins(
    rng: np.random.Generator,
) -> None:
    mesh, _ = person()
    points, normals = scan(mesh, mesh.vertices, rng)
    with pytest.raises(ValueError, match=r"point inwards; .* far from the first scan"):
        push_scan(dynmesh.Tracker(mesh.faces, mesh.vertices), PointScan(points + 9, -normals, None))


@pytest.mark.parametrize(
    ("pairs", "named"),
    [
        ([(5, 5), (60, 60), (120, 120), (260, 260), (330, 330), (400, 130)], " of vertex 400 "),
        (
            [(5, 5), (60, 60), (120, 330), (260, 260), (330, 120), (400, 400)],
            "s of vertices 120 and",
        ),
    ],
)
def test_landmarks_that_contradict_the_scan(
    pairs: list[tuple[int, int]], named: str, rng: np.random.Generator, tmp_path: Path
) -> None:
    truth = written(tmp_path, TORUS, rng)
    marks = [{"vertex": vertex, "position": truth[other].tolist()} for vertex, other in pairs]
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    words = (tmp_path / "body.obj", tmp_path / "scans" / "first.ply", tmp_path / "made.obj")
    said = run("register", *words, "--landmarks", tmp_path / "marks.json", code=3).stderr
    assert re.search(rf"(doubtful|ruined): the landmark{named}", said)


def test_exchanged_and_mirrored_landmarks(rng: np.random.Generator) -> None:
    """Seen from behind, exchanged hands of a person are exchanged feet."""
    person = np.array([[0, 0, 1.75], [-0.8, 0, 1.4], [0.8, 0, 1.4], [-0.2, 0.1, 0], [0.2, 0.1, 0]])
    for hands in ([0, 2, 1, 3, 4], [0, 1, 2, 4, 3]):
        places = person[hands] + rng.normal(size=(5, 3)) * 0.02
        told = exchanged(person, (np.arange(5), places))
        assert "of vertices 1 and 2, or of 3 and 4 are" in told
    vertices = np.arange(0, 400, 37)
    mirrored = TORUS.vertices * [-1, 1, 1]
    assert exchanged(TORUS.vertices, (vertices, TORUS.vertices[vertices])) == ""
    assert "left and right" in exchanged(TORUS.vertices, (vertices, mirrored[vertices]))


@pytest.mark.parametrize(
    ("cause", "changed"),
    [
        ("size", {"growth": 2.0, "quality": "ruined"}),
        ("part", {"hole": 0.45}),
        ("pose", {"far": 0.3, "hole": 0.5, "quality": "ruined"}),
        ("pose", {"stretch": 0.2}),
        ("place", {"hole": 0.05}),
    ],
)
def test_the_cause_of_a_doubt(
    cause: str, changed: dict[str, Any], rng: np.random.Generator
) -> None:
    found = dynmesh.register(TORUS.faces, TORUS.vertices, *scan(TORUS, TORUS.vertices, rng))
    assert found.reason == ""
    wrong = replace(found, **({"quality": "doubtful"} | changed))
    assert wrong.cause == cause
    assert wrong.reason
