"""Tracking from files of scans: the command, interruptions, units, alignment, and the examples."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import to_file
from browser import Page, in_colour
from commands import dynmesh_command as run
from conftest import REPOSITORY
from meshes import Array, turned
from numpy.typing import NDArray
from scan_files import error, moving_body, opened

import dynmesh
from dynmesh.draw.page import page
from dynmesh.formats.writing import Place
from dynmesh.scans import (
    DepthScan,
    PointScan,
    Rig,
    ScanReader,
    read_cameras,
    write_ply,
)

N_FRAMES = 6
TRUTH = moving_body(N_FRAMES)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The truth, its first frame, and scans of both kinds."""
    made = tmp_path_factory.mktemp("scans")
    dynmesh.write(made / "truth.npz", TRUTH)
    dynmesh.write(made / "body.obj", TRUTH[:1])
    run("degrade", made / "truth.npz", made / "points", "--scan", "--points", "1500")
    run("degrade", made / "truth.npz", made / "depth", "--depth", "120x90")
    return made


@pytest.mark.parametrize("scans", ["points", "depth"])
def test_the_command_tracks_what_was_scanned(scans: str, folder: Path, tmp_path: Path) -> None:
    output = tmp_path / "tracked.npz"
    told = run("track", folder / scans, output, "--template", folder / "body.obj", "--provenance")
    assert f"{N_FRAMES} frames tracked" in told.stderr
    tracked: Any = dynmesh.read(output)
    assert error(tracked, TRUTH).max() < 0.5
    assert 0.5 < (tracked.generation == 0).mean() <= 1
    np.testing.assert_array_equal(tracked.faces, TRUTH.faces)
    assert tracked.up_axis == "z"


def test_a_training_and_standard_errors_of_a_file(folder: Path, tmp_path: Path) -> None:
    training, output = tmp_path / "training.npz", tmp_path / "out.npz"
    dynmesh.write(training, TRUTH)
    words = ("track", folder / "points", output, "--template", folder / "body.obj")
    told = run(*words, "--training", training, "--uncertainty")
    assert "the prior weight of the training frames was" in told.stderr
    tracked: Any = dynmesh.read(output)
    first = TRUTH.faces, dynmesh.read(folder / "body.obj").vertices[0]
    tracker = dynmesh.Tracker(*first, training=TRUTH.vertices, uncertainty=True)
    assert tracked.standard_error_of == "surface"
    for n, scan in enumerate(opened(folder / "points")):
        expected = tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
        np.testing.assert_array_equal(tracked.vertices[n], expected)
        np.testing.assert_allclose(tracked.standard_error[n], tracker.standard_error, rtol=1e-6)
    run(*words, "--training", training, "--provenance", "--overwrite")
    assert dynmesh.read(output).standard_error is None


