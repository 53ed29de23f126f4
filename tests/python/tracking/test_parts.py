"""Tracking of subjects of several parts: what moves apart, and what stays together."""

from collections.abc import Callable, Iterator
from functools import cache, partial

import numpy as np
import pytest
from meshes import Array, Mesh
from numpy.typing import NDArray
from parts import Part, ball, joined, on_joints, turned
from scans_of_meshes import edge
from scipy.spatial import cKDTree

import dynmesh
from dynmesh import Tracker, losses
from dynmesh.tracker import Resolution

FRAMES = 10


def bodies_that_part() -> list[Part]:
    """Four bodies that touch, and move away from each other by 1.5 edges a frame as they turn."""
    places = np.array([(1.02, 0, 0), (-1.02, 0, 0), (0, 1.5, 0), (0, -1.5, 0)])
    parts = []
    for number, place in enumerate(places):
        mesh = ball(3, (1, 0.6, 0.8), place)
        step = 1.5 * edge(mesh) * place / np.linalg.norm(place)

        def moved(
            x: Array, frame: int, place: Array = place, step: Array = step, number: int = number
        ) -> Array:
            x = turned((number + 1, 1, 2 - number), 0.06 * frame, x, place)
            return np.asarray(x + frame * step)

        parts.append(Part(mesh, moved))
    return parts


def chain_of_links() -> list[Part]:
    """Six links, each of which turns on the one before."""
    shapes = [ball(3, (0.5, 0.35, 0.22), np.array([0.98 * n, 0, 0])) for n in range(6)]
    return [Part(shape, partial(on_joints, link=n)) for n, shape in enumerate(shapes)]


def small_parts_beside_a_limb() -> list[Part]:
    """An arm that swings away from four small parts, which rest."""
    arm = ball(4, (2, 0.3, 0.3), np.array([2.0, 0, 0]))
    parts = [Part(arm, lambda x, frame: turned((0, 1, 0), 0.07 * frame, x, np.zeros(3)))]
    for n in range(4):
        small = ball(2, (0.16, 0.13, 0.1), np.array([1.2 + 0.6 * n, 0.1, 0.45]))
        parts.append(Part(small, lambda x, _: x))
    return parts


def cut(mesh: Mesh, is_kept: NDArray[np.bool_]) -> Mesh:
    """The vertices for which this is True, with the faces between them."""
    used, faces = np.unique(mesh.faces[is_kept[mesh.faces].all(axis=1)], return_inverse=True)
    return Mesh(faces.reshape(-1, 3), mesh.vertices[used])


def head_with_a_cap() -> list[Part]:
    """A head that nods and turns, with a cap close to it, and two eyes."""
    head = ball(4, (0.8, 0.9, 1.1), np.zeros(3))
    cap = cut(head, head.vertices[:, 2] > 0.5)

    def moved(x: Array, frame: int) -> Array:
        x = turned((1, 0, 0), 0.12 * np.sin(0.5 * frame), x, np.zeros(3))
        x = turned((0, 0, 1), 0.24 * np.sin(0.6 * frame), x, np.zeros(3))
        return np.asarray(x + frame * np.array([0.05, 0.02, 0]))

    eyes = [ball(2, (0.13, 0.13, 0.13), np.array([side, -0.8, 0.1])) for side in (-0.3, 0.3)]
    cap = Mesh(cap.faces, 1.05 * cap.vertices)
    return [Part(mesh, moved) for mesh in (head, cap, *eyes)]


def body_in_a_shirt() -> list[Part]:
    """A body that leans and turns, in a wide shirt that sways around it."""
    body = ball(4, (0.5, 0.4, 1.5), np.zeros(3))
    shirt = cut(body, np.abs(body.vertices[:, 2]) < 0.8)
    outwards = shirt.vertices * [1, 1, 0]
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    shirt = Mesh(shirt.faces, shirt.vertices + 0.8 * edge(body) * outwards)

    def moved(x: Array, frame: int, sway: float) -> Array:
        x = turned((0, 0, 1), 0.03 * frame + sway * np.sin(0.5 * frame), x, np.zeros(3))
        return turned((0, 1, 0), 0.15 * np.sin(0.4 * frame), x, np.array([0, 0, -1.5]))

    return [Part(body, partial(moved, sway=0)), Part(shirt, partial(moved, sway=0.04))]


def pieces_that_fly_apart() -> list[Part]:
    """Fourteen pieces that leave a centre by up to their size in a frame, and tumble."""
    rng = np.random.default_rng(7)
    parts = []
    for _ in range(14):
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        start = way * rng.uniform(0.4, 1.2)
        axis = tuple(rng.normal(size=3))
        mesh = ball(2, tuple(rng.uniform(0.1, 0.25, 3)), start)

        def moved(
            x: Array,
            frame: int,
            way: Array = way,
            start: Array = start,
            axis: tuple[float, float, float] = axis,
        ) -> Array:
            return np.asarray(turned(axis, 0.15 * frame, x, start) + 0.25 * frame * way)

        parts.append(Part(mesh, moved))
    return parts


