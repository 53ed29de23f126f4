"""Whether what is called good is good: wrong results, each with a right one beside it."""

from collections.abc import Callable, Iterator, Mapping
from itertools import chain, repeat
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pytest
import trimesh
from meshes import Array, Mesh
from scans_of_meshes import TORUS, bent, edge, error, person, scan, scan_of
from scipy.spatial.transform import Rotation

import dynmesh
from dynmesh import _core, losses
from dynmesh.tracking.quality import Counts, Fits

MESH, _ = person()
MIDDLE = MESH.vertices.mean(axis=0)

Scan = tuple[Array, Array | None]


def around_itself(degrees: float, points: Array, axis: str = "z") -> Array:
    """Turns points about an axis through the middle, the vertical one unless another is named."""
    turn = Rotation.from_euler(axis, degrees, degrees=True)
    return np.asarray(turn.apply(points - MIDDLE) + MIDDLE)


def next_step() -> Array:
    """The person a moment later, where it stands."""
    other = dynmesh.synth.walker(60).vertices[2].astype(np.float64)
    return np.asarray(other - other.mean(axis=0) + MIDDLE)


def with_turned_normals(share: float, measured: Scan) -> Scan:
    """Lets the normals of a share of the points face anywhere."""
    points, normals = measured
    assert normals is not None
    rng = np.random.default_rng(1)
    wrong = rng.random(len(points)) < share
    anywhere = rng.normal(size=normals.shape)
    return points, np.where(wrong[:, None], anywhere, normals)


class Situation(NamedTuple):
    """A template in the scans of a body that stands, and whether it fits."""

    is_right: bool
    template: Callable[[Array], Array] = lambda points: points
    scanned: Callable[[Scan], Scan] = lambda measured: measured


SITUATIONS = {
    "in place": Situation(True),
    "turned a little": Situation(True, lambda points: around_itself(20, points)),
    "turned in place": Situation(False, lambda points: around_itself(100, points)),
    "front to back": Situation(False, lambda points: around_itself(180, points)),
    "a moment later": Situation(True, lambda _: next_step()),
    "no normals": Situation(True, scanned=lambda measured: (measured[0], None)),
    "a little larger": Situation(True, lambda points: 1.03 * (points - MIDDLE) + MIDDLE),
    "larger": Situation(False, lambda points: 1.1 * (points - MIDDLE) + MIDDLE),
    "smaller": Situation(False, lambda points: 0.9 * (points - MIDDLE) + MIDDLE),
    "lying": Situation(False, lambda points: around_itself(180, points, "y")),
    "beside": Situation(True, lambda points: points + 3 * edge(MESH)),
    "another order": Situation(False, lambda points: np.roll(points, 50, axis=0)),
    "another unit": Situation(False, lambda points: 1000 * points),
    "another size": Situation(False, lambda points: 1.3 * (points - MIDDLE) + MIDDLE),
    "some normals wrong": Situation(True, scanned=lambda one: with_turned_normals(0.1, one)),
    "many normals wrong": Situation(True, scanned=lambda one: with_turned_normals(0.5, one)),
    "hardly a point": Situation(False, scanned=lambda one: (one[0][:2], None)),
}


@pytest.mark.parametrize("name", SITUATIONS)
def test_a_frame_is_good_if_it_is_right(name: str, rng: np.random.Generator) -> None:
    is_right, template, scanned = SITUATIONS[name]
    tracker = dynmesh.Tracker(MESH.faces, template(MESH.vertices))
    for _ in range(2):
        tracked = tracker.push(*scanned(scan(MESH, MESH.vertices, rng)))
    report = tracker.report
    assert (report.quality == "good") == is_right, report
    assert (report.reason == "") == is_right
    if is_right:
        assert error(MESH, MESH.vertices, tracked) < 0.5


N_POINTS = 4000