@pytest.mark.parametrize("command", ["track", "register"])
def test_what_is_beside_the_frames_is_written_with_them_or_not_at_all(
    command: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    beside, out, body = tmp_path / "beside.csv", tmp_path / "out.npz", folder / "body.obj"
    words: list[Any] = ["track", folder / "points", out, "--template", body, "--csv", beside]
    if command == "register":
        beside = tmp_path / "beside.html"
        words = ["register", body, folder / "points" / "frame_00000.ply", out, "--page", beside]

    def fail(*_: object) -> None:
        raise OSError("the disk is full")

    with monkeypatch.context() as patched:
        patched.setattr(Place, "fill", fail)
        assert "the disk is full" in run(*words, code=1).stderr
    assert [*tmp_path.iterdir()] == []
    run(*words)
    assert {*tmp_path.iterdir()} == {out, beside}
    beside.write_text("of another program")
    out.unlink()
    assert f"{beside.name}: exists already" in run(*words, code=1).stderr
    assert not out.exists()  # it was refused before any work
    assert beside.read_text() == "of another program"
    run(*words, "--overwrite")
    assert beside.read_text() != "of another program"


@pytest.mark.parametrize("scans", ["points", "depth"])
def test_tracked_frames_never_come_among_the_scans(
    scans: str, folder: Path, tmp_path: Path
) -> None:
    """Frames in another format would make a folder of scans unreadable."""
    (tmp_path / "linked").symlink_to(folder / scans)
    before = sorted((folder / scans).iterdir())
    tracked = dynmesh.track(folder / scans, template=folder / "body.obj")
    for output in (folder / scans, tmp_path / "linked"):
        for name in ("tracked_%d.ply", "tracked_%d.obj", ""):
            with pytest.raises(
                ValueError, match=r"is in the folder of the input|write to a folder"
            ):
                tracked.write(output / name, format=None if name else "ply")
    assert sorted((folder / scans).iterdir()) == before


def test_a_mesh_that_is_lost_is_registered_anew(tmp_path: Path) -> None:
    """Between two frames, the subject turns by 120 degrees."""
    walker = dynmesh.synth.walker()
    frames = walker.vertices[:4].copy()
    frames[2:] = frames[2:][..., [1, 2, 0]]
    jumping = dynmesh.Sequence(frames, walker.faces, up_axis="z")
    dynmesh.write(tmp_path / "jumping.npz", jumping)
    dynmesh.write(tmp_path / "body.obj", jumping[:1])
    scans = tmp_path / "scans"
    run("degrade", tmp_path / "jumping.npz", scans, "--scan", "--points", "8000")
    report = to_file.track(scans, tmp_path / "out.npz", template=tmp_path / "body.obj")
    assert report.recovered == 1
    assert error(dynmesh.read(tmp_path / "out.npz"), jumping).max() < 1
    lost = tmp_path / "lost.npz"
    run("track", scans, lost, "--template", tmp_path / "body.obj", "--no-recover", code=3)
    assert error(dynmesh.read(lost), jumping)[2:].min() > 5


def test_lost_and_empty_scans_are_carried_on(folder: Path, tmp_path: Path) -> None:
    """One is missing, one has two points, and one has none."""
    scans = tmp_path / "some"
    scans.mkdir()
    for number, scan in enumerate(opened(folder / "points"), 10):
        if number in (13, 14):
            left = {13: 2, 14: 0}[number]
            scan = PointScan(scan.points[:left], scan.points[:left] * 0, None)
        if number != 12:
            write_ply(scans / f"s_{number}.ply", scan)
    with pytest.raises(ValueError, match=r"s_12\.ply is missing"):
        to_file.track(scans, tmp_path / "out.npz", template=folder / "body.obj")
    report = to_file.track(scans, tmp_path / "out.npz", template=folder / "body.obj", gaps="lost")
    assert (report.frames, report.empty, report.quality) == (N_FRAMES, 2, "good")
    assert any(f"{N_FRAMES - 2} frames tracked" in line for line in report.lines())
    assert len(report.remarks) == 1
    assert report.remarks[0].endswith("frames 12, 13, 14")
    tracked = dynmesh.read(tmp_path / "out.npz")
    assert np.isfinite(tracked.vertices).all()
    assert (tracked.start, tracked.times) == (10, None)
    for file in scans.glob("s_1[15].ply"):
        write_ply(file, PointScan(np.zeros((0, 3)), np.zeros((0, 3)), None))
    words = ("track", scans, tmp_path / "few.npz", "--template", folder / "body.obj")
    told = run(*words, "--gaps", "lost", "--quiet", code=3).stderr
    assert "doubtful: hardly anything was measured of most frames" in told


def test_a_template_is_sought_in_the_first_scan_with_an_extent(folder: Path) -> None:
    """A single point, also if it is measured twice, does not tell where a mesh is."""
    scans = [(s.points, s.normals) for s in opened(folder / "points")]
    dot = np.repeat(scans[0][0][:1], 2, axis=0)
    away = replace(TRUTH[:1], vertices=TRUTH.vertices[:1] + 7)
    result = dynmesh.track([dot[:1], dot, None, *scans], template=away)
    assert (result.report.quality, result.report.empty) == ("good", 1)
    assert error(result[3:], TRUTH).max() < 1


def test_scans_whose_normals_point_inwards_are_refused() -> None:
    """Such points belong to no vertex, and so contradict none in a first frame."""
    body = TRUTH[:2]
    scans = [*dynmesh.losses.scan_points(body.vertices, body.faces, points=2000)]
    turned = [(scan.points, -np.asarray(scan.normals)) for scan in scans]
    with pytest.raises(ValueError, match=r"the normals of the scan point inwards; turn them"):
        dynmesh.track(turned, template=body[:1])
    assert dynmesh.track(scans, template=body[:1]).report.quality == "good"


def test_a_doubtful_result_is_that_of_the_scans(folder: Path) -> None:
    """Not of the template, which is what it was."""
    first, *later = opened(folder / "points")
    scans = [first, *(scan._replace(points=scan.points + 9) for scan in later)]
    with pytest.warns(dynmesh.DoubtfulWarning, match=r"^scans: (doubtful|probably ruined): "):
        dynmesh.track(scans, template=TRUTH[:1], recover=False)


def test_landmarks_count_where_the_template_lies_in_the_scan(folder: Path, tmp_path: Path) -> None:
    marks = [{"vertex": v, "position": TRUTH.vertices[0, v].tolist()} for v in (0, 100, 200)]
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    report: Any = to_file.track(
        folder / "points",
        tmp_path / "out.npz",
        template=folder / "body.obj",
        landmarks=tmp_path / "marks.json",
    )
    assert report.quality == "good"


@pytest.mark.parametrize("scans", ["points", "depth"])
def test_a_template_elsewhere_in_another_unit_is_moved_into_the_scan(
    scans: str, folder: Path, tmp_path: Path
) -> None:
    template, output = tmp_path / "moved_mm.npz", tmp_path / "out.npz"
    moved = 1000 * (turned(TRUTH.vertices[0], 0.7) + np.array([9.0, 2, 4]))
    dynmesh.write(template, replace(TRUTH[:1], vertices=moved[None], metres_per_unit=0.001))
    told = run("track", folder / scans, output, "--template", template, "--scan-unit", "m").stderr
    assert "registered with it: good" in told, told
    tracked = dynmesh.read(output)
    assert tracked.metres_per_unit == 0.001
    assert error(replace(tracked, vertices=tracked.vertices / 1000), TRUTH).max() < 0.5


def test_a_scan_of_a_part_is_doubtful_where_the_template_is_put_into_it(
    folder: Path, tmp_path: Path
) -> None:
    (tmp_path / "scans").mkdir()
    for number, scan in enumerate(opened(folder / "points")):
        part = scan.only(scan.points[:, 2] > np.median(scan.points[:, 2]))
        write_ply(tmp_path / "scans" / f"frame_{number:05}.ply", part, None)
    dynmesh.write(tmp_path / "moved.npz", replace(TRUTH[:1], vertices=TRUTH.vertices[:1] + 9))
    report = to_file.track(
        tmp_path / "scans", tmp_path / "out.npz", template=tmp_path / "moved.npz"
    )
    assert report.quality == "doubtful"
    assert "a part of the template only" in report.reason


@pytest.fixture(scope="module")
def in_millimetres(folder: Path) -> Path:
    """The truth in metres, and scans in millimetres that do and do not state it."""
    dynmesh.write(folder / "metres.npz", replace(TRUTH, metres_per_unit=1.0))
    for name, unit in (("stated", 0.001), ("unstated", None)):
        (folder / name).mkdir()
        for number, scan in enumerate(opened(folder / "points")):
            scan = PointScan(scan.points * 1000, scan.normals, None)
            write_ply(folder / name / f"frame_{number:05}.ply", scan, unit)
    return folder


@pytest.mark.parametrize(
    ("mesh", "scans", "unit"),
    [("truth", "points", None), ("metres", "stated", None), ("metres", "unstated", "mm")],
)
def test_the_page_shows_the_scans(
    mesh: str, scans: str, unit: str | None, in_millimetres: Path, browser: Any
) -> None:
    folder = in_millimetres
    with dynmesh.open(folder / f"{mesh}.npz") as reader:
        made = page(reader, scans=opened(folder / scans), scan_unit=unit, colour="plain")
        file = folder / "page.html"
        file.write_text(made.html)
        fewer = opened(folder / "points" / "frame_0000[0-3].ply")
        with pytest.raises(ValueError, match="has 4, and none of the numbers 4, 5"):
            page(reader, scans=fewer)
    shown = Page(browser, file)
    assert shown.captions() == [f"scans: {scans}", f"{mesh}.npz"]
    shown.scrub(0)
    dots, surface = shown.pictures(0, 1)
    blue = dots[..., 2] - dots[..., 0] > 60
    assert 200 < blue.sum() < in_colour(surface).sum()
    assert (in_colour(dots) & ~in_colour(surface)).sum() < 0.05 * in_colour(surface).sum()
    assert shown.complaints == []


class Pipe(NamedTuple):
    """Depth frames as cameras deliver them, and what becomes of them."""

    raw: bytes
    rig: Rig
    tracked: NDArray[np.float32]


@pytest.fixture(scope="module")
def pipe(folder: Path) -> Pipe:
    rig = read_cameras(folder / "depth" / "cameras.json")
    reader: ScanReader = opened(folder / "depth")
    scans = [scan for scan in reader if isinstance(scan, DepthScan)]
    assert len(scans) == N_FRAMES
    raw = b"".join(
        np.rint(depth / np.float64(camera.depth_scale or 1)).astype("<u2").tobytes()
        for scan in scans
        for depth, camera in zip(scan.depth, rig.cameras, strict=True)
    )
    template = dynmesh.read(folder / "body.obj")
    tracker = dynmesh.Tracker(template.faces, template.vertices[0].astype(np.float32))
    tracked = [tracker.push_depth(scan.depth, scan.intrinsics, scan.poses) for scan in scans]
    return Pipe(raw, rig, np.stack(tracked))


def test_the_example_tracks_depth_frames_from_a_pipe(folder: Path, pipe: Pipe) -> None:
    command = [
        sys.executable, str(REPOSITORY / "examples" / "python" / "track_live.py"),
        str(folder / "body.obj"), str(folder / "depth" / "cameras.json"),
    ]  # fmt: skip
    ended = subprocess.run(command, input=pipe.raw, capture_output=True, check=False)
    assert ended.returncode == 0, ended.stderr.decode()
    assert ended.stderr.decode().count(" ms, ") == N_FRAMES
    found = np.frombuffer(ended.stdout, "<f4").reshape(N_FRAMES, -1, 3)
    np.testing.assert_array_equal(found, pipe.tracked)
    cut = subprocess.run(command, input=pipe.raw[:-2], capture_output=True, check=False)
    assert cut.returncode == 1
    assert b"the pipe ends in an image of camera 3" in cut.stderr


def test_the_example_in_c_reads_the_same_frames(
    programs: Path, folder: Path, pipe: Pipe, tmp_path: Path
) -> None:
    """And the cameras from a plainer file. A refused frame does not end the stream."""
    numbers = np.array([
        (*camera.size, camera.depth_scale, *np.ravel(camera.intrinsics),
         *np.ravel(camera.camera_to_world))
        for camera in pipe.rig.cameras
        if camera.size is not None and camera.intrinsics is not None
    ], float)  # fmt: skip
    assert numbers.shape[1] == 28

    def track(cameras: Any) -> tuple[str, Array]:
        file = tmp_path / "cameras.txt"
        np.savetxt(file, cameras, fmt="%.17g")
        command = [programs / "examples" / "c" / "track_stream", folder / "body.obj", file]
        ended = subprocess.run(command, input=pipe.raw, capture_output=True, check=True, timeout=60)
        return ended.stderr.decode(), np.frombuffer(ended.stdout, "<f4").reshape(N_FRAMES, -1, 3)

    told, found = track(numbers)
    assert told.startswith("6 frames tracked; ")
    np.testing.assert_array_equal(found, pipe.tracked)
    numbers[:, 2] *= -1  # depths below 0 are refused
    told, found = track(numbers)
    assert told.startswith("frame 0: depth")
    template = dynmesh.read(folder / "body.obj").vertices[0].astype(np.float32)
    np.testing.assert_array_equal(found, np.broadcast_to(template, found.shape))


@pytest.fixture(scope="module")
def walking(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Scans of the walker, and as the template a frame in which it stands otherwise, elsewhere."""
    made = tmp_path_factory.mktemp("walking")
    walker = dynmesh.synth.walker()
    dynmesh.write(made / "truth.npz", walker[:3])
    run("degrade", made / "truth.npz", made / "scans", "--scan", "--points", "6000")
    other = turned(walker.vertices[140], 0.5) + np.array([7.0, 1, 3])
    dynmesh.write(made / "body.npz", replace(walker[:1], vertices=other[None]))
    tips = [3079, 9956, 7629, 16, 6201, 3776]  # of the limbs
    landmarks = [{"vertex": v, "position": walker.vertices[0][v].tolist()} for v in tips]
    (made / "tips.json").write_text(json.dumps(landmarks))
    return made


def test_a_template_in_another_pose_is_registered_with_landmarks(
    walking: Path, tmp_path: Path
) -> None:
    output = tmp_path / "out.npz"
    words = ("track", walking / "scans", output, "--template", walking / "body.npz")
    told = run(*words, "--landmarks", walking / "tips.json").stderr
    assert "did not lie in the first scan and was registered with it: good" in told
    truth = dynmesh.read(walking / "truth.npz")
    assert error(dynmesh.read(output), truth).max() < 1.5


def test_a_template_in_another_step_is_registered(walking: Path, tmp_path: Path) -> None:
    """A rigid motion brings it so near that a tracker would need many frames for the rest."""
    dynmesh.write(tmp_path / "body.npz", dynmesh.synth.walker()[10:11])
    to_file.track(walking / "scans", tmp_path / "out.npz", template=tmp_path / "body.npz")
    truth = dynmesh.read(walking / "truth.npz")
    assert error(dynmesh.read(tmp_path / "out.npz"), truth).max() < 1.5
