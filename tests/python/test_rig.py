"""Mistakes in cameras, units and templates are recognised, and the named option repairs them."""

import io
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from commands import dynmesh_command as run
from meshes import Array, turned
from PIL import Image
from test_track import bumpy

import dynmesh
from dynmesh import degrade
from dynmesh.degrade.depth_buffer import intrinsics_of, pose_of
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.diagnosis.rig import RigDiagnosis, diagnose_rig
from dynmesh.diagnosis.rig_reading import Reading, RigFinding
from dynmesh.diagnosis.rig_reading import turned as turned_by
from dynmesh.files.scans import (
    DepthFolder,
    PointScan,
    Rig,
    ScanCamera,
    open_scans,
    read_cameras,
    write_ply,
)
from dynmesh.files.scans.depth_files import write_depth
from dynmesh.jobs.rig_options import RigOptions
from dynmesh.jobs.tracking import track_file

Cameras = list[dict[str, Any]]


class Recording(NamedTuple):
    """Scans of a body in a room, in a folder with the truth and the template."""

    folder: Path
    truth: dynmesh.Sequence

    def changed(self, change: Callable[[Cameras], Any], path: Path, **fields: Any) -> Path:
        """Writes the file of the cameras with a mistake."""
        told = json.loads((self.folder / "depth" / "cameras.json").read_text())
        change(told["cameras"])
        path.write_text(json.dumps(told | fields))
        return path

    def diagnosis(self, cameras: Path | None, template: Path | None = None) -> RigDiagnosis:
        """Returns what is found with these cameras."""
        mesh = dynmesh.read(template or self.folder / "body.obj")
        asked = RigOptions(cameras=cameras).checked()
        reader = asked.open(self.folder / "depth")
        units = asked.units(reader, None)
        reading = asked.reading(units, Path())
        return diagnose_rig(reader, reading, units, mesh.faces, mesh.vertices[0])

    def error(self, output: Path) -> float:
        """The mean distance from the true vertex in the last frame, in mean edges."""
        last = dynmesh.read(output).vertices[-1] - self.truth.vertices[-1]
        edge = mean_edge_of(self.truth.vertices[0], self.truth.faces)
        return float(np.linalg.norm(last, axis=1).mean() / edge)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    folder = tmp_path_factory.mktemp("rig")
    mesh = bumpy()
    frames = [turned(mesh.vertices, 0.02 * i) + 0.01 * i for i in range(3)]
    truth = dynmesh.Sequence(np.stack(frames), mesh.faces, up_axis="z")
    dynmesh.write(folder / "truth.npz", truth)
    dynmesh.write(folder / "body.obj", truth[:1])
    run("degrade", folder / "truth.npz", folder / "depth", "--depth", "160x120", "--room")
    return Recording(folder, truth)


