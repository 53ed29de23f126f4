"""Tracking from files of scans: the command, interruptions, units, alignment, and the examples."""

import json
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import trimesh
from browser import Page, in_colour
from commands import dynmesh_command as run
from conftest import REPOSITORY
from meshes import Array, Mesh, turned
from numpy.typing import NDArray
from sequences import assert_same

import dynmesh
from dynmesh import degrade
from dynmesh.draw.page import page
from dynmesh.files.lock import unfinished_folder
from dynmesh.files.scans import (
    DepthScan,
    PointScan,
    Rig,
    Scan,
    ScanReader,
    open_scans,
    read_cameras,
    write_ply,
)
from dynmesh.jobs.checkpoint import Checkpoint
from dynmesh.jobs.tracking import track_file

N_FRAMES = 6


@pytest.fixture(scope="module")
def truth() -> dynmesh.Sequence:
    """A body with bumps that moves and turns."""
    mesh = bumpy()
    frames = [turned(mesh.vertices, 0.02 * i) + 0.01 * i for i in range(N_FRAMES)]
    return dynmesh.Sequence(np.stack(frames), mesh.faces, up_axis="z")


def bumpy() -> Mesh:
    """A smooth closed body without symmetries."""
    sphere = trimesh.creation.icosphere(subdivisions=3)
    x, y, z = np.asarray(sphere.vertices, np.float64).T
    radii = 1 + 0.25 * np.sin(3 * x + 1) * np.cos(2 * y) + 0.2 * np.sin(2.5 * z + x)
    vertices = np.stack([1.3 * x, y, 0.7 * z], axis=1) * radii[:, None]
    return Mesh(np.asarray(sphere.faces, np.int64), vertices)


