"""Misread cameras."""

import json
import re
import shutil
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from browser import Page
from commands import dynmesh_command as run
from commands import run_here
from meshes import turned
from scan_files import moving_body, scanned_body, scanned_in_a_room

import dynmesh
from dynmesh import losses
from dynmesh.scans import (
    DepthScan,
    Rig,
    ScanCamera,
    open_scans,
    read_cameras,
    scan_folder,
    write_cameras,
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A body, its scans by four cameras, and the first of them in a room."""
    made = tmp_path_factory.mktemp("rig")
    truth = scanned_body(made, 3, "--depth", "160x120", name="depth")
    scanned_in_a_room(truth[:1], made / "room", (160, 120))
    return made


def changed(change: Any, rig: Rig) -> Rig:
    """The rig, with every camera changed."""
    return replace(rig, cameras=tuple(map(change, rig.cameras)))


def posed(change: Any, rig: Rig) -> Rig:
    return changed(lambda c: replace(c, camera_to_world=change(c.camera_to_world)), rig)


def named(names: list[str], rig: Rig) -> Rig:
    pairs = zip(rig.cameras, names, strict=True)
    return replace(rig, cameras=tuple(replace(camera, name=name) for camera, name in pairs))


def scaled(depths: float, positions: float, rig: Rig) -> Rig:
    factors = np.block([[np.ones((3, 3)), np.full((3, 1), positions)], [np.ones((1, 4))]])
    moved = posed(lambda pose: pose * factors, rig)
    return changed(lambda c: replace(c, depth_scale=depths * (c.depth_scale or 1)), moved)


def focused(factors: Any, rig: Rig) -> Rig:
    return changed(lambda c: replace(c, intrinsics=np.asarray(c.intrinsics) * factors), rig)


def with_centre_exchanged(camera: ScanCamera) -> ScanCamera:
    matrix = np.array(camera.intrinsics)
    matrix[0, 2], matrix[1, 2] = matrix[1, 2], matrix[0, 2]
    return replace(camera, intrinsics=matrix)


def with_counts(camera: ScanCamera) -> ScanCamera:
    return replace(camera, depth_scale=1 / (camera.depth_scale or 1))


def with_camera(rig: Rig, number: int, **changed: Any) -> Rig:
    """The rig, with one camera changed."""
    cameras = list(rig.cameras)
    cameras[number] = replace(cameras[number], **changed)
    return replace(rig, cameras=tuple(cameras))


AXES = np.diag([1.0, -1, -1, 1])

MISREAD: dict[str, tuple[Any, str]] = {
    "inverted": (partial(posed, np.linalg.inv), "the poses are inverted: "),
    "axes": (partial(posed, lambda pose: pose @ AXES), "the cameras have the axes of OpenGL"),
    "both": (partial(posed, lambda pose: np.linalg.inv(pose @ AXES)), "which have the axes of Op"),
    "transposed": (
        partial(posed, lambda p: np.block([[p[:3, :3].T, p[:3, 3:]], [p[3:]]])),
        "rotations of the poses are transposed",
    ),
    "neighbours": (partial(named, ["1", "0", "2", "3"]), "'1' and '0' are exchanged"),
    "opposite": (partial(named, ["0", "3", "2", "1"]), "'3' and '1' are exchanged"),
    "depths": (partial(scaled, 1000, 1), "depth_scale is 1000 times too large"),
    "small depths": (partial(scaled, 0.001, 1), "depth_scale is 1000 times too small"),
    "ten": (partial(scaled, 10, 1), "depth_scale is 10 times too large"),
    "size": (
        partial(focused, [[2], [2], [1]]),
        "the intrinsics are those of images twice as large",
    ),
    "centre": (
        partial(changed, with_centre_exchanged),
        "cx and cy of the intrinsics are exchanged",
    ),
    "counts": (partial(changed, with_counts), "depth_scale is the number of counts in a unit"),
    "positions": (partial(scaled, 1, 1000), "the positions of the cameras are in millimetres"),
    "both units": (partial(scaled, 1000, 1000), "positions and depths of the cameras are in mill"),
}


@pytest.mark.parametrize(
    ("misread", "scans"),
    [*((misread, "depth") for misread in MISREAD), ("inverted", "room")],
)
def test_a_misreading_is_named_and_the_file_that_is_written_is_right(
    misread: str, scans: str, folder: Path, tmp_path: Path
) -> None:
    change, told = MISREAD[misread]
    right = read_cameras(folder / scans / "cameras.json")
    write_cameras(tmp_path / "wrong.json", change(right))
    words = ("rig", folder / scans, "--template", folder / "body.obj")
    made = tmp_path / "right.json"
    said = run(*words, "--cameras", tmp_path / "wrong.json", "-o", made, code=3).stderr
    assert told in said
    assert f"{made}: " in said
    found = {camera.name: camera for camera in read_cameras(made).cameras}
    for camera in right.cameras:
        meant = found[camera.name]
        np.testing.assert_allclose(meant.camera_to_world, camera.camera_to_world, atol=1e-12)
        assert meant.depth_scale == pytest.approx(camera.depth_scale)
        np.testing.assert_allclose(np.asarray(meant.intrinsics), np.asarray(camera.intrinsics))
        assert (meant.size, meant.distortion) == (camera.size, camera.distortion)
    run(*words, "--cameras", made)  # and ends with 0


def lengthened(depth: Any, intrinsics: Any) -> Any:
    """Distances along the rays of pixels."""
    row, column = np.indices(depth.shape)
    (fx, _, cx), (_, fy, cy), _ = intrinsics
    return depth * np.sqrt(1 + ((column - cx) / fx) ** 2 + ((row - cy) / fy) ** 2)


IMAGES: dict[str, tuple[dict[str, Any], Any, str]] = {
    "rays": ({"along_ray": True}, lengthened, "depths are distances from the camera along the"),
    "left": ({"flipped": "x"}, lambda depth, _: depth[:, ::-1], "left and right are exchanged"),
    "top": ({"flipped": "y"}, lambda depth, _: depth[::-1], "top and bottom are exchanged"),
    "turned": ({"flipped": "xy"}, lambda depth, _: depth[::-1, ::-1], "turned by 180 degrees"),
}


@pytest.mark.parametrize("misread", IMAGES)
def test_what_images_hold_is_named_and_stated_in_the_file(
    misread: str, folder: Path, tmp_path: Path
) -> None:
    """Of near cameras that do not look at the middle of the subject, with noise."""
    stated, change, told = IMAGES[misread]
    body = dynmesh.read(folder / "body.obj")
    points = body.vertices[0]
    targets = points[[0, 100, 200, 300]] / 3
    around = [
        replace(camera, target=tuple(target), field_of_view=95.0)
        for camera, target in zip(losses.orbit(points, 4, distance=0.9)(0), targets, strict=True)
    ]
    (scan,) = losses.depth_images(
        body.vertices, body.faces, around, width=160, height=120, noise=0.02
    )
    cameras = [
        ScanCamera(str(number), pose, matrix, 1e-3, (160, 120))
        for number, (pose, matrix) in enumerate(zip(scan.poses, scan.intrinsics, strict=True))
    ]
    images = [
        np.asarray(change(depth, matrix), np.float32)
        for depth, matrix in zip(scan.depth, scan.intrinsics, strict=True)
    ]
    with scan_folder(tmp_path / "depth", Rig(tuple(cameras))) as append:
        append(scan._replace(depth=images))
    words = ("rig", tmp_path / "depth", "--template", folder / "body.obj")
    right = tmp_path / "right.json"
    assert told in run(*words, "-o", right, code=3).stderr
    for ours, theirs in zip(read_cameras(right).cameras, cameras, strict=True):
        np.testing.assert_equal(vars(ours), vars(replace(theirs, **stated)))
    run(*words, "--cameras", right)
    (read,) = open_scans(tmp_path / "depth", cameras=right)
    assert isinstance(read, DepthScan)
    np.testing.assert_allclose(read.depth, scan.depth, atol=1e-3)


def test_what_is_wrong_is_told_as_json(folder: Path, tmp_path: Path) -> None:
    right = read_cameras(folder / "depth" / "cameras.json")
    write_cameras(tmp_path / "wrong.json", MISREAD["axes"][0](right))
    words = ("rig", folder / "depth", "--template", folder / "body.obj", "--json")
    told = json.loads(run(*words, "--cameras", tmp_path / "wrong.json", code=3).stdout)
    assert told["reason"].startswith(told["wrong"])
    assert MISREAD["axes"][1] in told["wrong"]
    assert told["stated"]["far"] > told["meant"]["far"]


def test_how_far_the_points_are_is_told_where_nothing_explains_it(
    folder: Path, tmp_path: Path
) -> None:
    right = read_cameras(folder / "depth" / "cameras.json")
    write_cameras(tmp_path / "wrong.json", scaled(0.25, 1, right))
    words = ("--template", folder / "body.obj", "--cameras", tmp_path / "wrong.json")
    said = run("rig", folder / "depth", *words, code=3).stdout
    assert min(map(float, re.findall(r"far and (\S+) edges away", said))) > 10


def test_a_camera_without_an_image_is_not_judged(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "depth", tmp_path / "depth")
    (tmp_path / "depth" / "depth_00000_1.png").write_bytes(b"")
    told = run("rig", tmp_path / "depth", "--template", folder / "body.obj").stdout
    assert told.endswith("those without an image in it are not judged: 1\n")


def test_a_template_without_a_unit_gets_one(folder: Path, tmp_path: Path) -> None:
    right = read_cameras(folder / "depth" / "cameras.json")
    write_cameras(tmp_path / "metres.json", replace(right, metres_per_unit=1.0))
    words = ("rig", folder / "depth", "--template", folder / "body.obj")
    cameras = ("--cameras", tmp_path / "metres.json")
    assert "--template-unit" in run(*words, *cameras, code=1).stderr
    run(*words, *cameras, "--template-unit", "m")


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_wrong_with_a_right_rig(seed: int, folder: Path, tmp_path: Path) -> None:
    options = [f"--seed={seed}", f"--cameras={1 + seed}", f"--noise={(0.02, 0.2)[seed % 2]}"]
    scans = tmp_path / "depth"
    if seed == 0:
        scanned_in_a_room(dynmesh.read(folder / "body.obj"), scans, (160, 120), cameras=1)
    else:
        options += ["--outliers=2%"]
        run("degrade", folder / "body.obj", scans, "--depth=160x120", "--up=z", *options)
    words = ("rig", scans, "--template", folder / "body.obj", "-o", tmp_path / "same.json")
    assert "the same cameras are written" in run(*words).stderr
    ours, theirs = (read_cameras(file) for file in (scans / "cameras.json", tmp_path / "same.json"))
    for one, other in zip(ours.cameras, theirs.cameras, strict=True):
        np.testing.assert_array_equal(one.camera_to_world, other.camera_to_world)


def test_right_cameras_are_not_blamed_for_what_sensors_measure_at_edges(
    folder: Path, tmp_path: Path
) -> None:
    """Points behind the rim of the subject, stray ones, noise and holes."""
    run("degrade", folder / "body.obj", tmp_path / "clean", "--depth=64x48", "--up=z")
    rig = read_cameras(tmp_path / "clean" / "cameras.json")
    (scan,) = open_scans(tmp_path / "clean").frames(0, 1)
    assert isinstance(scan, DepthScan)
    rng = np.random.default_rng(0)
    images = []
    for depth in scan.depth:
        beside = [np.roll(depth, step, axis) for step in (-1, 1) for axis in (0, 1)]
        rim = (depth > 0) & (np.min(beside, axis=0) == 0)
        behind = rim * (0.5 + rng.random(depth.shape)) + 0.01 * rng.standard_normal(depth.shape)
        stray = 3 * rng.random(depth.shape) * (rng.random(depth.shape) < 0.01)
        measured = (depth > 0) & (rng.random(depth.shape) > 0.01)
        images.append(np.where(measured, depth + behind + stray, 0).astype(np.float32))
    with scan_folder(tmp_path / "depth", rig) as append:
        append(scan._replace(depth=images))
    run("rig", tmp_path / "depth", "--template", folder / "body.obj")


@pytest.mark.parametrize("off", [2, 8, "longer"])
def test_a_camera_that_is_off_is_named_and_no_file_is_written(
    off: int | str, folder: Path, tmp_path: Path
) -> None:
    """One that is turned by some degrees, or whose focal length is wrong."""
    rig = read_cameras(folder / "depth" / "cameras.json")
    if isinstance(off, int):
        aside = np.eye(4)
        aside[:3, :3] = turned(np.eye(3), np.radians(off))[[0, 2, 1]][:, [0, 2, 1]]
        wrong = with_camera(rig, 2, camera_to_world=rig.cameras[2].camera_to_world @ aside)
    else:
        longer = np.asarray(rig.cameras[2].intrinsics) * [[1.1, 1, 1], [1, 1.1, 1], [1, 1, 1]]
        wrong = with_camera(rig, 2, intrinsics=longer)
    write_cameras(tmp_path / "wrong.json", wrong)
    words = ("rig", folder / "depth", "--template", folder / "body.obj", "-o", tmp_path / "o.json")
    said = run(*words, "--cameras", tmp_path / "wrong.json", code=3).stdout
    assert off == "longer" or re.search(r"2: ([2-9]\d|100)% far", said)
    assert "intrinsics of camera '2' are wrong" in said
    assert "o.json is not written" in said
    assert not (tmp_path / "o.json").exists()


@pytest.mark.parametrize(
    ("focal_length", "size", "told"),
    [
        (1.02, 1, ""),
        (1.05, 1, "the focal lengths of all cameras are about 5% too long"),
        (0.93, 1, "the focal lengths of all cameras are about 7% too short"),
        (1, 1.02, ""),
        (1, 1.06, "the template is about 7% too large"),
    ],
)
@pytest.mark.parametrize("command", ["rig", "track"])
def test_focal_lengths_and_sizes_that_are_wrong_everywhere_are_told(
    command: str, focal_length: float, size: float, told: str, folder: Path, tmp_path: Path
) -> None:
    body = dynmesh.read(folder / "body.obj")
    middle = body.vertices.mean(axis=1, keepdims=True)
    dynmesh.write(
        tmp_path / "body.obj", replace(body, vertices=size * (body.vertices - middle) + middle)
    )
    rig = read_cameras(folder / "depth" / "cameras.json")
    longer = [[focal_length, 1, 1], [1, focal_length, 1], [1, 1, 1]]
    write_cameras(tmp_path / "wrong.json", focused(longer, rig))
    output = [tmp_path / "o.npz"] if command == "track" else []
    words: list[str | Path] = [command, folder / "depth", *output]
    words += ["--template", tmp_path / "body.obj"]
    ended = run(*words, "--cameras", tmp_path / "wrong.json", code=3 if told else 0)
    # Of a size or short focal lengths, depths along rays explain as much where few points are far.
    if command == "track" or focal_length > 1:
        assert told in ended.stdout + ended.stderr


def test_the_file_that_was_read_is_not_replaced(folder: Path) -> None:
    read = folder / "depth" / "cameras.json"
    before = read.read_bytes()
    words = ("rig", folder / "depth", "--template", folder / "body.obj", "-o", read, "--overwrite")
    assert "is the input" in run(*words, code=1).stderr
    assert read.read_bytes() == before


def test_tracking_names_the_command_where_the_first_frame_is_ruined(
    folder: Path, tmp_path: Path
) -> None:
    scans, body = folder / "depth", folder / "body.obj"
    wrong = tmp_path / "wrong.json"
    for misread in ("depths", "inverted", "transposed", "axes"):
        rig = MISREAD[misread][0](read_cameras(scans / "cameras.json"))
        write_cameras(wrong, rig)
        words = ("track", scans, tmp_path / "o.npz", "--template", body, "--overwrite")
        ended = run_here(*words, "--cameras", wrong)
        assert ended.returncode in (1, 3)
        assert "dynmesh rig" in ended.stderr
        assert misread != "axes" or f"dynmesh: {body}: the template" in ended.stderr
    assert "dynmesh rig" not in run(*words).stderr


def test_a_camera_that_is_farther_from_the_mesh_makes_the_result_doubtful(tmp_path: Path) -> None:
    """One that went four degrees around the subject pulls the mesh, but its points are near."""
    truth = moving_body(3, 0, [1.5, 0.4, 0.6])
    dynmesh.write(tmp_path / "truth.npz", truth)
    scans, template = tmp_path / "depth", tmp_path / "truth.npz"
    run("degrade", template, scans, "--depth", "160x120")
    right = to_file.track(scans, tmp_path / "right.npz", template=template)
    assert (right.quality, right.suspects) == ("good", ())
    rig = read_cameras(scans / "cameras.json")
    around = np.eye(4)
    around[:3, :3] = turned(np.eye(3), np.radians(4))
    moved = with_camera(rig, 0, camera_to_world=around @ rig.cameras[0].camera_to_world)
    write_cameras(tmp_path / "wrong.json", moved)
    wrong = to_file.track(
        scans, tmp_path / "wrong.npz", template=template, cameras=tmp_path / "wrong.json"
    )
    assert wrong.far is not None
    assert wrong.far < 0.01
    assert (wrong.quality, wrong.suspects) == ("doubtful", ("0",))
    assert "'0'" in wrong.reason


@pytest.mark.parametrize("misread", ["none", "neighbours"])
def test_the_page_shows_cameras_and_what_was_found(
    misread: str, folder: Path, tmp_path: Path, chromium: Any
) -> None:
    rig = read_cameras(folder / "depth" / "cameras.json")
    is_right = misread == "none"
    write_cameras(tmp_path / "cameras.json", rig if is_right else MISREAD[misread][0](rig))
    words = ("rig", folder / "depth", "--cameras", tmp_path / "cameras.json")
    template = ("--template", folder / "body.obj")
    output = tmp_path / "rig.html"
    run(*words, *template, "--page", output, code=0 if is_right else 3)
    shown = Page(chromium, output, "#rig")
    assert ("exchanged" in shown.page.inner_text("#rig")) != is_right
    assert shown.page.locator("#rig tr").count() == 4
    objects = shown.page.evaluate(
        "(async () => Object.values((await K3DInstance).getWorld().ObjectsListJson)"
        ".map((one) => one.type))()"
    )
    assert sorted(objects) == 4 * ["Lines"] + ["Mesh"] + 4 * ["Points"]
    assert shown.complaints == []
    assert "exists already" in run(*words, *template, "--page", output, code=1).stderr
    bare = run(*words, "--page", tmp_path / "bare.html").stdout
    assert "nothing is judged" in bare