class Moment(NamedTuple):
    """A frame: where the subject is, and what is given to a tracker.

    Attributes:
        truth: (k, 3), in the mean edges of the template.
        scan: the arguments of Tracker.push.
        images: those of Tracker.push_depth, instead.
    """

    truth: Array
    scan: tuple[Any, ...] = ()
    viewpoints: Array | None = None
    images: tuple[Any, ...] = ()

    def pushed(self, tracker: dynmesh.Tracker) -> Array:
        if self.images:
            return np.asarray(tracker.push_depth(*self.images))
        return np.asarray(tracker.push(*self.scan, viewpoints=self.viewpoints))


LOBES = np.array(
    [
        [0, 0, 1, 1.6, 14],
        [0.95, 0, 0.3, 1.9, 30],
        [-0.95, 0, 0.2, 1.8, 30],
        [0.35, 0, -0.95, 2.4, 25],
        [-0.35, 0, -0.95, 2.4, 25],
        [0, 0.35, 1, 0.5, 80],
        [0.3, 0.3, -0.9, 0.9, 90],
        [-0.3, 0.3, -0.9, 0.9, 90],
    ]
)
"""Directions, heights and sharpness of a head, arms, legs, a nose and feet."""


def figure(n: int) -> tuple[Array, Array]:
    """Faces and frames of a ball with limbs, whose arms swing and whose back is like its front."""
    ball = trimesh.creation.icosphere(4)
    rays = np.asarray(ball.vertices)
    ends = LOBES[:, :3] / np.linalg.norm(LOBES[:, :3], axis=1)[:, None]
    heights = LOBES[:, 3] * np.exp(LOBES[:, 4] * (rays @ ends.T - 1))
    x, y, z = (rays * (1 + heights.sum(axis=1))[:, None]).T
    swings = (0.3 * np.sin(0.35 * step) * np.tanh(x) for step in range(n))
    frames = [(x, np.cos(a) * y - np.sin(a) * z, np.sin(a) * y + np.cos(a) * z) for a in swings]
    return np.asarray(ball.faces, np.int64), np.stack(frames).transpose(0, 2, 1)


class Subject:
    """A mesh in units of its mean edge, and the frames in which it moves."""

    def __init__(self, name: str, n: int = 12) -> None:
        if name == "torus":
            self.faces, frames = TORUS.faces, np.stack([TORUS.vertices] * n)
        elif name == "figure":
            self.faces, frames = figure(n)
        else:
            made = dynmesh.synth.sequence(name)  # type: ignore[arg-type]
            self.faces = made.faces.astype(np.int64)
            frames = made.vertices[:n].astype(np.float64)
        self.mesh = Mesh(self.faces, frames[0])
        self.frames = frames / edge(self.mesh)
        self.mesh = Mesh(self.faces, self.frames[0])
        self.size = float(np.ptp(self.frames[0], axis=0).max())


def turned(degrees: float, points: Array, axis: str = "z") -> Array:
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    turn = Rotation.from_euler(axis, degrees, degrees=True)
    return np.asarray(turn.apply(points - middle) + middle)


def measured(subject: Subject, truth: Array, rng: np.random.Generator, n: int = N_POINTS) -> Moment:
    """Points on all sides, with normals."""
    return Moment(truth, scan_of(Mesh(subject.faces, truth), truth, n, rng, noise=0.05))


def among(moment: Moment, points: Array, normals: Array) -> Moment:
    """The same moment, with points of something else."""
    ours, directions = moment.scan
    both = np.concatenate([ours, points]), np.concatenate([directions, normals])
    return moment._replace(scan=both)