@pytest.fixture(scope="module")
def error_of_right_rig(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> float:
    output = tmp_path_factory.mktemp("right") / "out.npz"
    template = recording.folder / "body.obj"
    report = track_file(recording.folder / "depth", output, template=template, remove_planes=True)
    assert report.rig == ()
    return recording.error(output)


def on_poses(change: Callable[[Array], Array]) -> Callable[[Cameras], None]:
    def changed(cameras: Cameras) -> None:
        for camera in cameras:
            camera["camera_to_world"] = change(np.array(camera["camera_to_world"])).tolist()

    return changed


def with_transposed_rotation(pose: Array) -> Array:
    return np.asarray(np.block([[pose[:3, :3].T, pose[:3, 3:]], [pose[3:]]]))


def in_other_unit(poses: float, depths: float) -> Callable[[Cameras], None]:
    def changed(cameras: Cameras) -> None:
        for camera in cameras:
            pose = np.array(camera["camera_to_world"])
            pose[:3, 3] *= poses
            camera["camera_to_world"] = pose.tolist()
            camera["depth_scale"] *= depths

    return changed


def for_other_images(factor: float) -> Callable[[Cameras], None]:
    def changed(cameras: Cameras) -> None:
        for camera in cameras:
            middle = (factor - 1) / 2
            scaled = np.array([[factor, 0, middle], [0, factor, middle], [0, 0, 1]])
            camera["intrinsics"] = (scaled @ camera["intrinsics"]).tolist()
            del camera["width"], camera["height"]

    return changed


def swapped(one: int, other: int) -> Callable[[Cameras], None]:
    def changed(cameras: Cameras) -> None:
        names = cameras[one]["name"], cameras[other]["name"]
        cameras[other]["name"], cameras[one]["name"] = names

    return changed


FLIP = np.diag([1.0, -1, -1, 1])
MISTAKES: dict[str, tuple[Callable[[Cameras], None], set[str]]] = {
    "inverted": (on_poses(lambda pose: np.asarray(np.linalg.inv(pose))), {"poses"}),
    "axes": (on_poses(lambda pose: np.asarray(pose @ FLIP)), {"axes"}),
    "both": (on_poses(lambda pose: np.asarray(np.linalg.inv(pose @ FLIP))), {"poses", "axes"}),
    "transposed": (on_poses(with_transposed_rotation), {"matrices"}),
    "neighbours": (swapped(0, 1), {"swap_cameras"}),
    "millimetres": (in_other_unit(1000, 1000), {"scan_unit", "template_unit"}),
    "depths": (in_other_unit(1, 1000), {"depth_scale"}),
    "positions": (in_other_unit(1000, 1), {"depth_scale", "scan_unit", "template_unit"}),
    "larger images": (for_other_images(2), {"intrinsics_size"}),
    "smaller images": (for_other_images(0.5), {"intrinsics_size"}),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_refused_and_the_named_option_repairs_the_run(
    mistake: str, recording: Recording, error_of_right_rig: float, tmp_path: Path
) -> None:
    change, expected = MISTAKES[mistake]
    cameras = recording.changed(change, tmp_path / "cameras.json")
    scans, output = recording.folder / "depth", tmp_path / "out.npz"
    template = recording.folder / "body.obj"
    words = ("track", scans, output, "--template", template, "--cameras", cameras)
    told = run(*words, "--remove-planes", code=1).stderr
    _, _, named = told.partition("as it is read now: ")
    remedy, _, _ = named.partition(" (in Python")
    assert {word.strip("-").replace("-", "_") for word in remedy.split()[::2]} == expected
    assert not output.exists()
    run(*words, "--remove-planes", *remedy.split())
    assert recording.error(output) < 1.1 * error_of_right_rig + 0.01


def test_matrices_listed_by_columns_are_refused_and_read_if_asked(
    recording: Recording, error_of_right_rig: float, tmp_path: Path
) -> None:
    cameras = recording.changed(on_poses(lambda pose: pose.T), tmp_path / "cameras.json")
    scans, output = recording.folder / "depth", tmp_path / "out.npz"
    words = ("track", scans, output, "--template", recording.folder / "body.obj")
    asked = (*words, "--cameras", cameras, "--remove-planes")
    assert "--matrices columns" in run(*asked, code=1).stderr
    run(*asked, "--matrices", "columns")
    assert recording.error(output) < 1.1 * error_of_right_rig + 0.01


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_turned_template_is_aligned_or_named(
    axis: str, recording: Recording, error_of_right_rig: float, tmp_path: Path
) -> None:
    template, output = tmp_path / "body.obj", tmp_path / "out.npz"
    mesh = recording.truth[:1]
    vertices = turned_by(mesh.vertices[0], ((axis, 180.0),))
    dynmesh.write(template, replace(mesh, vertices=vertices[None]))
    scans = recording.folder / "depth"
    options: dict[str, Any] = {"template": template, "remove_planes": True}
    found = recording.diagnosis(None, template).findings
    for finding in found:
        assert set(finding.options) == {"turn_template"}
        with pytest.raises(ValueError, match="--turn-template"):
            track_file(scans, output, **options)
        options |= finding.options
    track_file(scans, output, **options)
    assert recording.error(output) < 1.1 * error_of_right_rig + 0.01


@pytest.mark.parametrize("stated", ["m", 0.5])
def test_a_wrong_unit_in_the_file_is_named_and_no_option_contradicts_it(
    stated: str | float, recording: Recording, tmp_path: Path
) -> None:
    cameras = recording.changed(in_other_unit(1000, 1000), tmp_path / "c.json", unit=stated)
    scans, template = recording.folder / "depth", recording.folder / "body.obj"
    words = ("track", scans, tmp_path / "o.npz", "--template", template, "--cameras", cameras)
    in_metres = (*words, "--template-unit", str(1.0 if stated == "m" else stated))
    told = run(*in_metres, "--remove-planes", code=1).stderr
    assert f"the unit of the scans is {'mm' if stated == 'm' else '0.0005'}" in told
    contradicted = run(*in_metres, "--scan-unit", "cm", code=1).stderr
    assert "c.json" in contradicted
    assert "0.01" in contradicted


def test_the_unit_that_is_asked_for_is_written(recording: Recording, tmp_path: Path) -> None:
    template, output = recording.folder / "body.obj", tmp_path / "out.npz"
    options: dict[str, Any] = {"scan_unit": "cm", "template_unit": "cm", "remove_planes": True}
    track_file(recording.folder / "depth", output, template=template, **options)
    with dynmesh.open(output) as reader:
        assert reader.header.metres_per_unit == 0.01


@pytest.mark.parametrize("number", [0, 2])
@pytest.mark.parametrize("what", ["longer", "shorter", "moved"])
def test_a_camera_with_a_wrong_focal_length_or_place_is_named(
    what: str, number: int, recording: Recording, tmp_path: Path
) -> None:
    def change(cameras: Cameras) -> None:
        camera = cameras[number]
        if what == "moved":
            away = np.random.default_rng(number).normal(size=3)
            size = np.linalg.norm(np.ptp(recording.truth.vertices[0], axis=0))
            for i, step in enumerate(0.05 * size * away / np.linalg.norm(away)):
                camera["camera_to_world"][i][3] += step
        else:
            for i in (0, 1):
                camera["intrinsics"][i][i] *= 1.08 if what == "longer" else 0.92

    cameras = recording.changed(change, tmp_path / "cameras.json")
    (finding,) = recording.diagnosis(cameras).findings
    assert finding.camera == str(number)
    assert what != "moved" or "pose" in finding.message
    if number == 0:
        scans, template = recording.folder / "depth", recording.folder / "body.obj"
        words = ("track", scans, tmp_path / "o.npz", "--template", template, "--cameras", cameras)
        assert finding.message in run(*words, "--remove-planes", code=3).stderr


@pytest.mark.parametrize("seed", range(6))
def test_nothing_is_wrong_with_a_right_rig(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    mesh = bumpy()
    vertices = turned(mesh.vertices, 0.1 * rng.random()) + 0.05 * rng.normal(size=3)
    around = degrade.orbit(
        vertices,
        int(rng.integers(1, 6)),
        degrees_per_frame=0,
        elevation=float(rng.uniform(0, 40)),
        distance=float(rng.uniform(1.2, 2.2)),
    )(0)
    (scan,) = degrade.depth_images(
        [vertices],
        mesh.faces,
        around,
        width=120,
        height=90,
        noise=float(rng.choice([0.02, 0.2])),
        flying=0.02,
        outliers=0.02,
        room=degrade.room_around(vertices) if seed % 2 else None,
        seed=seed,
    )
    rig = Rig(
        tuple(
            ScanCamera(str(i), pose_of(camera), intrinsics_of(camera, 120, 90), 1e-3)
            for i, camera in enumerate(around)
        )
    )
    with DepthFolder(tmp_path / "scans", rig) as folder:
        folder.append(scan)
    reader = open_scans(tmp_path / "scans")
    for template in (None, mesh.vertices):
        found = diagnose_rig(reader, Reading(), faces=mesh.faces, template=template)
        assert found.findings == ()


def test_an_unchecked_rig_is_tracked(recording: Recording, tmp_path: Path) -> None:
    cameras = recording.changed(swapped(0, 1), tmp_path / "cameras.json")
    template, output = recording.folder / "body.obj", tmp_path / "out.npz"
    scans = recording.folder / "depth"
    track_file(scans, output, template=template, cameras=cameras, check=False, remove_planes=True)
    assert recording.error(output) > 0.3


def test_a_camera_that_sees_nothing_is_named(recording: Recording, tmp_path: Path) -> None:
    scans = tmp_path / "depth"
    shutil.copytree(recording.folder / "depth", scans)
    recording.changed(
        lambda cameras: cameras.append(cameras[0] | {"name": "blind"}), scans / "cameras.json"
    )
    camera = read_cameras(scans / "cameras.json").cameras[-1]
    for number in range(len(recording.truth.vertices)):
        write_depth(scans / f"depth_{number:05d}_blind.png", np.zeros((120, 160)), camera)
    mesh = recording.truth
    reader = open_scans(scans)
    for template in (None, mesh.vertices[0]):
        found = diagnose_rig(reader, Reading(), faces=mesh.faces, template=template)
        assert [finding.camera for finding in found.findings] == ["blind"]
    words = ("track", scans, tmp_path / "o.npz", "--template", recording.folder / "body.obj")
    assert "'blind' sees nothing" in run(*words, "--remove-planes", code=3).stderr


@pytest.mark.parametrize("is_right", [True, False])
def test_the_page_of_a_rig_shows_cameras_and_what_is_wrong(
    is_right: bool, recording: Recording, tmp_path: Path, chromium: Any
) -> None:
    cameras = recording.changed(
        (lambda _: None) if is_right else swapped(0, 1), tmp_path / "cameras.json"
    )
    output, template = tmp_path / "rig.html", recording.folder / "body.obj"
    words = ("rig", recording.folder / "depth", "--template", template, "--cameras", cameras)
    told = run(*words, "-o", output, code=0 if is_right else 3).stderr
    assert ("--swap-cameras" in told) != is_right
    page = chromium.new_page()
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(output.as_uri())
    page.wait_for_selector("#rig")
    shown = page.inner_text("#rig")
    assert ("--swap-cameras" in shown) != is_right
    assert page.locator("#rig tr").count() == 5
    objects = page.evaluate(
        "(async () => Object.values((await K3DInstance).getWorld().ObjectsListJson)"
        ".map((one) => one.type))()"
    )
    assert {name: objects.count(name) for name in set(objects)} == {
        "Points": 4,
        "Lines": 5,
        "Mesh": 1,
    }
    assert complaints == []
    assert run(*words, "-o", output, code=1).stderr.count("exists already") == 1
    bare = run("rig", recording.folder / "depth", "-o", tmp_path / "bare.html").stderr
    assert "with a template" in bare


def test_the_page_begins_with_everything_in_sight(
    recording: Recording, tmp_path: Path, chromium: Any
) -> None:
    """Also without cameras, whose places enlarge what is shown."""
    points = recording.truth.vertices[0] * np.array([1, 1, 4.0])
    write_ply(tmp_path / "s_0.ply", PointScan(points, None, None))
    run("rig", tmp_path / "s_0.ply", "-o", tmp_path / "rig.html")
    page = chromium.new_page(viewport={"width": 600, "height": 600})
    page.goto((tmp_path / "rig.html").as_uri())
    page.wait_for_selector("#rig")
    page.wait_for_function("K3DInstance.then(() => true)")
    page.evaluate("document.querySelector('#rig').remove()")
    page.wait_for_timeout(500)
    shown = np.array(Image.open(io.BytesIO(page.screenshot())).convert("L"))
    assert (shown < 200).sum() > 500
    for border in (shown[:3], shown[-3:], shown[:, :3], shown[:, -3:]):
        assert border.min() > 250


def alone(recording: Recording, cameras: Path | None) -> list[RigFinding]:
    """What is found without a template."""
    reader = RigOptions(cameras=cameras).checked().open(recording.folder / "depth")
    return list(diagnose_rig(reader, Reading()).findings)


# In a scan of a room, these change how the cameras lie to each other.
BETWEEN_CAMERAS = sorted(set(MISTAKES) - {"millimetres"})


@pytest.mark.parametrize("mistake", BETWEEN_CAMERAS)
def test_cameras_that_contradict_each_other_are_named_without_a_template(
    mistake: str, recording: Recording, tmp_path: Path
) -> None:
    assert alone(recording, None) == []
    change, expected = MISTAKES[mistake]
    (finding,) = alone(recording, recording.changed(change, tmp_path / "cameras.json"))
    assert set(finding.options) == expected - {"scan_unit", "template_unit"}


@pytest.mark.parametrize("number", [0, 2])
def test_a_camera_that_is_off_is_named_without_a_template(
    number: int, recording: Recording, tmp_path: Path
) -> None:
    def elsewhere(cameras: Cameras) -> None:
        cameras[number]["camera_to_world"][1][3] += 0.2

    def longer(cameras: Cameras) -> None:
        for i in (0, 1):
            cameras[number]["intrinsics"][i][i] *= 1.08

    for change, what in ((elsewhere, "pose"), (longer, "focal length")):
        (finding,) = alone(recording, recording.changed(change, tmp_path / "cameras.json"))
        assert finding.camera == str(number)
        assert what in finding.message


def test_what_cannot_be_known_without_a_template_is_not_said(
    recording: Recording, tmp_path: Path
) -> None:
    """One camera, and two that see nothing in common; other units and places of the whole rig."""

    def turned_and_larger(cameras: Cameras) -> None:
        motion = np.block([[turned(np.eye(3), 0.7), np.ones((3, 1))], [np.eye(4)[3]]])
        for camera in cameras:
            camera["camera_to_world"] = (motion @ camera["camera_to_world"]).tolist()
        in_other_unit(1000, 1000)(cameras)

    assert alone(recording, recording.changed(turned_and_larger, tmp_path / "a.json")) == []
    for kept in ([0], [0, 2]):

        def some(cameras: Cameras, kept: list[int] = kept) -> None:
            cameras[:] = [cameras[i] for i in kept]

        assert alone(recording, recording.changed(some, tmp_path / "b.json")) == []


def test_the_page_leaves_out_what_tracking_would(recording: Recording, tmp_path: Path) -> None:
    scans, output = recording.folder / "depth", tmp_path / "rig.html"
    words: tuple[str | Path, ...] = ("rig", scans, "-o", output, "--overwrite")
    template = ("--template", recording.folder / "body.obj")
    shares = []
    for options in ((*template, "--remove-planes"), (*template, "--crop", "0.2"), ("--crop", BOX)):
        head, *rows = run(*words, *options).stderr.splitlines()[:5]
        assert head.split()[-1] == "left"
        shares.append([int(row.split()[-2]) for row in rows])
    assert np.min(shares) > 1
    assert np.max(shares) < 50
    for refused in (("--remove-planes",), ("--crop", "0.2")):
        assert "--template" in run(*words, *refused, code=1).stderr


BOX = "-2,-2,-2,2,2,2"


def test_intrinsics_may_be_four_numbers(recording: Recording, tmp_path: Path) -> None:
    def change(cameras: Cameras) -> None:
        for camera in cameras:
            (fx, _, cx), (_, fy, cy), _ = camera.pop("intrinsics")
            camera |= {"fx": fx, "fy": fy, "cx": cx, "cy": cy}

    expected = read_cameras(recording.folder / "depth" / "cameras.json").cameras
    found = read_cameras(recording.changed(change, tmp_path / "a.json")).cameras
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one.intrinsics, other.intrinsics)
    for spoil in (
        lambda c: c[1].pop("intrinsics") and c[1].update(fx=5.0),
        lambda c: c[1].update(cy=1),
    ):
        with pytest.raises(ValueError, match=r"camera 1: (fy: is missing|intrinsics: are given)"):
            read_cameras(recording.changed(spoil, tmp_path / "b.json"))


def test_tracking_goes_on_without_damaged_images(recording: Recording, tmp_path: Path) -> None:
    scans = tmp_path / "depth"
    shutil.copytree(recording.folder / "depth", scans)
    damaged = scans / "depth_00000_1.png"
    damaged.write_bytes(damaged.read_bytes()[:-20])
    words = ("track", scans, tmp_path / "o.npz", "--template", recording.folder / "body.obj")
    assert damaged.name in run(*words, "--remove-planes").stderr
    assert recording.error(tmp_path / "o.npz") < 0.3


def test_an_empty_room_is_recognised(tmp_path: Path) -> None:
    mesh = bumpy()
    vertices = mesh.vertices
    around = degrade.orbit(vertices, 2)(0)
    rig = Rig(
        tuple(
            ScanCamera(str(i), pose_of(camera), intrinsics_of(camera, 120, 90), 1e-3)
            for i, camera in enumerate(around)
        )
    )
    room = degrade.room_around(vertices)
    # What is left of the subject is smaller than a pixel.
    gone = vertices.mean(axis=0) + 1e-6 * (vertices - vertices.mean(axis=0))
    (scan,) = degrade.depth_images([gone], mesh.faces, around, width=120, height=90, room=room)
    with DepthFolder(tmp_path / "scans", rig) as folder:
        folder.append(scan)
    reader = open_scans(tmp_path / "scans")
    found = diagnose_rig(reader, Reading(), faces=mesh.faces, template=vertices)
    assert len(found.findings) == 1
    assert "the room is empty" in found.findings[0].message
