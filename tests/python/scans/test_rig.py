"""Misread cameras."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from browser import Page
from commands import dynmesh_command as run
from commands import run_here
from meshes import turned
from scan_files import moving_body, opened, scanned_body, scanned_in_a_room

import dynmesh
from dynmesh import losses
from dynmesh.scans import (
    Rig,
    ScanCamera,
    read_cameras,
    scan_folder,
    write_cameras,
)
from dynmesh.tracking.background import crop_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A body, its scans by four cameras, and the first of them in a room."""
    made = tmp_path_factory.mktemp("rig")
    truth = dynmesh.synth.hand(3)
    truth = replace(truth, metres_per_unit=None)
    dynmesh.write(made / "truth.npz", truth)
    dynmesh.write(made / "body.obj", truth[:1])
    run("degrade", made / "truth.npz", made / "depth", "--depth", "160x120")
    run("degrade", made / "truth.npz", made / "single", "--depth", "160x120", "--cameras", "1")
    scanned_in_a_room(truth[:1], made / "room", (160, 120))
    return made


def changed(change: Callable[[ScanCamera], ScanCamera], rig: Rig) -> Rig:
    """The rig, with every camera changed."""
    return replace(rig, cameras=tuple(map(change, rig.cameras)))


def posed(change: Any) -> Callable[[ScanCamera], ScanCamera]:
    return lambda c: replace(c, camera_to_world=change(c.camera_to_world))


def scaled(positions: float, depths: float) -> Callable[[ScanCamera], ScanCamera]:
    moved = posed(lambda pose: pose * ([[1, 1, 1, positions]] * 3 + [[1] * 4]))
    return lambda c: replace(moved(c), depth_scale=depths * (c.depth_scale or 1))


def focused(factors: Any) -> Callable[[ScanCamera], ScanCamera]:
    return lambda c: replace(c, intrinsics=np.asarray(c.intrinsics) * factors)


def with_camera(rig: Rig, number: int, **changed: Any) -> Rig:
    """The rig, with one camera changed."""
    cameras = list(rig.cameras)
    cameras[number] = replace(cameras[number], **changed)
    return replace(rig, cameras=tuple(cameras))


AXES = np.diag([1.0, -1, -1, 1])
UPRIGHT = np.eye(4)[[0, 2, 1, 3]] * [1, -1, 1, 1]  # a camera that looks along y, with z up

MISREAD: dict[str, tuple[Callable[[ScanCamera], ScanCamera], str]] = {
    "inverted": (posed(np.linalg.inv), "the poses are inverted"),
    "axes": (posed(lambda pose: pose @ AXES), "the cameras have the axes of OpenGL"),
    "depths": (scaled(1, 1000), "depth_scale is 1000 times too large"),
    "small depths": (scaled(1, 0.001), "depth_scale is 1000 times too small"),
    "positions": (scaled(1000, 1), "the positions of the cameras are 1000 times too large"),
    "both units": (scaled(1000, 1000), "positions and depths of the cameras are 1000 times too la"),
    "template": (scaled(0.001, 0.001), "positions and depths of the cameras are 1000 times too sm"),
    "large": (focused([[2], [2], [1]]), "the intrinsics are those of images twice as large"),
    "small": (focused([[0.5], [0.5], [1]]), "the intrinsics are those of images half as large"),
    "rays": (lambda c: replace(c, along_ray=True), "along_ray is wrong"),
    "left": (lambda c: replace(c, flipped="x"), "flipped is wrong: left and right"),
    "top": (lambda c: replace(c, flipped="y"), "flipped is wrong: top and bottom"),
}


@pytest.mark.parametrize(
    ("misread", "scans"),
    [
        *((misread, "depth") for misread in MISREAD),
        *((misread, "single") for misread in MISREAD if misread != "left"),  # it is symmetric
        ("inverted", "room"),
    ],
)
def test_a_misreading_is_named_and_the_file_that_is_written_is_right(
    misread: str, scans: str, folder: Path, tmp_path: Path
) -> None:
    """By the template where it is, of one camera, and by all frames, of several."""
    change, told = MISREAD[misread]
    right = read_cameras(folder / scans / "cameras.json")
    write_cameras(tmp_path / "wrong.json", changed(change, right))
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
        names = ("size", "distortion", "flipped", "along_ray")
        assert [getattr(meant, name) for name in names] == [getattr(camera, n) for n in names]
    run(*words, "--cameras", made)  # and ends with 0


