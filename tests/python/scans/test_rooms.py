"""Rooms around the subject of scans."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from commands import dynmesh_command as run
from meshes import potato, turned
from scan_files import error, moving_body, opened, room_around, scanned_in_a_room

import dynmesh
from dynmesh import losses
from dynmesh.scans import (
    read_cameras,
    write_cameras,
)
from dynmesh.topology import mean_edge_of
from dynmesh.tracking.background import (
    Background,
    crop_of,
    planes_of_background,
)

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
    (first, *_) = opened(rooms / "inside")
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
    low, high = TRUTH.vertices[0].min(axis=0), TRUTH.vertices[0].max(axis=0)
    above_the_floor = (-EDGE, -EDGE, 0.2 * EDGE)
    box = ",".join(str(x) for x in (*(low + above_the_floor), *(high + EDGE)))
    for options in ((), ("--remove-planes",), ("--crop", box)):
        said = run(*words, "--overwrite", *options).stderr
        assert "no plane was removed" not in said
        found = dynmesh.read(rooms / "one.obj").vertices[0]
        distance = np.linalg.norm(found - TRUTH.vertices[0], axis=1).mean()
        assert distance < 0.2 * EDGE
    alone = sorted((rooms / "alone").glob("*.ply"))[0]
    told = run("register", template, alone, rooms / "one.obj", "--overwrite", "--remove-planes")
    assert "no plane was removed" in told.stderr


@pytest.mark.parametrize("options", [(), ("--crop", "0.3")])
def test_right_cameras_fit_in_a_room(options: tuple[str, ...], rooms: Path, tmp_path: Path) -> None:
    words = ("rig", rooms / "depth", "--template", rooms / "body.obj")
    run(*words, *options)
    rig = read_cameras(rooms / "depth" / "cameras.json")
    wrong = (replace(c, camera_to_world=c.camera_to_world * [1, -1, -1, 1]) for c in rig.cameras)
    write_cameras(tmp_path / "wrong.json", replace(rig, cameras=tuple(wrong)))
    said = run(*words, *options, "--cameras", tmp_path / "wrong.json", code=3).stdout
    assert "the cameras have the axes of OpenGL" in said


def test_a_template_is_found_in_a_room_which_is_named(rooms: Path) -> None:
    """And not the size of the scan, which is that of the room."""
    away = replace(TRUTH[:1], vertices=turned(TRUTH.vertices[0], 2)[None] + 50)
    dynmesh.write(rooms / "away.obj", away)
    words = (rooms / "tracked.npz", "--template", rooms / "away.obj", "--overwrite")
    said = run("track", rooms / "inside", *words).stderr
    assert "--remove-planes or --crop leaves it out" in said
    assert "times as large" not in said
    distances = np.linalg.norm(
        dynmesh.read(rooms / "tracked.npz").vertices - TRUTH.vertices, axis=2
    )
    assert distances.mean() < 0.3 * EDGE
    said = run("track", rooms / "inside", *words, "--remove-planes").stderr
    assert "times as large" not in said


def test_planes_of_a_room_are_found_and_a_flat_subject_is_kept() -> None:
    body = potato(np.random.default_rng(4))
    room = room_around(body.vertices)
    k = len(body.vertices)
    frame = np.concatenate([body.vertices, room.vertices])
    faces = np.concatenate([body.faces, room.faces + k])
    cameras = losses.orbit(body.vertices, 4)(0)
    (found,) = losses.scan_points([frame], faces, cameras, points=5000, noise=0.03)
    size = float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
    edge = mean_edge_of(body.vertices, body.faces)
    planes = planes_of_background(found.points, thickness=edge, size=size)
    assert len(planes) == 2
    for plane, face in zip(planes, room.faces[[0, 2]], strict=True):
        heights = room.vertices[face] @ plane.normal - plane.offset
        np.testing.assert_allclose(heights, 0, atol=0.1 * edge)
    subject = found.only(~np.logical_or.reduce([p.holds(found.points) for p in planes]))
    assert 20 < len(subject.points) < 0.05 * len(found.points)
    sheet = np.random.default_rng(0).random((2000, 3)) * [1, 1, 0]
    assert planes_of_background(sheet, thickness=0.1, size=float(np.sqrt(2))) == []


def test_a_subject_in_a_line_with_other_things_is_no_plane_of_a_room() -> None:
    """Its slabs and those of a chest, or of a table that touches it, reach as far as a wall."""
    body = dynmesh.synth.walker()[:1]
    low, high = body.vertices.min(axis=(0, 1)), body.vertices.max(axis=(0, 1))
    floor = room_around(body.vertices[0]).faces[:2], room_around(body.vertices[0]).vertices[:4]
    chest, table = (
        trimesh.creation.box(bounds=low + np.array(corners))
        for corners in (
            [[-0.1, 0.9, 0.01], [0.5, 1.3, 0.5]],
            [[-0.2, high[1] - low[1] - 0.01, 0.9], [0.6, 1.2, 0.93]],
        )
    )
    for things in ([], [chest], [table]):
        parts = [(body.faces, body.vertices[0]), floor, *((t.faces, t.vertices) for t in things)]
        firsts = np.cumsum([0, *(len(points) for _, points in parts)])
        faces = np.concatenate([own + n for (own, _), n in zip(parts, firsts, strict=False)])
        points = np.concatenate([points for _, points in parts])
        (camera,) = losses.orbit(body.vertices[0], 1)(0)
        size: Any = {"width": 200, "height": 150, "noise": 0.1}
        (alone,) = losses.depth_images(body.vertices, body.faces, [camera], **size)
        (scan,) = losses.depth_images([points], faces, [camera], **size)
        left: Any = Background(None, True).enter(scan, body.faces, body.vertices[0])
        own = (alone.depth[0] > 0) & (np.abs(alone.depth[0] - scan.depth[0]) < 0.02)
        assert (left.depth[0] > 0)[own].mean() > 0.98
        away = np.count_nonzero(scan.depth[0]) - np.count_nonzero(left.depth[0])
        assert away > np.count_nonzero(own)  # the floor


def test_a_plane_is_thicker_where_depth_cameras_are_noisier() -> None:
    """Their noise grows with the square of the depth: 4 mm at 1.6 m, 30 mm at 4.3 m."""
    rng = np.random.default_rng(2)
    depths = 1 + 3.5 * rng.random(9000)
    floor = np.stack([2 * rng.random(9000) - 1, 2 - 0.8 * depths, depths], axis=1)
    body = 0.15 * rng.standard_normal((900, 3)) + [0, -0.6, 2.0]
    body = body[body @ [0, 1, 0.8] < 1.8]
    points = np.concatenate([floor, body])
    noise = 0.0012 + 0.0019 * (points[:, 2] - 0.4) ** 2
    points *= 1 + (noise * rng.standard_normal(len(points)) / points[:, 2])[:, None]
    depths = points[:, 2]
    (plane,) = planes_of_background(points, depths, thickness=0.016, size=1.8)
    held = plane.holds(points, depths)
    assert held[: len(floor)].mean() > 0.99
    assert held[len(floor) :].mean() < 0.01
    thin, *_ = planes_of_background(points, thickness=0.016, size=1.8)
    assert thin.holds(points)[: len(floor)].mean() < 0.97


def test_a_box_keeps_what_is_inside(rooms: Path) -> None:
    low, high = TRUTH.vertices.min(axis=(0, 1)), TRUTH.vertices.max(axis=(0, 1))
    corners = [*(low - 0.05), *(high + 0.05)]
    box = ",".join(f"{x:.6g}" for x in corners)
    alone = largest_error(rooms, "alone")
    assert largest_error(rooms, "inside", "--crop", box) < 2 * alone
    dynmesh.write(rooms / "small.obj", replace(TRUTH[:1], vertices=0.01 * TRUTH.vertices[:1]))
    units = ("--scan-unit", "cm", "--template-unit", "m")
    run(
        "track",
        rooms / "inside",
        rooms / "small.npz",
        "--template",
        rooms / "small.obj",
        *units,
        "--crop",
        box,
    )
    small = dynmesh.read(rooms / "small.npz")
    assert error(replace(small, vertices=100 * small.vertices), TRUTH).max() < 2 * alone
    crop = crop_of(box)
    for scan in opened(rooms / "depth"):
        left = Background(crop, False).without(scan).cloud
        smaller, larger = np.reshape(np.array(crop), (2, 3))
        inside = ((scan.cloud >= smaller) & (scan.cloud <= larger)).all(axis=1)
        assert len(left) == inside.sum() > 100
        np.testing.assert_array_equal(left, scan.cloud[inside])
