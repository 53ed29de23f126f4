"""A pose for each frame, in the files that people have: of dynmesh, nerfstudio and TUM."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from PIL import Image
from scan_files import error, moving_body, opened, saved
from scipy.spatial.transform import Rotation

import dynmesh
from dynmesh import losses
from dynmesh.advice.readings import READINGS
from dynmesh.scans import (
    PointScan,
    Rig,
    ScanCamera,
    read_cameras,
    write_cameras,
    write_ply,
)

TRUTH = moving_body(6)
SIZE = 120, 90
SCANS = list(
    losses.depth_images(
        TRUTH.vertices,
        TRUTH.faces,
        losses.orbit(TRUTH.vertices[0], degrees_per_frame=25),
        width=SIZE[0],
        height=SIZE[1],
    )
)
POSES = [scan.poses[0] for scan in SCANS]
MATRIX = np.asarray(SCANS[0].intrinsics[0])
AXES = np.diag([1.0, -1, -1, 1])
TIMES = [1305031102.0 + 0.03125 * number for number in range(6)]


def changed(file: Path, change: Callable[[Any], Any]) -> Path:
    """A file of JSON in which something is changed."""
    content = json.loads(file.read_text())
    change(content)
    file.write_text(json.dumps(content))
    return file


def own(folder: Path) -> Path:
    poses, matrices = np.stack(POSES), np.stack([MATRIX] * 6)
    camera = ScanCamera("depth", poses, matrices, 1e-3, SIZE, frames=tuple(range(6)))
    write_cameras(folder / "moving.json", Rig((camera,)))
    return folder / "moving.json"


def nerfstudio(folder: Path) -> Path:
    """As `ns-process-data` writes it, in another order and for colour images twice as large."""
    frames = [
        {
            "file_path": f"images/frame_{number:05d}.jpg",
            "depth_file_path": f"./depth/frame_{number:05d}.png",
            "transform_matrix": (pose @ AXES).tolist(),
        }
        for number, pose in enumerate(POSES)
    ]
    (fx, _, cx), (_, fy, cy), _ = 2 * MATRIX
    size = {"w": 2 * SIZE[0], "h": 2.0 * SIZE[1], "camera_model": "OPENCV", "k1": 0.0}
    stated = {**size, "fl_x": fx, "fl_y": fy, "cx": cx + 1, "cy": cy + 1, "frames": frames[::-1]}
    (folder / "transforms.json").write_text(json.dumps(stated))
    return folder / "transforms.json"


def trajectory(folder: Path) -> Path:
    """Ground truth of TUM, between whose times and those of the images are some milliseconds."""
    rows = ["# ground truth trajectory", "# timestamp tx ty tz qx qy qz qw"]
    for time, pose in zip(TIMES, POSES, strict=True):
        numbers = [*pose[:3, 3], *Rotation.from_matrix(pose[:3, :3]).as_quat()]
        for at in (time - 0.004, time + 0.004):
            rows.append(" ".join(f"{one:.9f}" for one in (at, *numbers)))
    (folder / "groundtruth.txt").write_text("\n".join(rows))
    return folder / "groundtruth.txt"


def tum(folder: Path) -> Path:
    """The trajectory, with intrinsics in the file of cameras."""
    camera = {"name": "depth", "intrinsics": MATRIX.tolist(), "depth_scale": 1e-3}
    stated = {"cameras": [{**camera, "poses": trajectory(folder).name}]}
    (folder / "tum.json").write_text(json.dumps(stated))
    return folder / "tum.json"


def counted(number: int) -> str:
    return f"frame_{number:05d}"


def timed(number: int) -> str:
    return f"{TIMES[number]:.6f}"


WAYS = {"own": (own, counted), "nerfstudio": (nerfstudio, counted), "tum": (tum, timed)}


@pytest.fixture
def depth(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A folder with the images of a way, and its file of cameras."""
    cameras, name = WAYS[getattr(request, "param", "own")]
    (tmp_path / "depth").mkdir()
    for number, scan in enumerate(SCANS):
        counts = np.rint(1000 * scan.depth[0]).astype(np.uint16)
        file = tmp_path / "depth" / f"{name(number)}.png"
        file.write_bytes(saved(Image.fromarray(counts)))
    return cameras(tmp_path)


