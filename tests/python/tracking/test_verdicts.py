"""Whether what is called good is good: wrong results, each with a right one beside it."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pytest
from meshes import Array
from scans_of_meshes import TORUS, bent, edge, error, person, scan
from scipy.spatial.transform import Rotation

import dynmesh
from dynmesh import _core
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
    "many normals wrong": Situation(False, scanned=lambda one: with_turned_normals(0.5, one)),
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
        ([0.0] * 3, [0.02, 0.02, 0.055], ()),
        ([0.0] * 3, [0.02, 0.02, 0.065], ("2",)),
        ([0.0] * 3, [1e-9, 1e-9, 0.009], ()),
        ([0.0] * 3, [1e-9, 1e-9, 0.011], ("2",)),
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
