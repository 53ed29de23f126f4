"""Colours of scans, by which a mesh slides less along itself."""

import copy
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from meshes import Array
from PIL import Image
from scan_files import moving_body, opened

import dynmesh
from dynmesh import losses
from dynmesh.scans import PointScan, write_ply

TRUTH = moving_body(6)


def tracked_by(scans: list[Any], tracker: dynmesh.Tracker) -> Array:
    return np.stack([tracker.push(scan) for scan in scans])


@pytest.fixture
def tracker(tmp_path: Path) -> dynmesh.Tracker:
    dynmesh.write(tmp_path / "body.obj", TRUTH[:1])
    template = dynmesh.read(tmp_path / "body.obj")
    return dynmesh.Tracker(template.faces, template.vertices[0])


@pytest.fixture
def points(tmp_path: Path) -> list[PointScan]:
    """Points of which each place of the body has its colour, and a folder with their files."""
    colours = np.sin(5 * TRUTH.vertices[0])
    made = losses.scan_points(TRUTH.vertices, TRUTH.faces, points=3000, colours=colours)
    (tmp_path / "scans").mkdir()
    scans = [scan._replace(viewpoints=None) for scan in made]
    for number, scan in enumerate(scans):
        write_ply(tmp_path / "scans" / f"scan_{number}.ply", scan)
    return scans


def test_clouds_with_colours(
    tracker: dynmesh.Tracker, points: list[PointScan], tmp_path: Path
) -> None:
    plain, stopped = copy.copy(tracker), copy.copy(tracker)
    expected = tracked_by(points, tracker)
    without = tracked_by([scan._replace(colours=None) for scan in points], plain)
    files: Any = {"template": tmp_path / "body.obj"}
    np.testing.assert_allclose(
        dynmesh.track(tmp_path / "scans", **files, colours="points").read().vertices,
        expected,
        atol=2e-3,
    )
    np.testing.assert_allclose(
        dynmesh.track(tmp_path / "scans", **files).read().vertices, without, atol=2e-3
    )
    run("convert", tmp_path / "scans", tmp_path / "larger", "--scale", "2")
    words: list[str | Path] = ["--template", tmp_path / "body.obj", "--colours", "points"]
    words += ["--scan-unit", "0.5", "--template-unit", "1"]
    run("track", tmp_path / "larger", tmp_path / "out.npz", *words)
    told = dynmesh.read(tmp_path / "out.npz").vertices
    np.testing.assert_allclose(told, expected, atol=2e-3)
    assert np.abs(expected - without).max() > 3e-3
    # A state has the colours that were learned.
    tracked_by(points[:3], stopped)
    again = copy.copy(plain)
    again.restore(stopped.state())
    np.testing.assert_array_equal(tracked_by(points[3:], again), expected[3:])


def test_intensities_are_colours_of_one_channel(
    tracker: dynmesh.Tracker, points: list[PointScan]
) -> None:
    other = copy.copy(tracker)
    for scan in points:
        grey = np.rint(100 * np.asarray(scan.colours)[:, 0]).astype(np.int64)
        three = np.repeat(grey[:, None], 3, axis=1).astype(np.float64)
        here = tracker.push(scan.points, scan.normals, colours=grey)
        there = other.push(scan.points, scan.normals, colours=three)
        np.testing.assert_array_equal(here, there)


def test_depth_images_with_colours(tracker: dynmesh.Tracker, tmp_path: Path) -> None:
    """The nearest image in time counts; of a frame whose colours are lost, none does."""
    dynmesh.write(tmp_path / "truth.npz", TRUTH)
    run("degrade", tmp_path / "truth.npz", tmp_path / "depth", "--depth", "120x90")
    (tmp_path / "colours").mkdir()
    scans = []
    reader = opened(tmp_path / "depth")
    for number, scan in enumerate(reader):
        shades = [(40 * depth % 255).astype(np.uint8) for depth in scan.depth]
        scans.append(scan._replace(colours=None if number == 2 else shades))
        for camera, shade in zip(reader.cameras_of(0), shades, strict=True):
            if number != 2:
                name = f"colour_{number + 0.1:.1f}_{camera}.png"
                Image.fromarray(shade).save(tmp_path / "colours" / name)
    files: Any = {"template": tmp_path / "body.obj", "colours": tmp_path / "colours"}
    with pytest.raises(ValueError, match=r"no colour image in .* for depth_00002"):
        dynmesh.track(tmp_path / "depth", **files)
    tracked = dynmesh.track(tmp_path / "depth", **files, gaps="lost").read()
    np.testing.assert_allclose(tracked.vertices, tracked_by(scans, tracker), atol=2e-3)
    deep = tmp_path / "colours" / f"colour_0.1_{reader.cameras_of(0)[0]}.png"
    kept = deep.read_bytes()
    Image.fromarray(np.zeros((90, 120), np.uint16)).save(deep)
    with pytest.raises(ValueError, match=f"{re.escape(deep.name)}.*8 bits a channel"):
        dynmesh.track(tmp_path / "depth", **files, gaps="lost").read()
    deep.write_bytes(kept)
    small = tmp_path / "colours" / f"colour_1.1_{reader.cameras_of(0)[0]}.png"
    Image.new("RGB", (60, 45)).save(small)
    with pytest.raises(
        ValueError, match=f"{re.escape(small.name)}.*60 x 45 pixels, but .* 120 x 90"
    ):
        dynmesh.track(tmp_path / "depth", **files, gaps="lost").read()


@pytest.mark.parametrize(
    ("colours", "message"),
    [
        (np.zeros((4, 3)), "has 4 rows, but points has"),
        (np.full((3000, 3), np.nan), "colours"),
        (np.zeros((3000, 4)), r"\(n, 3\) or \(n,\)"),
    ],
)
def test_colours_that_are_none(
    tracker: dynmesh.Tracker, points: list[PointScan], colours: Array, message: str
) -> None:
    state = tracker.state()
    with pytest.raises(ValueError, match=message):
        tracker.push(points[0].points, points[0].normals, colours=colours)
    with pytest.raises(ValueError, match="colours: must not be given beside a PointScan"):
        tracker.push(points[0], colours=points[0].colours)
    assert tracker.state() == state
    with pytest.raises(ValueError, match=r"colours: must have shape \(642, 3\)"):
        next(losses.scan_points(TRUTH.vertices, TRUTH.faces, colours=np.zeros((3, 3))))


def test_files_without_colours(points: list[PointScan], tmp_path: Path) -> None:
    dynmesh.write(tmp_path / "body.obj", TRUTH[:1])
    write_ply(tmp_path / "scans" / "scan_3.ply", points[3]._replace(colours=None))
    with pytest.raises(ValueError, match=r"scan_3\.ply.*has no colours"):
        dynmesh.track(tmp_path / "scans", template=tmp_path / "body.obj", colours="points").read()
    with pytest.raises(ValueError, match="must be 'points' for files of points"):
        dynmesh.track(tmp_path / "scans", template=tmp_path / "body.obj", colours=tmp_path)


def test_scans_in_memory_have_their_colours(
    tracker: dynmesh.Tracker, points: list[PointScan], tmp_path: Path
) -> None:
    tracked = dynmesh.track(points, template=tmp_path / "body.obj")
    np.testing.assert_allclose(tracked.vertices, tracked_by(points, tracker), atol=2e-3)