@pytest.mark.parametrize("depth", WAYS, indirect=True)
def test_each_frame_is_seen_from_its_own_pose(depth: Path, tmp_path: Path) -> None:
    """Also by a file of cameras that is written of it."""
    write_cameras(tmp_path / "again.json", read_cameras(depth))
    for cameras in (depth, tmp_path / "again.json"):
        reader = opened(tmp_path, cameras=cameras)
        assert reader.n_frames == 6
        for scan, expected in zip(reader, SCANS, strict=True):
            np.testing.assert_allclose(scan.poses, expected.poses, atol=1e-6)
            np.testing.assert_allclose(scan.intrinsics, [MATRIX], rtol=1e-12)
            np.testing.assert_allclose(scan.depth, expected.depth, atol=1e-3)


def test_a_mesh_is_tracked_by_a_camera_that_moves(depth: Path, tmp_path: Path) -> None:
    dynmesh.write(tmp_path / "body.obj", TRUTH[:1])
    dynmesh.write(tmp_path / "truth.npz", TRUTH)
    words = ("--template", tmp_path / "body.obj", "--cameras", depth)
    run("track", tmp_path / "depth", tmp_path / "o.npz", *words)
    tracked = dynmesh.read(tmp_path / "o.npz")
    assert error(tracked, TRUTH).max() < 0.3
    assert "the cameras fit" in run("rig", tmp_path / "depth", *words).stdout
    first = min((tmp_path / "depth").iterdir())
    said = run("register", tmp_path / "body.obj", first, tmp_path / "r.obj", "--cameras", depth)
    assert "good" in said.stderr
    shown = ("--scans", tmp_path / "depth", "--cameras", depth, "-o", tmp_path / "o.html")
    run("view", tmp_path / "truth.npz", *shown)


@pytest.mark.parametrize("depth", ["nerfstudio", "tum"], indirect=True)
def test_points_are_seen_from_the_pose_of_their_frame(depth: Path, tmp_path: Path) -> None:
    name = timed if depth.name == "tum.json" else counted
    cameras = tmp_path / "groundtruth.txt" if depth.name == "tum.json" else depth
    for number in range(6):
        points = PointScan(SCANS[number].cloud, None, None)
        write_ply(tmp_path / f"{name(number)}.ply", points)
    for path in (tmp_path / "*.ply", tmp_path / f"{name(2)}.ply"):
        reader = opened(path, cameras=cameras)
        for scan, pose in zip(reader, POSES if reader.n_frames > 1 else POSES[2:], strict=False):
            np.testing.assert_allclose(np.asarray(scan.viewpoints), [pose[:3, 3]], atol=1e-6)


@pytest.mark.parametrize("change", READINGS.values())
def test_a_misreading_is_undone_in_every_pose(change: Callable[[Any], Any]) -> None:
    matrices = np.stack([MATRIX + np.diag([n, 0, 0]) for n in range(6)])
    camera = ScanCamera("a", np.stack(POSES), matrices, 1e-3, SIZE, frames=tuple(range(6)))
    for frame in range(6):
        ours, theirs = change(camera).at(frame), change(camera.at(frame))
        np.testing.assert_equal(vars(ours), vars(theirs))


def first_frame(**values: Any) -> Callable[[Any], Any]:
    """Changes what is stated of the last image, which is listed first."""
    return lambda stated: stated["frames"][0].update(values)


def pose_of_own(at: int, **values: Any) -> Callable[[Any], Any]:
    return lambda stated: stated["cameras"][0]["poses"][at].update(values)