@cache
def frames_of(scene: Callable[[], list[Part]]) -> tuple[NDArray[np.int64], Array, Array]:
    """As `joined` makes them."""
    return joined(scene(), FRAMES)


Kept = Callable[[int, Array, Array], NDArray[np.bool_]]
"""Which points are passed on of a frame, by its number and its vertices."""


def followed(
    tracker: Tracker, faces: NDArray[np.int64], frames: Array, cameras: int, kept: Kept | None
) -> Iterator[tuple[Array, Array]]:
    """The tracked and the true vertices of each frame but the first."""
    box = np.stack([frames.min(axis=(0, 1)), frames.max(axis=(0, 1))])
    around = losses.orbit(box, cameras, distance=6.0)(0)
    scans = losses.scan_points(frames[1:], faces, around, points=12_000, noise=0.05)
    for number, (truth, scan) in enumerate(zip(frames[1:], scans, strict=True)):
        passed = slice(None) if kept is None else kept(number, scan.points, truth)
        normals = np.asarray(scan.normals)[passed]
        yield tracker.push(scan.points[passed], normals, viewpoints=scan.viewpoints), truth


def tracked(
    faces: NDArray[np.int64],
    frames: Array,
    cameras: int,
    kept: Kept | None = None,
    qualities: tuple[str, ...] = ("good",),
) -> Array:
    """The error of each vertex in each frame but the first, in mean edges.

    The frames may be called these qualities.
    """
    tracker = Tracker(faces, frames[0])
    errors = []
    for found, truth in followed(tracker, faces, frames, cameras, kept):
        assert tracker.report.quality in qualities, tracker.report.reason
        errors.append(np.linalg.norm(found - truth, axis=1))
    return np.array(errors) / edge(Mesh(faces, frames[0]))


@pytest.mark.parametrize(
    ("scene", "cameras", "mean", "of_a_part"),
    [
        (bodies_that_part, 4, 0.1, 0.15),
        (bodies_that_part, 1, 0.2, 0.3),
        (chain_of_links, 4, 0.15, 0.3),
        (chain_of_links, 1, 0.3, 0.6),
        (small_parts_beside_a_limb, 4, 0.2, 0.5),
        (head_with_a_cap, 4, 0.07, 0.1),
        (body_in_a_shirt, 4, 0.2, 0.3),
        (pieces_that_fly_apart, 4, 0.25, 0.6),
    ],
)
def test_parts_are_let_go_where_they_move_apart_and_kept_where_not(
    scene: Callable[[], list[Part]], cameras: int, mean: float, of_a_part: float
) -> None:
    faces, frames, labels = frames_of(scene)
    errors = tracked(faces, frames, cameras)
    assert errors.mean() < mean
    last = [errors[-1, labels == part].mean() for part in range(labels.max() + 1)]
    assert max(last) < of_a_part


def test_a_part_that_left_between_two_frames_is_found() -> None:
    """A body that has parted from the others, and then jumps by five times its size."""
    faces, frames, labels = frames_of(bodies_that_part)
    frames = frames.copy()
    frames[6:, labels == 0] += np.array([4.0, 1.0, 0.5])
    errors = tracked(faces, frames, 4)
    assert errors[:, labels == 0].mean(axis=1).max() < 0.3


@pytest.mark.parametrize("resolution", ["best", 1500])
def test_a_part_without_points_is_told_to_be_lost(resolution: Resolution) -> None:
    """A body that has parted from the others, and then is measured no more, stays and is named."""
    faces, frames, labels = frames_of(bodies_that_part)
    tracker = Tracker(faces, frames[0], resolution=resolution)

    def kept(number: int, points: Array, truth: Array) -> NDArray[np.bool_]:
        of_last = labels[cKDTree(truth).query(points)[1]] == 3
        return np.asarray(~of_last | (number < 4))

    for number, _ in enumerate(followed(tracker, faces, frames, 4, kept)):
        if number < 4:
            assert (tracker.report.quality, tracker.report.lost) == ("good", -1)
            continue
        assert tracker.report.quality == "doubtful"
        assert labels[int(tracker.report.lost)] == 3
        assert f"vertex {int(tracker.report.lost)} " in tracker.report.reason
        assert not tracker.observed[labels == 3].any()


THICKNESS = 0.36  # of the plate, in mean edges of its upper side


