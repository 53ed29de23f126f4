"""Whether what is called good is good: wrong results, each with a right one beside it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from meshes import Array
from scans_of_meshes import error, person, scan
from scipy.spatial.transform import Rotation

import dynmesh
from dynmesh import _core

MESH, _ = person()
MIDDLE = MESH.vertices.mean(axis=0)

Scan = tuple[Array, Array | None]


def around_itself(degrees: float, points: Array) -> Array:
    """Turns points about the vertical axis through the middle."""
    turn = Rotation.from_euler("z", degrees, degrees=True)
    return np.asarray(turn.apply(points - MIDDLE) + MIDDLE)


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
    "no normals": Situation(True, scanned=lambda measured: (measured[0], None)),
    "a little larger": Situation(True, lambda points: 1.03 * (points - MIDDLE) + MIDDLE),
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


@pytest.mark.parametrize(("degrees", "lies_there"), [(0, True), (20, True), (100, False)])
def test_a_template_that_is_turned_in_place_does_not_lie_in_the_scan(
    degrees: float, lies_there: bool, rng: np.random.Generator
) -> None:
    points, _ = scan(MESH, MESH.vertices, rng)
    found = dynmesh.find_alignment(MESH.faces, around_itself(degrees, MESH.vertices), points)
    assert found.before < 5
    assert found.lies_in_scan == lies_there
    assert found.matches


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