@pytest.fixture(scope="module")
def folder(truth: dynmesh.Sequence, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The truth, its first frame, and scans of both kinds."""
    made = tmp_path_factory.mktemp("scans")
    dynmesh.write(made / "truth.npz", truth)
    dynmesh.write(made / "body.obj", truth[:1])
    run("degrade", made / "truth.npz", made / "points", "--scan", "--points", "1500")
    run("degrade", made / "truth.npz", made / "depth", "--depth", "120x90")
    return made


@pytest.mark.parametrize("kind", [["--scan", "--points", "200"], ["--depth", "40x30"]])
def test_equal_seeds_make_equal_files(kind: list[str], folder: Path, tmp_path: Path) -> None:
    def made(*options: str) -> dict[str, bytes]:
        faults = ["--noise", "0.1", "--flying", "5%", "--outliers", "2%", "--known", "90%"]
        output = tmp_path / "scans"
        run("degrade", folder / "truth.npz", output, *kind, *faults, "--overwrite", *options)
        return {file.name: file.read_bytes() for file in output.iterdir()}

    first = made()
    assert len(first) == 1 + N_FRAMES * (1 if "--scan" in kind else 4)
    assert made() == first
    other = made("--seed", "1")
    assert [name for name in first if first[name] == other[name]] == ["cameras.json"]
    assert len(made("--cameras", "1")) == 1 + N_FRAMES
    assert [path.name for path in tmp_path.iterdir()] == ["scans"]


def mean_edge(truth: dynmesh.Sequence) -> float:
    a, b, c = truth.vertices[0][truth.faces.T]
    return float(np.mean([np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))]))


def error(tracked: dynmesh.Sequence, truth: dynmesh.Sequence) -> Array:
    """The mean distance from the true vertex in each frame, in mean edges."""
    distances = np.linalg.norm(tracked.vertices - truth.vertices, axis=2)
    return np.asarray(distances.mean(axis=1) / mean_edge(truth))


@pytest.mark.parametrize("scans", ["points", "depth"])
def test_the_command_tracks_what_was_scanned(
    scans: str, folder: Path, truth: dynmesh.Sequence, tmp_path: Path
) -> None:
    output = tmp_path / "tracked.npz"
    told = run("track", folder / scans, output, "--template", folder / "body.obj", "--provenance")
    assert f"{N_FRAMES} frames tracked" in told.stderr
    tracked = dynmesh.read(output)
    assert error(tracked, truth).max() < 0.5
    assert tracked.generation is not None
    assert 0.5 < (tracked.generation == 0).mean() <= 1
    np.testing.assert_array_equal(tracked.faces, truth.faces)
    assert tracked.up_axis == "z"


def test_a_file_is_tracked_as_the_tracker_tracks(folder: Path, tmp_path: Path) -> None:
    track_file(folder / "points", tmp_path / "out.npz", template=folder / "body.obj")
    tracked = dynmesh.read(tmp_path / "out.npz").vertices
    template = dynmesh.read(folder / "body.obj")
    tracker = dynmesh.Tracker(template.faces, template.vertices[0])
    for scan, frame in zip(open_scans(folder / "points"), tracked, strict=True):
        assert isinstance(scan, PointScan)
        expected = tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
        np.testing.assert_array_equal(frame, expected)


def test_a_training_and_standard_errors_of_a_file(
    folder: Path, truth: dynmesh.Sequence, tmp_path: Path
) -> None:
    training, output = tmp_path / "training.npz", tmp_path / "out.npz"
    dynmesh.write(training, truth)
    words = ("track", folder / "points", output, "--template", folder / "body.obj")
    told = run(*words, "--training", training, "--uncertainty", "--provenance")
    assert "the prior weight of the training frames was" in told.stderr
    tracked = dynmesh.read(output)
    template = dynmesh.read(folder / "body.obj")
    tracker = dynmesh.Tracker(
        template.faces, template.vertices[0], training=truth.vertices, uncertainty=True
    )
    assert tracked.standard_error is not None
    assert tracked.standard_error_of == "surface"
    for n, scan in enumerate(open_scans(folder / "points")):
        assert isinstance(scan, PointScan)
        expected = tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
        np.testing.assert_array_equal(tracked.vertices[n], expected)
        np.testing.assert_allclose(tracked.standard_error[n], tracker.standard_error, rtol=1e-6)
    again = run(*words, "--training", training, "--provenance", "--resume", "--overwrite")
    assert dynmesh.read(output).standard_error is None, again.stderr


@pytest.mark.parametrize("format", ["npz", "ply"])
def test_an_interrupted_run_is_continued(
    format: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Checkpoint, "least_seconds_between", 0.0)
    monkeypatch.setattr(Checkpoint, "most_of_the_time", 1e9)
    template = folder / "body.obj"
    whole, output = (
        tmp_path / (f"{name}_%04d.ply" if format == "ply" else f"{name}.{format}")
        for name in ("whole", "out")
    )
    track_file(folder / "points", whole, template=template)

    def stopping(scans: Iterator[Scan | None], n: int, done: int) -> Iterator[Scan | None]:
        assert (n, done) == (N_FRAMES, 0)
        for number, scan in enumerate(scans):
            if number == 3:
                raise KeyboardInterrupt
            yield scan

    with pytest.raises(KeyboardInterrupt):
        track_file(folder / "points", output, template=template, watch=stopping)
    assert (unfinished_folder(output) / "checkpoint.npz").exists()
    report = track_file(folder / "points", output, template=template, resume=True)
    assert report.resumed_at == 3
    assert_same(dynmesh.read(output), dynmesh.read(whole))
    again = track_file(folder / "points", output, template=template, resume=True)
    assert again.existed


@pytest.mark.usefixtures("hearing_interrupts")
@pytest.mark.parametrize("scans", ["points", "depth"])
def test_an_early_interrupt_keeps_every_frame(scans: str, folder: Path, tmp_path: Path) -> None:
    """Long before the first checkpoint is due; the frame that was being tracked is finished."""
    template, output = folder / "body.obj", tmp_path / "out.npz"
    track_file(folder / scans, tmp_path / "whole.npz", template=template)

    def stopping(scans: Iterator[Scan | None], *_: int) -> Iterator[Scan | None]:
        for number, scan in enumerate(scans):
            if number == 2:
                signal.raise_signal(signal.SIGINT)
            yield scan

    with pytest.raises(KeyboardInterrupt):
        track_file(folder / scans, output, template=template, watch=stopping)
    report = track_file(folder / scans, output, template=template, resume=True)
    assert report.resumed_at == 3
    assert output.read_bytes() == (tmp_path / "whole.npz").read_bytes()
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["out.npz", "whole.npz"]


@pytest.mark.usefixtures("hearing_interrupts")
def test_an_early_interrupt_of_the_command_says_what_is_kept(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    push, calls = dynmesh.jobs.tracking._Tracking._push, 0

    def pressing(self: Any, scan: Scan | None) -> Any:
        nonlocal calls
        calls += 1
        if calls == 2:
            signal.raise_signal(signal.SIGINT)
        return push(self, scan)

    monkeypatch.setattr(dynmesh.jobs.tracking._Tracking, "_push", pressing)
    words = ("track", folder / "points", tmp_path / "out.npz", "--template", folder / "body.obj")
    told = run(*words, code=130).stderr
    assert "tracked frames are kept; --resume continues from there" in told
    assert "continued after 2 frames" in run(*words, "--resume").stderr


def test_another_template_is_another_job(
    folder: Path, truth: dynmesh.Sequence, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Checkpoint, "least_seconds_between", 0.0)
    monkeypatch.setattr(Checkpoint, "most_of_the_time", 1e9)
    output, other = tmp_path / "out.npz", tmp_path / "other.npz"
    dynmesh.write(other, truth[1:2])

    def stopping(scans: Iterator[Scan | None], *_: int) -> Iterator[Scan | None]:
        yield next(scans)
        yield next(scans)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        track_file(folder / "points", output, template=folder / "body.obj", watch=stopping)
    with pytest.raises(
        ValueError, match=r"of another job: template changed \(it was .*body\.obj, now"
    ):
        track_file(folder / "points", output, template=other, resume=True)
    cameras = tmp_path / "rig.json"
    cameras.write_bytes((folder / "points" / "cameras.json").read_bytes())
    (tmp_path / "points").mkdir()
    for file in (folder / "points").iterdir():
        (tmp_path / "points" / file.name).write_bytes(file.read_bytes())
    ours = folder / "points" / "cameras.json"
    kept = sorted(unfinished_folder(output).rglob("*"))
    for scans, options, what in (
        (folder, ("--cameras", cameras), f"cameras changed (it was {ours}, now it is {cameras})"),
        (folder, ("--uncertainty",), "uncertainty changed (it was false, now it is true)"),
        (folder, ("--no-align",), "align changed (it was auto, now it is never)"),
        (folder, ("--provenance",), "provenance changed (it was false, now it is true)"),
        (folder, ("--gaps", "lost"), "gaps changed (it was refuse, now it is lost)"),
        (folder, ("--fps", "25"), "fps changed (it was not given, now it is 25.0)"),
        (folder, ("--training", other), f"training changed (it was not given, now it is {other}"),
        (
            folder,
            ("--scan-unit", "mm", "--template-unit", "m"),
            "scan_unit changed (it was not given, now it is 0.001); template_unit changed",
        ),
        (tmp_path, (), f"input changed (it was {folder / 'points' / 'frame_00000.ply'}, now it is"),
    ):
        words = ("track", scans / "points", output, "--template", folder / "body.obj", "--resume")
        told = run(*words, *options, code=1).stderr
        assert what in told
        assert "run without --resume to start again, or write another output" in told
    assert sorted(unfinished_folder(output).rglob("*")) == kept
    report = track_file(folder / "points", output, template=folder / "body.obj", resume=True)
    assert report.resumed_at > 0
    # Of the complete output, its own content is all that is known.
    words = ("track", folder / "points", output, "--template", folder / "body.obj", "--resume")
    told = run(*words, "--provenance", code=1).stderr
    what = "provenance changed (it was false, now it is true)"
    assert f"out.npz: is complete, but of another job: {what}" in told
    assert "already complete" in run(*words).stderr
    run(*words, "--provenance", "--overwrite")
    told = run(*words, "--provenance", "--uncertainty", code=1).stderr
    assert "uncertainty changed (it was false, now it is true)" in told


def test_lost_and_empty_scans_are_carried_on(folder: Path, tmp_path: Path) -> None:
    scans = tmp_path / "some"
    scans.mkdir()
    for number, scan in enumerate(open_scans(folder / "points")):
        assert isinstance(scan, PointScan)
        if number == 4:
            scan = PointScan(scan.points[:0], scan.points[:0], None)
        if number != 2:
            write_ply(scans / f"s_{number}.ply", scan)
    with pytest.raises(ValueError, match=r"s_2\.ply is missing"):
        track_file(scans, tmp_path / "out.npz", template=folder / "body.obj")
    report = track_file(scans, tmp_path / "out.npz", template=folder / "body.obj", gaps="lost")
    assert (report.frames, report.empty) == (N_FRAMES, 2)
    assert np.isfinite(dynmesh.read(tmp_path / "out.npz").vertices).all()


def test_intrinsics_of_another_image_size_are_suspected(folder: Path, tmp_path: Path) -> None:
    told = json.loads((folder / "depth" / "cameras.json").read_text())
    for camera in told["cameras"]:
        camera["intrinsics"] = (np.diag([5.0, 5, 1]) @ camera["intrinsics"]).tolist()
    (tmp_path / "rig.json").write_text(json.dumps(told))
    doubt = r"does not lie in .* camera '0' have their centre at \(297\.5, 222\.5\), .* 120 x 90"
    rig, output, template = tmp_path / "rig.json", tmp_path / "out.npz", folder / "body.obj"
    with pytest.raises(ValueError, match=doubt):
        track_file(folder / "depth", output, template=template, cameras=rig)
    with pytest.raises(ValueError, match=doubt):
        track_file(folder / "depth", output, template=template, cameras=rig, align="never")


def test_units_are_converted(folder: Path, truth: dynmesh.Sequence, tmp_path: Path) -> None:
    template = tmp_path / "body_mm.npz"
    still = replace(truth[:1], vertices=truth.vertices[:1] * 1000, metres_per_unit=0.001)
    dynmesh.write(template, still)
    output = tmp_path / "out.npz"
    run("track", folder / "depth", output, "--template", template, "--scan-unit", "m")
    tracked = dynmesh.read(output)
    assert tracked.metres_per_unit == 0.001
    smaller = replace(tracked, vertices=tracked.vertices / 1000)
    assert error(smaller, truth).max() < 0.5


def test_a_unit_that_is_said_is_in_the_output(folder: Path, tmp_path: Path) -> None:
    output = tmp_path / "out.npz"
    template, units = folder / "body.obj", ("--scan-unit", "cm", "--template-unit", "cm")
    run("track", folder / "points", output, "--template", template, *units)
    assert dynmesh.read(output).metres_per_unit == 0.01


def test_a_template_elsewhere_is_moved_into_the_scan(
    folder: Path, truth: dynmesh.Sequence, tmp_path: Path
) -> None:
    template = tmp_path / "moved.npz"
    moved = turned(truth.vertices[0], 0.7) + np.array([9.0, 2, 4])
    dynmesh.write(template, replace(truth[:1], vertices=moved[None]))
    output = tmp_path / "out.npz"
    with pytest.raises(ValueError, match=r"does not lie in the first scan: it is \S+ mean edges"):
        track_file(folder / "points", output, template=template, align="never")
    told = run("track", folder / "points", output, "--template", template).stderr
    assert "a rotation by 40" in told, told
    assert error(dynmesh.read(output), truth).max() < 0.5


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Templates in different poses of a figure that walks, and a scan of the first."""
    made = tmp_path_factory.mktemp("walk")
    walker = dynmesh.synth.walker(60)
    for number in (0, 25, 33, 42):
        dynmesh.write(made / f"pose_{number}.npz", walker[number : number + 1])
    dynmesh.write(made / "twice.npz", replace(walker[:1], vertices=2 * walker.vertices[:1] + 9))
    run("degrade", made / "pose_0.npz", made / "scans", "--scan", "--points", "3000")
    return made


@pytest.mark.parametrize(
    ("template", "is_far", "is_other_size"),
    [("pose_25", False, False), ("pose_42", True, False), ("twice", True, True)],
)
def test_a_template_in_another_pose_or_size_is_told(
    walk: Path, tmp_path: Path, template: str, is_far: bool, is_other_size: bool
) -> None:
    words = ("track", walk / "scans", tmp_path / "out.npz", "--template", walk / f"{template}.npz")
    told = run(*words).stderr
    assert "mean edges from the first scan; a rotation by" in told
    far = "that is far; the template is probably not in the pose of the first scan"
    assert (far in told) == is_far
    size = "times as large as the template; if that is wrong, --scan-unit and --template-unit"
    assert (size in told) == is_other_size


def test_a_template_that_no_rigid_motion_puts_into_the_scan_is_refused(
    walk: Path, tmp_path: Path
) -> None:
    """Another pose and another unit: errors say how far it is and what to do."""
    other_unit = tmp_path / "millimetres.npz"
    still = dynmesh.read(walk / "pose_0.npz")
    dynmesh.write(other_unit, replace(still, vertices=1000 * still.vertices))
    pose = (
        r"and \S+ mean edges after the best rigid motion; it must be the mesh of what was scanned"
    )
    for template, what in (
        (walk / "pose_33.npz", pose),
        (other_unit, r"the scan is 0\.0009\d* times as large: state both units by --scan-unit"),
    ):
        output = tmp_path / "out.npz"
        told = run("track", walk / "scans", output, "--template", template, code=1).stderr
        assert f"{template}: the template does not lie in the first scan: it is " in told
        assert re.search(what, told), told
        assert not output.exists()
        assert not unfinished_folder(output).exists()


def test_a_rigid_motion_is_found_from_one_side(rng: np.random.Generator) -> None:
    mesh = bumpy()
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    shift = 20 * rng.normal(size=3)
    placed = mesh.vertices @ turn.T + shift
    (scan,) = degrade.scan_points([placed], mesh.faces, 2, points=1500)
    found = dynmesh.find_alignment(mesh.faces, mesh.vertices, scan.points)
    assert found.before > 5
    assert found.after < 0.7
    np.testing.assert_allclose(found.rotation @ found.rotation.T, np.eye(3), atol=1e-9)
    moved = mesh.vertices @ found.rotation.T + found.shift
    off = np.linalg.norm(moved - placed, axis=1) / found.mean_edge
    assert off.mean() < 1.0
    again = dynmesh.find_alignment(mesh.faces, moved, scan.points)
    assert again.before == pytest.approx(found.after, rel=1e-6)
    assert again.lies_in_scan


@pytest.fixture(scope="module")
def in_millimetres(folder: Path, truth: dynmesh.Sequence) -> Path:
    """The truth in metres, and scans in millimetres that do and do not state it."""
    dynmesh.write(folder / "metres.npz", replace(truth, metres_per_unit=1.0))
    for name, unit in (("stated", 0.001), ("unstated", None)):
        (folder / name).mkdir()
        for number, scan in enumerate(open_scans(folder / "points")):
            assert isinstance(scan, PointScan)
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
        made = page(reader, scans=open_scans(folder / scans), scan_unit=unit, colour="plain")
        file = folder / "page.html"
        file.write_text(made.html)
        fewer = open_scans(folder / "points" / "frame_0000[0-3].ply")
        with pytest.raises(ValueError, match="has 4 frames, but"):
            page(reader, scans=fewer)
    shown = Page(browser, file)
    assert shown.captions() == [f"{scans}, the scans", f"{mesh}.npz"]
    shown.scrub(0)
    dots, surface = shown.picture(0), shown.picture(1)
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
    reader: ScanReader = open_scans(folder / "depth")
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


class TestTheExampleInC:
    """examples/c/track_stream.c reads the same frames, and the cameras from a plainer file."""

    @pytest.fixture
    def cameras(self, pipe: Pipe, tmp_path: Path) -> Path:
        numbers = [
            (*camera.size, camera.depth_scale, *np.ravel(camera.intrinsics), *poses)
            for camera in pipe.rig.cameras
            for poses in [np.ravel(camera.camera_to_world)]
            if camera.size is not None and camera.intrinsics is not None
        ]
        assert {len(of_one) for of_one in numbers} == {28}
        file = tmp_path / "cameras.txt"
        np.savetxt(file, np.array(numbers, float), fmt="%.17g")
        return file

    def run(
        self, programs: Path, template: Path, cameras: Path, raw: bytes, code: int = 0
    ) -> subprocess.CompletedProcess[bytes]:
        program = programs / "examples" / "c" / "track_stream"
        ended = subprocess.run(
            [program, template, cameras], input=raw, capture_output=True, check=False, timeout=60
        )
        assert ended.returncode == code, ended.stderr
        return ended

    def test_it_tracks_as_the_package_does(
        self, programs: Path, folder: Path, cameras: Path, pipe: Pipe
    ) -> None:
        ended = self.run(programs, folder / "body.obj", cameras, pipe.raw)
        assert ended.stderr.startswith(b"6 frames tracked; ")
        assert len(ended.stdout) == pipe.tracked.nbytes
        found = np.frombuffer(ended.stdout, "<f4").reshape(pipe.tracked.shape)
        np.testing.assert_array_equal(found, pipe.tracked)

    def test_errors(self, programs: Path, folder: Path, cameras: Path, pipe: Pipe) -> None:
        body = folder / "body.obj"
        cut = self.run(programs, body, cameras, pipe.raw[:-1], code=1)
        assert b"standard input ends within a frame" in cut.stderr
        assert len(cut.stdout) == pipe.tracked[:-1].nbytes
        missing = self.run(programs, body.with_name("none.obj"), cameras, b"", code=1)
        assert missing.stderr.endswith(b"none.obj: cannot be opened\n")
        cameras.write_text(" ".join(cameras.read_text().split()[:-1]))
        few = self.run(programs, body, cameras, pipe.raw, code=1)
        assert b"must contain 28 numbers for each" in few.stderr
        program = programs / "examples" / "c" / "track_stream"
        assert subprocess.run([program], capture_output=True, check=False).returncode == 2

    def test_a_refused_frame_does_not_end_the_stream(
        self, programs: Path, folder: Path, cameras: Path, pipe: Pipe
    ) -> None:
        numbers = np.loadtxt(cameras)
        numbers[:, 2] *= -1  # depths below 0 are refused
        np.savetxt(cameras, numbers, fmt="%.17g")
        ended = self.run(programs, folder / "body.obj", cameras, pipe.raw)
        assert ended.stderr.startswith(b"frame 0: depth")
        found = np.frombuffer(ended.stdout, "<f4").reshape(pipe.tracked.shape)
        template = dynmesh.read(folder / "body.obj").vertices[0].astype(np.float32)
        np.testing.assert_array_equal(found, np.broadcast_to(template, found.shape))


def test_scans_that_would_not_be_seen_are_refused(in_millimetres: Path, tmp_path: Path) -> None:
    folder, output = in_millimetres, tmp_path / "page.html"
    view = ["view", str(folder / "metres.npz"), "-o", str(output), "--scans"]
    scans = folder / "unstated"
    told = run(*view, scans, code=1).stderr
    assert "unstated: no point is near the mesh" in told
    assert "--scan-unit" in told
    told = run(*view, scans, "--scan-unit", "km", code=1).stderr
    assert "scan_unit: must be one of m, cm, mm" in told
    view[1] = str(folder / "truth.npz")
    told = run(*view, scans, "--scan-unit", "mm", code=1).stderr
    assert "truth.npz: states no unit" in told
    assert not output.exists()