def thin_plate() -> list[Part]:
    """A curved plate with two sides, which waves."""
    n = 45
    grid = np.linspace(-1, 1, n)
    x, y = (a.ravel() for a in np.meshgrid(grid, grid, indexing="ij"))
    upper = np.column_stack([x, y, 0.3 * np.sin(2.2 * x + 0.4) * np.cos(1.7 * y)])
    corners = np.arange(n * n).reshape(n, n)
    a, b = corners[:-1, :-1].ravel(), corners[1:, :-1].ravel()
    c, d = corners[1:, 1:].ravel(), corners[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    lower = upper - [0, 0, THICKNESS * edge(Mesh(faces, upper))]
    sides = {(s[i], s[(i + 1) % 3]) for s in faces.tolist() for i in range(3)}
    start, end = np.array([side for side in sorted(sides) if side[::-1] not in sides]).T
    wall = [
        np.stack([end, start, start + n * n], 1),
        np.stack([end, start + n * n, end + n * n], 1),
    ]
    faces = np.concatenate([faces, faces[:, ::-1] + n * n, *wall])

    def moved(x: Array, frame: int) -> Array:
        wave = 0.12 * np.sin(0.3 * frame) * np.sin(2 * x[:, 0])
        x = x + np.stack([0 * wave, 0 * wave, wave], axis=1)
        x = turned((1, 0.5, 0), 0.02 * frame, x, np.zeros(3))
        return np.asarray(x + frame * np.array([0.03, 0, 0.02]))

    return [Part(Mesh(faces, np.concatenate([upper, lower])), moved)]


def test_a_thin_plate_keeps_its_thickness() -> None:
    """Only its upper side is seen, by cameras whose noise is a seventh of its thickness."""
    faces, frames, _ = frames_of(thin_plate)
    k = frames.shape[1] // 2
    mean_edge = edge(Mesh(faces[faces.max(axis=1) < k], frames[0, :k]))
    for found, _ in followed(Tracker(faces, frames[0]), faces, frames, 4, None):
        through = np.linalg.norm(found[:k] - found[k:], axis=1) / mean_edge
        assert np.quantile(abs(through - THICKNESS), 0.9) < 0.1 * THICKNESS


@pytest.mark.parametrize("share", [0.1, 0.02, 0.005, 0])
def test_few_points_of_a_part_carry_no_other_away(share: float) -> None:
    """However few points of the cap are measured, the head stays where its own points are."""
    faces, frames, labels = frames_of(head_with_a_cap)
    rng = np.random.default_rng(1)

    def kept(_: int, points: Array, truth: Array) -> NDArray[np.bool_]:
        of_cap = labels[cKDTree(truth).query(points)[1]] == 1
        return np.asarray(~of_cap | (rng.random(len(points)) < share))

    # In between, it depends on how the few points are spread whether the cap counts as seen.
    qualities = {0.1: ("good",), 0: ("doubtful",)}.get(share, ("good", "doubtful"))
    errors = tracked(faces, frames, 4, kept, qualities)
    assert errors[:, labels == 0].mean() < 0.15
    assert errors[:, labels == 1].mean() < 0.25


@pytest.mark.parametrize(("cameras", "mean"), [(4, 0.09), (1, 0.3)])
def test_the_parts_of_a_beetle_follow_each_other(cameras: int, mean: float) -> None:
    beetle = dynmesh.synth.beetle().vertices[:FRAMES].astype(np.float64)
    faces = dynmesh.synth.beetle(1).faces.astype(np.int64)
    assert tracked(faces, beetle, cameras).mean() < mean


def test_a_fast_leg_of_few_points_is_followed() -> None:
    """Between two of these frames, the end of a leg moves eight edges, farther than it is long."""
    beetle = dynmesh.synth.sequence("beetle", frames=9)
    frames = beetle.vertices[::4].astype(np.float64)
    box = np.stack([frames.min(axis=(0, 1)), frames.max(axis=(0, 1))])
    around = losses.orbit(box, 4, up=(0, 0, 1))(0)
    _, *scans = losses.scan_points(frames, beetle.faces, around, points=5000)
    tracker = Tracker(beetle.faces, frames[0])
    for truth, scan in zip(frames[1:], scans, strict=True):
        found = tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
        errors = np.linalg.norm(found - truth, axis=1)
        assert errors.mean() < 0.35 * edge(Mesh(beetle.faces.astype(np.int64), frames[0]))


def test_what_was_learned_of_parts_is_in_the_state() -> None:
    """A restored tracker goes on as the original does, also from bodies that have parted."""
    faces, frames, _ = frames_of(bodies_that_part)
    scans = list(losses.scan_points(frames[1:], faces, 2, points=6000, noise=0.05))
    tracker = Tracker(faces, frames[0])
    for scan in scans[:4]:
        tracker.push(scan.points, scan.normals)
    other = Tracker(faces, frames[0])
    other.push(scans[0].points, scans[0].normals)
    other.restore(tracker.state())
    for scan in scans[4:]:
        expected = tracker.push(scan.points, scan.normals)
        np.testing.assert_array_equal(other.push(scan.points, scan.normals), expected)
    assert other.state() == tracker.state()


def test_states_of_another_first_frame_are_restored() -> None:
    """Other parts are near each other in it, so that other pairs of parts are tied."""
    faces, frames, labels = frames_of(pieces_that_fly_apart)
    other = frames[0].copy()
    for part in range(labels.max() + 1):
        other[labels == part] += np.random.default_rng(part).normal(size=3)
    tracker = Tracker(faces, frames[0])
    size = len(tracker.state())
    tracker.reset(other)
    scan = next(iter(losses.scan_points(other[None], faces, 4, points=8000, noise=0.05)))
    tracker.push(scan.points, scan.normals)
    state = tracker.state()
    assert len(state) == size
    again = Tracker(faces, frames[0])
    again.restore(state)
    assert again.state() == state