def plane(middle: Array, size: float, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """The top of a table."""
    points = middle + size * rng.uniform(-1, 1, (n, 3)) * [1, 1, 0]
    return points, np.tile([0.0, 0, 1], (n, 1))


def garbage(_: Subject, truth: Array, rng: np.random.Generator) -> Moment:
    """Points anywhere around the subject."""
    low, high = truth.min(axis=0), truth.max(axis=0)
    spare = 0.2 * (high - low)
    return Moment(truth, (rng.uniform(low - spare, high + spare, (N_POINTS, 3)), None))


Moments = Iterator[Moment]
Made = Callable[[Subject, np.random.Generator], Moments]


def moving(subject: Subject, rng: np.random.Generator) -> Moments:
    for truth in subject.frames[1:]:
        yield measured(subject, truth, rng)


def hurrying(times: int, subject: Subject, rng: np.random.Generator) -> Moments:
    """After three frames, the subject moves so many times as fast."""
    for truth in chain(subject.frames[1:4], subject.frames[3 + times :: times]):
        yield measured(subject, truth, rng)


def turning(degrees: float, subject: Subject, rng: np.random.Generator) -> Moments:
    """After two frames, the subject has turned in place."""
    for n, truth in enumerate(subject.frames[1:]):
        yield measured(subject, truth if n < 2 else turned(degrees, truth), rng)


def spoiled(subject: Subject, rng: np.random.Generator, every: int = 1) -> Moments:
    """Frames 2 to 5 are garbage."""
    frames = subject.frames[::every]
    for n, truth in enumerate(chain(frames[1:], repeat(frames[-1], 8))):
        yield (garbage if 2 <= n < 6 else measured)(subject, truth, rng)


def growing(sizes: list[float], subject: Subject, rng: np.random.Generator) -> Moments:
    middle = subject.frames[0].mean(axis=0)
    for size in sizes:
        yield measured(subject, size * (subject.frames[0] - middle) + middle, rng)


def beside_a_chest(degrees: float, subject: Subject, rng: np.random.Generator) -> Moments:
    aside = 1.2 * subject.size * np.array([1, 0, 0])
    for moment in turning(degrees, subject, rng):
        yield among(moment, *plane(moment.truth.mean(axis=0) + aside, subject.size / 3, 3000, rng))


def on_a_table(share: float, subject: Subject, rng: np.random.Generator) -> Moments:
    """A table that touches the subject has this share of all points."""
    n = round(4000 * share / (1 - share))
    for moment in moving(subject, rng):
        below = moment.truth.mean(axis=0)
        below[2] = moment.truth[:, 2].min()
        yield among(moment, *plane(below, 0.7 * subject.size, n, rng))


def on_another(subject: Subject, rng: np.random.Generator) -> Moments:
    """Another one of them, in another pose, touches it."""
    for moment in moving(subject, rng):
        other = turned(70, subject.frames[-1])
        other[:, 0] += moment.truth[:, 0].max() - other[:, 0].min() - 1
        yield among(moment, *measured(subject, other, rng, 2500).scan)


def with_depth(
    subject: Subject, _: Any, *, cameras: int = 1, noise: float = 0.0, degrees: float = 0.0
) -> Moments:
    orbit: Any = {"degrees_per_frame": 23, "elevation": 22, "distance": 1.5}
    around = losses.orbit(subject.frames[0], cameras, **orbit)(1)
    truths = [turned(degrees if n > 2 else 0, frame) for n, frame in enumerate(subject.frames)]
    options: Any = {"noise": noise, "width": 120, "height": 120}
    images = losses.depth_images(truths, subject.faces, around, **options)
    for truth, seen in list(zip(truths, images, strict=True))[1:]:
        yield Moment(truth, images=seen)


def from_one_side(tells: bool, subject: Subject, rng: np.random.Generator) -> Moments:
    """Points that face one sensor, of which the tracker is told or not."""
    sensor = np.array([[0.0, -3 * subject.size, 0]])
    for moment in moving(subject, rng):
        seen = seen_by(sensor, moment.scan)
        yield moment._replace(scan=seen, viewpoints=sensor if tells else None)


def behind_a_board(subject: Subject, rng: np.random.Generator) -> Moments:
    """From frame 2 on, a board hides the upper half from the only sensor."""
    sensor = np.array([[0.0, -3 * subject.size, 0]])
    for n, moment in enumerate(moving(subject, rng)):
        points, normals = seen_by(sensor, moment.scan)
        assert normals is not None
        middle = moment.truth.mean(axis=0)
        board = np.array([middle[0], moment.truth[:, 1].min() - 15, middle[2]])
        share = (board - sensor)[:, 1] / (points - sensor)[:, 1]
        at_board = sensor + share[:, None] * (points - sensor)
        kept = at_board[:, 2] < board[2] if n >= 2 else np.ones(len(points), bool)
        seen = moment._replace(scan=(points[kept], normals[kept]), viewpoints=sensor)
        of_board = board + subject.size * rng.uniform([-1, 0, 0], [1, 0, 1], (3000, 3))
        yield among(seen, of_board, np.tile([0.0, -1, 0], (3000, 1))) if n >= 2 else seen


def without(share: float, subject: Subject, rng: np.random.Generator) -> Moments:
    """Of the highest part of the subject, this share of all points, nothing is measured."""
    sensors = 4 * subject.size * np.array([[1.0, 0, 0.5], [-1, 1, 0.5], [-1, -1, 0.5]])
    for moment in moving(subject, rng):
        points, normals = moment.scan
        kept = points[:, 2] < np.quantile(points[:, 2], 1 - share)
        yield moment._replace(scan=(points[kept], normals[kept]), viewpoints=sensors)


def with_normals(change: Callable[[Array], Array | None], subject: Subject, rng: Any) -> Moments:
    for moment in moving(subject, rng):
        points, normals = moment.scan
        yield moment._replace(scan=(points, change(normals)))


def sparse(n: int, subject: Subject, rng: np.random.Generator) -> Moments:
    for truth in subject.frames[1:]:
        yield measured(subject, truth, rng, n)


def leaving(subject: Subject, rng: np.random.Generator) -> Moments:
    """In frames 2 and 3, only a table is there."""
    for n, moment in enumerate(on_a_table(0.3, subject, rng)):
        points, normals = moment.scan
        gone = n in {2, 3}
        yield moment._replace(scan=(points[4000:], normals[4000:])) if gone else moment


def anywhere(normals: Array) -> Array:
    return np.asarray(np.random.default_rng(2).normal(size=normals.shape))


class Story(NamedTuple):
    """What happens to a subject, and how it is judged.

    Attributes:
        verdicts: of each frame: "g" if it is right and must be good, "n" if it must not be, "." if
            either will do. The last one holds for all later ones.
        n: the number of frames.
    """

    subject: str
    moments: Made
    verdicts: str
    n: int = 5
    recover: bool = False


def part(function: Callable[..., Moments], *args: Any, **options: Any) -> Made:
    return lambda subject, rng: function(*args, subject, rng, **options)


STORIES = {
    "a hand": Story("hand", moving, "g"),
    "a head": Story("bust", moving, "g"),
    "a beetle of many parts": Story("beetle", moving, "g"),
    "a head turns by 10 degrees": Story("bust", part(turning, 10), "g"),
    "a hand moves six times as fast": Story("hand", part(hurrying, 6), "g", 6),
    "a heart beats three times as fast": Story("heart", part(hurrying, 3), "g", 7),
    "a head turns too fast": Story("bust", part(hurrying, 9), "gggn", 5),
    "a head turns by 120 degrees": Story("bust", part(turning, 120), "ggn"),
    "a head turns by 180 degrees": Story("bust", part(turning, 180), "ggn"),
    "a head turns by 180 degrees and is found": Story(
        "bust", part(turning, 180), "gg.g", recover=True
    ),
    "a hand turns by 150 degrees": Story("hand", part(turning, 150), "ggn"),
    "a figure turns by 120 degrees": Story("figure", part(turning, 120), "ggn", 10),
    "a figure turns by 120 degrees and is found": Story(
        "figure", part(turning, 120), "gg.g", 10, recover=True
    ),
    "a torus turns by 180 degrees": Story("torus", part(turning, 180), "ggn", 9),
    "a torus turns and is found": Story("torus", part(turning, 180), "gg.g", 9, recover=True),
    "a beetle turns by 40 degrees": Story("beetle", part(turning, 40), "ggn"),
    "a beetle turns by 150 degrees and is found": Story(
        "beetle", part(turning, 150), "gg.g", recover=True
    ),
    "garbage": Story("hand", spoiled, "ggnnnn.", 10),
    "garbage, and found again": Story("hand", spoiled, "ggnnnn.g", 10, recover=True),
    "it moves on during garbage": Story(
        "hand", part(spoiled, every=2), "ggnnnn.g", 13, recover=True
    ),
    "garbage around a torus": Story("torus", spoiled, "ggnnnn......", 12),
    "garbage around a torus, and found again": Story(
        "torus", spoiled, "ggnnnn.g", 10, recover=True
    ),
    "grows slowly to 1.3": Story("torus", part(growing, [1.015**n for n in range(19)]), "g", 19),
    "a hand grows slowly": Story("hand", part(growing, [1.02**n for n in range(8)]), "g", 8),
    "another unit": Story("torus", part(growing, [1.0, 1, 1.3, 1.3, 1.3]), "ggn"),
    "another unit for a frame": Story("torus", part(growing, [1.0, 1, 1.3, 1, 1]), "ggn.g"),
    "a chest beside it": Story("hand", part(beside_a_chest, 0), "g"),
    "a chest beside it, turned": Story("hand", part(beside_a_chest, 150), "ggn"),
    "a table of 8 %": Story("hand", part(on_a_table, 0.08), "g"),
    "a table of 40 %": Story("bust", part(on_a_table, 0.4), "g"),
    "a second one touches it": Story("hand", on_another, "g"),
    "gone, and there again": Story("hand", leaving, "ggnn.g", 7),
    "noise of half an edge": Story("hand", part(with_depth, cameras=2, noise=0.5), "g"),
    "noise of a third of an edge": Story("bust", part(with_depth, cameras=3, noise=0.35), "g"),
    "noise, and turned": Story("bust", part(with_depth, cameras=3, noise=0.35, degrees=150), "ggn"),
    "one camera": Story("bust", with_depth, "g"),
    "four cameras around many parts": Story("beetle", part(with_depth, cameras=4), "g"),
    "one side": Story("bust", part(from_one_side, True), "g"),
    "one side, from anywhere": Story("bust", part(from_one_side, False), "ggg."),
    "a board before it": Story("bust", behind_a_board, "g", 4),
    "a little not measured": Story("hand", part(without, 0.04), "g"),
    "a limb not measured": Story("hand", part(without, 0.3), ".n"),
    "no normals": Story("hand", part(with_normals, lambda _: None), "g"),
    "no use of normals": Story("hand", part(with_normals, anywhere), "g"),
    "inside out": Story("hand", part(with_normals, lambda normals: -normals), "n"),
    "few points": Story("hand", part(sparse, 600), "g"),
}


@pytest.mark.parametrize("name", STORIES)
def test_frames_are_judged_and_healed(name: str, rng: np.random.Generator) -> None:
    story = STORIES[name]
    subject = Subject(story.subject, 24)
    tracker = dynmesh.Tracker(subject.faces, subject.frames[0], recover=story.recover)
    told = []
    for n, moment in zip(range(story.n), story.moments(subject, rng), strict=False):
        tracked = moment.pushed(tracker)
        off = float(np.linalg.norm(tracked - moment.truth, axis=1).mean())
        told.append((tracker.report.quality, round(off, 2), tracker.report.reason))
        verdict = story.verdicts[min(n, len(story.verdicts) - 1)]
        if verdict == "g":
            assert tracker.report.quality == "good", (n, told, tracker.report)
            assert off < 0.8, (n, told)
        elif verdict == "n" or off > 0.8:
            assert tracker.report.quality != "good", (n, told, tracker.report)


def test_of_sheets_both_sides_may_be_measured(rng: np.random.Generator) -> None:
    """The story is of cloth whose edges change as far as those of a pose that was lost."""
    subject = Subject("cloth", 20)
    trackers = [dynmesh.Tracker(subject.faces, subject.frames[0]) for _ in range(2)]
    for truth in subject.frames[::2]:
        points, normals = measured(subject, truth, rng).scan
        found = [
            (tracker.push(points, side * normals), tracker.report.quality)
            for tracker, side in zip(trackers, (1, -1), strict=True)
        ]
        np.testing.assert_array_equal(found[0][0], found[1][0])
        assert found[0][1] == found[1][1] == "good"


@pytest.mark.parametrize(
    ("axis", "degrees", "lies_there"),
    [
        ("z", 0, True),
        ("z", 20, True),
        ("z", 60, False),
        ("z", 100, False),
        ("z", 180, False),
        ("x", 10, True),
        ("x", 180, False),
        ("y", 180, False),
    ],
)
def test_a_template_that_is_turned_in_place_does_not_lie_in_the_scan(
    axis: str, degrees: float, lies_there: bool, rng: np.random.Generator
) -> None:
    points, _ = scan(MESH, MESH.vertices, rng)
    template = around_itself(degrees, MESH.vertices, axis)
    found = dynmesh.alignment.find_alignment(MESH.faces, template, points)
    assert found.before < 5
    assert found.lies_in_scan == lies_there
    assert found.matches
    moved = template @ found.rotation.T + found.shift
    assert error(MESH, MESH.vertices, moved) < 0.1 or lies_there


SHAPE = bent(TORUS.vertices, 0.3)
"""A body that a template of another shape is registered with."""
SENSOR = np.array([[0.0, -30, 0]])
MARKED = np.arange(0, 576, 100)


def seen_by(sensor: Array, measured: Scan) -> Scan:
    """Leaves the points that face a sensor."""
    points, normals = measured
    assert normals is not None
    kept = (normals * (sensor - points)).sum(axis=1) > 0
    return points[kept], normals[kept]


def without_most(share: float, measured: Scan) -> Scan:
    """Leaves out the share of the points with the largest x."""
    points, normals = measured
    assert normals is not None
    kept = points[:, 0] < np.quantile(points[:, 0], 1 - share)
    return points[kept], normals[kept]


def with_floor(measured: Scan) -> Scan:
    """Adds a floor three times as wide as the body."""
    points, _ = measured
    wide = np.ptp(points, axis=0).max() * np.array([1, 1, 0])
    floor = np.random.default_rng(2).uniform(-1.5, 1.5, points.shape) * wide
    floor += np.array([0, 0, points[:, 2].min()])
    return np.concatenate([points, floor]), None


def flattened(measured: Scan) -> Scan:
    """Squeezes the body, into which the template can be squeezed."""
    points, normals = measured
    assert normals is not None
    across = normals / np.array([1, 0.4, 1])
    return points * [1, 0.4, 1], across / np.linalg.norm(across, axis=1, keepdims=True)


class Registered(NamedTuple):
    """What is registered with a scan of the shape, and how, and whether it fits."""

    is_right: bool
    template: Callable[[Array], Array] = lambda points: points
    scanned: Callable[[Scan], Scan] = lambda measured: measured
    options: Mapping[str, Any] = MappingProxyType({})


REGISTERED = {
    "as it is": Registered(True),
    "elsewhere": Registered(True, lambda points: np.roll(points, 1, axis=1) + 50),
    "no normals": Registered(True, scanned=lambda one: (one[0], None)),
    "a little larger": Registered(True, lambda points: 1.1 * points),
    "half as large again": Registered(False, lambda points: 1.5 * points),
    "of any size": Registered(True, lambda points: 1.5 * points, options={"scale": True}),
    "a tenth missing": Registered(False, scanned=lambda one: without_most(0.1, one)),
    "half of it": Registered(False, scanned=lambda one: without_most(0.5, one)),
    "one side": Registered(False, scanned=lambda one: seen_by(SENSOR, one)),
    "one side, as the sensor sees it": Registered(
        True, scanned=lambda one: seen_by(SENSOR, one), options={"viewpoints": SENSOR}
    ),
    "landmarks": Registered(True, options={"landmarks": (MARKED, SHAPE[MARKED])}),
    "landmarks of others": Registered(False, options={"landmarks": (MARKED, SHAPE[MARKED[::-1]])}),
    "on a floor": Registered(True, scanned=with_floor),
    "flattened": Registered(False, scanned=flattened, options={"align": False}),
    "a ball": Registered(
        False, scanned=lambda one: (3 * one[0] / np.linalg.norm(one[0], axis=1)[:, None], None)
    ),
}


@pytest.mark.parametrize("name", REGISTERED)
def test_a_registration_is_good_if_it_is_right(name: str, rng: np.random.Generator) -> None:
    is_right, template, scanned, options = REGISTERED[name]
    points, normals = scanned(scan(TORUS, SHAPE, rng))
    found = dynmesh.register(TORUS.faces, template(TORUS.vertices), points, normals, **options)
    assert (found.quality == "good") == is_right, found
    assert (found.reason == "") == is_right
    if is_right:
        assert error(TORUS, SHAPE, found.vertices) < 0.5


G, D, R = "good", "doubtful", "ruined"


@pytest.mark.parametrize(
    ("frames", "quality"),
    [
        ([], G),
        ([R], R),
        ([G, R], R),
        ([G, R, G], G),
        ([R, R, R], R),
        ([R] * 3 + [G] * 97, R),
        ([G] * 97 + [D, R, R], D),
        ([G] * 40 + [R, R] + [G] * 58, G),
        ([G, G, G, R] * 25, R),
        ([G, D] * 10, D),
    ],
)
def test_a_recording_is_as_good_as_its_worst_run(frames: list[str], quality: str) -> None:
    assert _core.quality_of_frames(frames) == quality


@pytest.mark.parametrize(
    ("shares", "distances", "suspects"),
    [
        ([0.0, 0.01, 0.06], [0.02] * 3, ("2",)),
        ([0.0, 0.01, 0.045], [0.02] * 3, ()),
        ([0.06, 0.06, 0.115], [0.02] * 3, ()),
        ([0.06, 0.06, 0.125], [0.02] * 3, ("2",)),
        ([0.0] * 3, [0.1, 0.12, 0.18], ()),  # a template that is not quite in place
        ([0.0] * 3, [0.02, 0.02, 0.28], ()),
        ([0.0] * 3, [0.02, 0.02, 0.35], ("2",)),
        ([0.0] * 3, [0.12, 0.12, 0.35], ()),
        ([1.0], [0.0], ()),
    ],
)
def test_a_camera_is_suspected_that_disagrees_more_than_the_others(
    shares: list[float], distances: list[float], suspects: tuple[str, ...]
) -> None:
    cameras = {
        str(n): Counts(100.0, 100 * far, 100 * (1 - far) * distance**2)
        for n, (far, distance) in enumerate(zip(shares, distances, strict=True))
    }
    assert Fits(cameras=cameras).suspects == suspects


@pytest.mark.parametrize(
    ("seen", "frame"),
    [
        ([0.65] * 50 + [0.25] * 9, 50),
        ([0.65] * 50 + [0.25] * 2 + [0.65] * 9, 61),
        ([0.65 - 0.001 * n for n in range(60)], 60),
        ([0.25] * 9 + [0.65] * 9, 18),
        ([0.5, 0.2], 2),
    ],
)
def test_sight_that_falls_is_noticed_from_its_first_frame(seen: list[float], frame: int) -> None:
    assert _core.falling_sight(seen) == frame