@pytest.mark.parametrize("misread", ["inverted", "axes", "depths", "large", "small"])
def test_cameras_that_contradict_one_another_need_no_template(
    misread: str, folder: Path, tmp_path: Path
) -> None:
    change, told = MISREAD[misread]
    write_cameras(
        tmp_path / "wrong.json", changed(change, read_cameras(folder / "depth" / "cameras.json"))
    )
    words = ("rig", folder / "depth", "--json")
    assert json.loads(run(*words).stdout)["quality"] == "good"
    said = json.loads(run(*words, "--cameras", tmp_path / "wrong.json", code=3).stdout)
    assert said["reason"] == said["wrong"]
    assert told in said["wrong"]
    assert min(said["stated"]["apart"]) > max(said["meant"]["apart"])


@pytest.mark.parametrize("change", ["none", "inverted", "moved"])
def test_a_single_camera_is_not_judged_unless_the_template_lies_there(
    change: str, folder: Path, tmp_path: Path
) -> None:
    """A rigid motion puts the template into the scan of any camera."""
    right = read_cameras(folder / "single" / "cameras.json")
    shift = np.array([[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    changes = {"inverted": np.linalg.inv, "moved": lambda pose: shift @ pose}
    rig = changed(posed(changes[change]), right) if change in changes else right
    write_cameras(tmp_path / "cameras.json", rig)
    body = dynmesh.read(folder / "body.obj")
    away = replace(body, vertices=turned(body.vertices[0], 2)[None] + 50)
    dynmesh.write(tmp_path / "away.obj", away)
    words = ("rig", folder / "single", "--cameras", tmp_path / "cameras.json")
    for options in ((), ("--template", tmp_path / "away.obj")):
        made = tmp_path / "made.json"
        said = run(*words, *options, "-o", made).stdout
        assert "a single camera is judged only by a template" in said
        assert not made.exists()


def test_a_camera_that_moves_is_judged_by_several_scans(folder: Path, tmp_path: Path) -> None:
    """The first pose is the identity, whose inverse it is."""
    truth = dynmesh.read(folder / "truth.npz")
    still = np.repeat(truth.vertices[:1], 4, axis=0)
    around = losses.orbit(still[0], degrees_per_frame=25)
    scans = [*losses.depth_images(still, truth.faces, around, width=160, height=120)]
    first = np.linalg.inv(scans[0].poses[0])
    poses = np.stack([first @ scan.poses[0] for scan in scans])
    matrices = np.stack([scan.intrinsics[0] for scan in scans])
    frames = tuple(range(4))
    camera = ScanCamera("a", poses, matrices, 1e-3, (160, 120), frames=frames)
    with scan_folder(tmp_path / "depth", Rig((camera,))) as append:
        for scan, pose in zip(scans, poses, strict=True):
            append(scan._replace(poses=[pose]))
    body = still[:1] @ first[:3, :3].T + first[:3, 3]
    dynmesh.write(tmp_path / "body.obj", replace(truth[:1], vertices=body))
    words = ("rig", tmp_path / "depth", "--template", tmp_path / "body.obj")
    run(*words, "-o", tmp_path / "same.json")
    write_cameras(tmp_path / "wrong.json", changed(posed(np.linalg.inv), Rig((camera,))))
    said = run(*words, "--cameras", tmp_path / "wrong.json", code=3).stdout
    assert "the poses are inverted" in said


def test_what_no_reading_explains_is_told_with_the_share_of_each_camera(
    folder: Path, tmp_path: Path
) -> None:
    """A camera that is turned, all that are turned, and a template in another pose."""
    right = read_cameras(folder / "depth" / "cameras.json")
    aside = np.eye(4)
    aside[:3, :3] = turned(np.eye(3), np.radians(8))[[0, 2, 1]][:, [0, 2, 1]]
    one = with_camera(right, 2, camera_to_world=right.cameras[2].camera_to_world @ aside)
    write_cameras(tmp_path / "wrong.json", one)
    words = ("rig", folder / "depth", "-o", tmp_path / "o.json", "--template")
    wrong = ("--cameras", tmp_path / "wrong.json")
    said = run(*words, folder / "body.obj", *wrong, code=3).stdout
    shares = re.findall(r"^camera \d, [\d.]+% .* camera, ([\d.]+)% ", said, re.MULTILINE)
    assert np.argmax([float(far) for far in shares]) == 2
    assert "o.json is not written" in said
    assert not (tmp_path / "o.json").exists()
    body = dynmesh.read(folder / "body.obj")
    dynmesh.write(tmp_path / "flat.obj", replace(body, vertices=body.vertices * [1, 0.3, 1]))
    stated = json.loads(run(*words, tmp_path / "flat.obj", "--json", code=3).stdout)["stated"]
    assert max(stated["apart"]) < 0.12 < max(stated["far"])


def test_a_camera_without_an_image_is_not_judged(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "depth", tmp_path / "depth")
    (tmp_path / "depth" / "depth_00000_1.png").write_bytes(b"")
    told = run("rig", tmp_path / "depth", "--template", folder / "body.obj").stdout
    assert told.endswith("these are not judged: 1\n")


def test_the_help_says_what_a_command_does_without_an_image(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "depth", tmp_path / "depth")
    (tmp_path / "depth" / "depth_00000_1.png").unlink()
    scans, body, made = tmp_path / "depth", folder / "body.obj", tmp_path / "made.npz"
    commands: dict[str, list[str | Path]] = {
        "rig": [scans, "--template", body],
        "register": [body, scans / "depth_00000_*.png", made],
        "track": [scans, tmp_path / "tracked.npz", "--template", body],
        "view": [body, "--scans", scans, "-o", tmp_path / "page.html"],
    }
    for verb, words in commands.items():
        (told,) = re.findall("--gaps.*", run(verb, "--help").stdout)
        refuses = verb == "track"
        assert re.search("default: refuse" if refuses else "default: lost|scans are lost", told)
        refusal = "there is no image of camera '1' for frame 0"
        assert refusal in run(verb, *words, "--gaps", "refuse", code=1).stderr
        assert (refusal in run_here(verb, *words).stderr) == refuses


def test_a_vertex_of_the_template_without_a_face_does_not_count(
    folder: Path, tmp_path: Path
) -> None:
    body = dynmesh.read(folder / "body.obj")
    stray = np.concatenate([body.vertices, [[[1e3, 0, 0]]]], axis=1)
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(stray, body.faces))
    right = read_cameras(folder / "single" / "cameras.json")
    write_cameras(tmp_path / "wrong.json", changed(MISREAD["inverted"][0], right))
    words = ("rig", folder / "single", "--template", tmp_path / "body.obj")
    run(*words)
    said = run(*words, "--cameras", tmp_path / "wrong.json", code=3).stdout
    assert "the poses are inverted" in said


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


def test_right_cameras_are_not_blamed_for_what_sensors_measure_at_edges(tmp_path: Path) -> None:
    """Points behind the rim of a subject 2 m wide, stray ones, noise of 1 cm, and holes."""
    scanned_body(tmp_path, 1, "--depth=64x48", name="clean")
    rig = read_cameras(tmp_path / "clean" / "cameras.json")
    (scan,) = opened(tmp_path / "clean").frames(0, 1)
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
    run("rig", tmp_path / "depth", "--template", tmp_path / "body.obj")


def test_tracking_names_the_command(folder: Path, tmp_path: Path) -> None:
    scans, body = folder / "depth", folder / "body.obj"
    wrong = tmp_path / "wrong.json"
    right = read_cameras(scans / "cameras.json")
    words = ("track", scans, tmp_path / "o.npz", "--template", body, "--overwrite")
    for misread in ("depths", "inverted", "axes"):
        write_cameras(wrong, changed(MISREAD[misread][0], right))
        ended = run_here(*words, "--cameras", wrong)
        assert ended.returncode in (1, 3), (misread, ended.stderr)
        assert "dynmesh rig" in ended.stderr
    assert "dynmesh rig" not in run(*words).stderr


def test_a_camera_that_is_farther_from_the_mesh_makes_the_result_doubtful(tmp_path: Path) -> None:
    """One that went seven degrees around the subject pulls the mesh, but its points are near."""
    truth = moving_body(3, 0, [1.5, 0.4, 0.6])
    dynmesh.write(tmp_path / "truth.npz", truth)
    scans, template = tmp_path / "depth", tmp_path / "truth.npz"
    run("degrade", template, scans, "--depth", "160x120")
    right = to_file.track(scans, tmp_path / "right.npz", template=template)
    assert (right.quality, right.suspects) == ("good", ())
    rig = read_cameras(scans / "cameras.json")
    around = np.eye(4)
    around[:3, :3] = turned(np.eye(3), np.radians(7))
    moved = with_camera(rig, 0, camera_to_world=around @ rig.cameras[0].camera_to_world)
    write_cameras(tmp_path / "wrong.json", moved)
    wrong: Any = to_file.track(
        scans, tmp_path / "wrong.npz", template=template, cameras=tmp_path / "wrong.json"
    )
    assert wrong.far < 0.01
    assert (wrong.quality, wrong.suspects) == ("doubtful", ("0",))
    assert "'0'" in wrong.reason


@pytest.mark.parametrize("misread", ["none", "inverted"])
def test_the_page_shows_cameras_and_what_was_found(
    misread: str, folder: Path, tmp_path: Path, chromium: Any
) -> None:
    rig = read_cameras(folder / "depth" / "cameras.json")
    is_right = misread == "none"
    write_cameras(tmp_path / "cameras.json", rig if is_right else changed(MISREAD[misread][0], rig))
    words = ("rig", folder / "depth", "--cameras", tmp_path / "cameras.json")
    template = ("--template", folder / "body.obj")
    output = tmp_path / "rig.html"
    run(*words, *template, "--page", output, code=0 if is_right else 3)
    shown = Page(chromium, output, "#rig")
    assert ("inverted" in shown.page.inner_text("#rig")) != is_right
    assert shown.page.locator("#rig-cameras tr").count() == 4
    objects = shown.page.evaluate(
        "(async () => Object.values((await K3DInstance).getWorld().ObjectsListJson)"
        ".map((one) => one.type))()"
    )
    assert sorted(objects) == 5 * ["Lines"] + ["Mesh"] + 4 * ["Points"]
    assert shown.complaints == []
    assert "exists already" in run(*words, *template, "--page", output, code=1).stderr
    run(*words, "--page", tmp_path / "bare.html", code=0 if is_right else 3)


@pytest.mark.parametrize(("pose", "axis"), [(np.eye(4), -2), (AXES, 2), (UPRIGHT, 3)])
def test_the_page_shows_upright_what_upright_cameras_see(
    pose: Any, axis: int, folder: Path, tmp_path: Path, chromium: Any
) -> None:
    """Also in the axes of a camera, whose y points down."""
    rig = read_cameras(folder / "single" / "cameras.json")
    write_cameras(tmp_path / "cameras.json", changed(posed(lambda _: pose), rig))
    output = tmp_path / "rig.html"
    run("rig", folder / "single", "--cameras", tmp_path / "cameras.json", "--page", output)
    shown = Page(chromium, output, "#rig-crop:not(:empty)")
    up = shown.page.evaluate("(async () => (await K3DInstance).getWorld().camera.up.toArray())()")
    assert np.sign(axis) * up[abs(axis) - 1] > 0.5
    assert shown.complaints == []


def test_a_box_is_drawn_on_the_page_in_the_unit_of_the_scans(
    folder: Path, tmp_path: Path, chromium: Any
) -> None:
    """It begins with all points, and moves as the option that is to be copied says."""
    output = tmp_path / "rig.html"
    body = dynmesh.read(folder / "body.obj")
    dynmesh.write(tmp_path / "body.obj", replace(body, vertices=100 * body.vertices))
    units = ("--template-unit", "cm", "--scan-unit", "m")
    run("rig", folder / "depth", "--template", tmp_path / "body.obj", *units, "--page", output)
    shown = Page(chromium, output, "#rig-crop:not(:empty)")
    (scan, *_) = opened(folder / "depth")
    box: Any = crop_of(shown.page.inner_text("#rig-crop").split()[1])
    low, high = np.reshape(np.array(box), (2, 3))
    np.testing.assert_allclose([low, high], np.quantile(scan.cloud, [0, 1], axis=0), atol=0.004)
    shown.page.locator("#rig-box input").nth(1).fill("0.07")
    assert shown.page.inner_text("#rig-crop").split(",")[3] == "0.07"
    drawn = shown.page.evaluate(
        "(async () => { const world = (await K3DInstance).getWorld();"
        "const { position, scale } = Object.values(world.ObjectsById).at(-1);"
        "return [position.x + scale.x, position.y + scale.y]; })()"
    )
    np.testing.assert_allclose(drawn, [0.07, high[1]], atol=1e-6)
    shown.page.locator("#rig-box input").nth(0).fill("1")
    assert "must be larger" in shown.page.inner_text("#rig-crop")
    assert shown.complaints == []
