"""Rooms: floors and walls that scans hold beside the subject, taken away."""

from pathlib import Path

import meshes
import numpy as np
import pytest
from commands import dynmesh_command as run
from meshes import Mesh
from scan_files import error, moving_body, room_around, scanned_in_a_room
from test_degrade_cameras import potato

import dynmesh
from dynmesh import degrade
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.diagnosis.planes import planes_of_room
from dynmesh.scans import PointScan, open_scans
from dynmesh.tracking.room import Room, crop_of

Array = meshes.Array


@pytest.fixture
def body() -> Mesh:
    return potato(np.random.default_rng(4))


TRUTH = moving_body(5, 0.02)
EDGE = mean_edge_of(TRUTH.vertices[0], TRUTH.faces)


@pytest.fixture(scope="module")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of scans of the same truth with a room, in points and depth images, and without.

    The points are so sparse that of 20 000, the subject has as many as without a room.
    """
    folder = tmp_path_factory.mktemp("rooms")
    dynmesh.write(folder / "truth.npz", TRUTH)
    dynmesh.write(folder / "body.obj", TRUTH[:1])
    scanned_in_a_room(TRUTH, folder / "inside")
    scanned_in_a_room(TRUTH, folder / "depth", (120, 90))
    run("degrade", folder / "truth.npz", folder / "alone", "--scan", "--points", "400")
    return folder


def largest_error(folder: Path, scans: str, *options: str, code: int = 0) -> float:
    words = ("track", folder / scans, folder / "tracked.npz", "--template", folder / "body.obj")
    run(*words, "--overwrite", *options, code=code)
    return float(error(dynmesh.read(folder / "tracked.npz"), TRUTH).max())


def test_a_subject_in_a_sparse_cloud_with_a_room_is_tracked_as_well_as_without(
    rooms: Path,
) -> None:
    (first, *_) = open_scans(rooms / "inside")
    assert isinstance(first, PointScan)
    near = np.linalg.norm(first.points - TRUTH.vertices[0].mean(axis=0), axis=1) < 1.5
    assert near.sum() < 0.05 * len(first.points)
    alone = largest_error(rooms, "alone")
    assert largest_error(rooms, "inside", "--remove-planes") < 1.3 * alone
    assert largest_error(rooms, "depth", "--remove-planes") < 0.5
    assert largest_error(rooms, "inside", "--crop", "0.3", "--remove-planes") < 1.3 * alone


def test_a_template_is_registered_with_a_scan_in_a_room(rooms: Path) -> None:
    """A box leaves out the floor as well, if it begins above."""
    template, scan = rooms / "body.obj", rooms / "inside"
    words = ("register", template, sorted(scan.glob("*.ply"))[0], rooms / "one.obj")
    run(*words, "--overwrite", code=3)
    low, high = TRUTH.vertices[0].min(axis=0), TRUTH.vertices[0].max(axis=0)
    above_the_floor = (-EDGE, -EDGE, 0.2 * EDGE)
    box = ",".join(str(x) for x in (*(low + above_the_floor), *(high + EDGE)))
    for options in (("--remove-planes",), ("--crop", box)):
        run(*words, "--overwrite", *options)
        found = dynmesh.read(rooms / "one.obj").vertices[0]
        distance = np.linalg.norm(found - TRUTH.vertices[0], axis=1).mean()
        assert distance < 0.2 * EDGE


def test_planes_of_a_room_are_found_and_a_flat_subject_is_kept(body: Mesh) -> None:
    room = room_around(body.vertices)
    k = len(body.vertices)
    frame = np.concatenate([body.vertices, room.vertices])
    faces = np.concatenate([body.faces, room.faces + k])
    cameras = degrade.orbit(body.vertices, 4)(0)
    (found,) = degrade.scan_points([frame], faces, cameras, points=5000, noise=0.03)
    size = float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
    edge = mean_edge_of(body.vertices, body.faces)
    planes = planes_of_room(found.points, thickness=edge, size=size)
    assert len(planes) == 2
    for plane, face in zip(planes, room.faces[[0, 2]], strict=True):
        heights = room.vertices[face] @ plane.normal - plane.offset
        np.testing.assert_allclose(heights, 0, atol=0.1 * edge)
    subject = found.only(~np.logical_or.reduce([p.holds(found.points) for p in planes]))
    assert 20 < len(subject.points) < 0.05 * len(found.points)
    sheet = np.random.default_rng(0).random((2000, 3)) * [1, 1, 0]
    assert planes_of_room(sheet, thickness=0.1, size=float(np.sqrt(2))) == []


def test_a_box_keeps_what_is_inside(rooms: Path) -> None:
    low, high = TRUTH.vertices.min(axis=(0, 1)), TRUTH.vertices.max(axis=(0, 1))
    corners = [*(low - 0.05), *(high + 0.05)]
    box = ",".join(f"{x:.6g}" for x in corners)
    # The floor in the box is far from the mesh.
    assert largest_error(rooms, "inside", "--crop", box, code=3) < 2 * largest_error(rooms, "alone")
    crop = crop_of(box)
    for scan in open_scans(rooms / "depth"):
        assert scan is not None
        left = Room(crop, False).without(scan).cloud
        smaller, larger = np.reshape(np.array(crop), (2, 3))
        inside = ((scan.cloud >= smaller) & (scan.cloud <= larger)).all(axis=1)
        assert len(left) == inside.sum() > 100
        np.testing.assert_array_equal(left, scan.cloud[inside])