REFUSED: dict[str, tuple[str, Callable[[Any], Any], str]] = {
    "no pose": ("own", lambda s: s["cameras"][0]["poses"].pop(3), "for frame 3; the nearest is"),
    "two poses": ("own", pose_of_own(1, frame=2), "there are two of frame 2"),
    "a pose that mirrors": (
        "own",
        pose_of_own(1, camera_to_world=np.diag([1, 1, -1, 1]).tolist()),
        "camera 0: poses: frame 1: camera_to_world: mirrors",
    ),
    "poses and a pose": (
        "own",
        lambda s: s["cameras"][0].update(camera_to_world=np.eye(4).tolist()),
        "camera_to_world: is needed or, if the camera moves, poses",
    ),
    "intrinsics of some": (
        "own",
        lambda s: s["cameras"][0]["poses"][4].pop("intrinsics"),
        "intrinsics: must be those of all poses",
    ),
    "a negative bound": ("own", lambda s: s["cameras"][0].update(within=-1), "within: must be at"),
    "an image that is not listed": ("nerfstudio", lambda s: s["frames"].pop(2), "for frame 3;"),
    "a lens": ("nerfstudio", lambda s: s.update(k1=0.05), "k1: is 0.05, but must be 0"),
    "a lens of one image": ("nerfstudio", first_frame(p2=-0.1), "frame_00005.png: p2: is -0.1"),
    "a fisheye": (
        "nerfstudio",
        lambda s: s.update(camera_model="OPENCV_FISHEYE"),
        "camera_model: must be one of OPENCV, .*, not 'OPENCV_FISHEYE'",
    ),
    "two focal lengths": ("nerfstudio", first_frame(fl_x=3.0), "fl_x: is 3.0, but .* for all"),
    "no principal point": ("nerfstudio", lambda s: s.pop("cy"), "cy: is missing"),
    "no intrinsics": ("nerfstudio", lambda s: s.pop("fl_x"), "'depth' has no intrinsics"),
    "an image without a number": (
        "nerfstudio",
        first_frame(depth_file_path="depth/last.png"),
        "several sequences, as last.png and frame_00004.png",
    ),
    "a bound that is too small": (
        "tum",
        lambda s: s["cameras"][0].update(within=0.003),
        r"for frame 1305031102; the nearest is that of 1305031101\.996",
    ),
}


@pytest.mark.parametrize(
    ("depth", "change", "told"), REFUSED.values(), ids=REFUSED, indirect=["depth"]
)
def test_cameras_that_move_are_refused_by_name(
    depth: Path, change: Callable[[Any], Any], told: str, tmp_path: Path
) -> None:
    changed(depth, change)
    with pytest.raises(ValueError, match=rf"{depth.name}: .*{told}|depth: .*{told}"):
        opened(tmp_path / "depth", cameras=depth)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("1 2 3", "line 3: must be a pose, .* has 3 words"),
        ("1 0 0 0 0 0 0 0", "line 3: its quaternion must have length 1, not 0"),
        ("1 0 0 0 0 0 0 one", "line 3: 'one' is not a number"),
        ("1 0 0 0 0 0 0 1\n1.0 0 0 0 0 0 0 1", "two of frame 1"),
        ("", 'intrinsics, .* "poses": "groundtruth.txt"'),
    ],
)
def test_a_trajectory_is_refused_with_the_line(line: str, told: str, tmp_path: Path) -> None:
    file = trajectory(tmp_path)
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines[:2], line, *lines[2:]]))
    (tmp_path / "17.5.png").write_bytes(saved(Image.new("I;16", SIZE, 7)))
    with pytest.raises(ValueError, match=told):
        opened(tmp_path / "17.5.png", cameras=file)


@pytest.mark.parametrize(
    ("stated", "expected"),
    [
        ({}, 0.001),
        ({"integer_depth_scale": 0.25}, 0.25),
        ({"applied_scale": 0.5}, 0.0005),
        ({"depth_unit_scale_factor": 0.0002}, 0.0002),
    ],
)
def test_transforms_state_the_depth_of_a_count(
    stated: dict[str, float], expected: float, tmp_path: Path
) -> None:
    file = changed(nerfstudio(tmp_path), lambda transforms: transforms.update(stated))
    assert read_cameras(file).cameras[0].depth_scale == pytest.approx(expected)
