"""Rooms: floors and walls that scans hold beside the subject, taken away."""

from pathlib import Path
from typing import NamedTuple

import meshes
import numpy as np
import pytest
from commands import dynmesh_command as run
from meshes import Mesh, turned
from scan_files import room_around, scanned_in_a_room
from test_degrade_cameras import potato
from test_track import bumpy

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


class Rooms(NamedTuple):
    """Folders of scans with and without a room, of the same truth."""

    folder: Path
    truth: dynmesh.Sequence

    def errors(self, scans: str, *options: str, code: int = 0) -> Array:
        """The mean distance from the true vertex in each frame, in mean edges."""
        output, template = self.folder / "tracked.npz", self.folder / "body.obj"
        words = ("track", self.folder / scans, output, "--template", template, "--overwrite")
        run(*words, *options, code=code)
        found = dynmesh.read(output).vertices
        distances = np.linalg.norm(found - self.truth.vertices, axis=2).mean(axis=1)
        return np.asarray(distances / mean_edge_of(self.truth.vertices[0], self.truth.faces))


@pytest.fixture(scope="module")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> Rooms:
    """Sparse points: so many are left of 20 000 that the subject has as many as without a room."""
    folder = tmp_path_factory.mktemp("rooms")
    mesh = bumpy()
    frames = [turned(mesh.vertices, 0.02 * i) + 0.02 * i for i in range(5)]
    truth = dynmesh.Sequence(np.stack(frames), mesh.faces, up_axis="z")
    dynmesh.write(folder / "truth.npz", truth)
    dynmesh.write(folder / "body.obj", truth[:1])
    scanned_in_a_room(truth, folder / "inside")
    scanned_in_a_room(truth, folder / "depth", (120, 90))
    run("degrade", folder / "truth.npz", folder / "alone", "--scan", "--points", "400")
    return Rooms(folder, truth)


def test_a_subject_in_a_sparse_cloud_with_a_room_is_tracked_as_well_as_without(
    rooms: Rooms,
) -> None:
    (first, *_) = open_scans(rooms.folder / "inside")
    assert isinstance(first, PointScan)
    near = np.linalg.norm(first.points - rooms.truth.vertices[0].mean(axis=0), axis=1) < 1.5
    assert near.sum() < 0.05 * len(first.points)
    alone = rooms.errors("alone").max()
    assert rooms.errors("inside", "--remove-planes").max() < 1.3 * alone
    assert rooms.errors("depth", "--remove-planes").max() < 0.5
    assert rooms.errors("inside", "--crop", "0.3", "--remove-planes").max() < 1.3 * alone


def test_a_template_is_registered_with_a_scan_in_a_room(rooms: Rooms) -> None:
    """A box leaves out the floor as well, if it begins above."""
    template, scan = rooms.folder / "body.obj", rooms.folder / "inside"
    words = ("register", template, sorted(scan.glob("*.ply"))[0], rooms.folder / "one.obj")
    run(*words, "--overwrite", code=3)
    edge = mean_edge_of(rooms.truth.vertices[0], rooms.truth.faces)
    low, high = rooms.truth.vertices[0].min(axis=0), rooms.truth.vertices[0].max(axis=0)
    above_the_floor = (-edge, -edge, 0.2 * edge)
    box = ",".join(str(x) for x in (*(low + above_the_floor), *(high + edge)))
    for options in (("--remove-planes",), ("--crop", box)):
        run(*words, "--overwrite", *options)
        found = dynmesh.read(rooms.folder / "one.obj").vertices[0]
        distance = np.linalg.norm(found - rooms.truth.vertices[0], axis=1).mean()
        assert distance < 0.2 * edge


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


def test_a_box_keeps_what_is_inside(rooms: Rooms) -> None:
    low, high = rooms.truth.vertices.min(axis=(0, 1)), rooms.truth.vertices.max(axis=(0, 1))
    corners = [*(low - 0.05), *(high + 0.05)]
    box = ",".join(f"{x:.6g}" for x in corners)
    # The floor in the box is far from the mesh.
    assert rooms.errors("inside", "--crop", box, code=3).max() < 2 * rooms.errors("alone").max()
    crop = crop_of(box)
    for scan in open_scans(rooms.folder / "depth"):
        assert scan is not None
        left = Room(crop, False).without(scan).cloud
        smaller, larger = np.reshape(np.array(crop), (2, 3))
        inside = ((scan.cloud >= smaller) & (scan.cloud <= larger)).all(axis=1)
        assert len(left) == inside.sum() > 100
        np.testing.assert_array_equal(left, scan.cloud[inside])
