"""Recordings as recorders write them: depth images, poses, masks and folders of several kinds."""

import json
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array
from PIL import Image
from scan_files import a_rig, moving_body, opened, saved, three_frames
from scipy.spatial.transform import Rotation, Slerp
from sequences import assert_refused

import dynmesh
from dynmesh.formats.times import mean_rate
from dynmesh.scans import DepthScan, Rig, ScanReader, write_cameras

OpenEXR: Any = import_module("OpenEXR")  # which has no types

RNG = np.random.default_rng(4)
DEPTH = RNG.uniform(0.5, 3, (6, 8)).astype(np.float32)
DEPTH[0, :3] = 0
TURNS = Rotation.from_rotvec(RNG.normal(size=(5, 3)))
POSES = np.broadcast_to(np.eye(4), (5, 4, 4)).copy()
POSES[:, :3, :3], POSES[:, :3, 3] = TURNS.as_matrix(), RNG.normal(size=(5, 3))
MATRIX = [[9.0, 0, 3.5], [0, 9, 2.5], [0, 0, 1]]


def tiff(file: Path, values: Array) -> None:
    Image.fromarray(values).save(file, format="TIFF", compression="tiff_lzw")


def exr(channel: str) -> Callable[[Path, Array], None]:
    def write(file: Path, values: Array) -> None:
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        channels = {channel: np.stack([values] * 3, axis=-1) if channel == "RGB" else values}
        with OpenEXR.File(header, channels) as image:
            image.write(str(file))

    return write


def with_holes(values: Array, *holes: float) -> Array:
    """Writes what means that nothing was measured where the depth is 0."""
    result = values.copy()
    result[0, : len(holes)] = holes
    return result


FLOATS = with_holes(DEPTH, np.nan, np.inf, -1)
COUNTS = np.rint(1000 * DEPTH).astype(np.uint16)
IMAGES: dict[str, tuple[str, Callable[[Path, Array], None], Array]] = {
    "floats in TIFF": (".tiff", tiff, with_holes(DEPTH, np.nan, 0, 1e10)),
    "counts in TIFF": (".tif", tiff, with_holes(COUNTS, 65535)),
    "OpenEXR of a renderer": (".exr", exr("Z"), with_holes(DEPTH, 1e10, 65504)),
    "OpenEXR in grey": (".exr", exr("RGB"), FLOATS),
    "OpenEXR of a layer": (".exr", exr("ViewLayer.Depth.Z"), DEPTH),
    "floats in NPY": (".npy", np.save, FLOATS.astype(np.float64)),
    "counts in NPY": (".npy", np.save, COUNTS.astype(np.int32)),
}


@pytest.mark.parametrize("unit", [None, 1.0, 0.001])
@pytest.mark.parametrize(("suffix", "write", "values"), IMAGES.values(), ids=IMAGES)
def test_depth_is_read_from_images_of_several_kinds(
    suffix: str,
    write: Callable[[Path, Array], None],
    values: Array,
    unit: float | None,
    tmp_path: Path,
) -> None:
    """Floats are metres; what counts are is stated."""
    is_float = values.dtype.kind == "f"
    per_metre = 1 / (unit or 1)
    scale = None if is_float else 1e-3 * per_metre
    camera = replace(a_rig(1).cameras[0], depth_scale=scale)
    write_cameras(tmp_path / "cameras.json", Rig((camera,), unit))
    write(tmp_path / f"depth_00000_c0{suffix}", values)
    (scan,) = opened(tmp_path)
    np.testing.assert_allclose(scan.depth[0], DEPTH * per_metre, atol=5.1e-4 * per_metre)
    assert not scan.depth[0][0, :3].any()


def test_counts_without_a_scale_are_refused(tmp_path: Path) -> None:
    rig = a_rig(1)
    write_cameras(tmp_path / "c.json", Rig((replace(rig.cameras[0], depth_scale=None),)))
    file = tmp_path / "depth_00000_c0.png"
    file.write_bytes(saved(Image.fromarray(COUNTS)))
    told = "holds counts, but camera 'c0' states no depth_scale"
    assert_refused(file, told, lambda _: opened(tmp_path, cameras=tmp_path / "c.json"))


@pytest.mark.parametrize("suffix", [".tiff", ".exr", ".npy"])
def test_a_damaged_image_of_another_kind_is_lost(suffix: str, tmp_path: Path) -> None:
    write = {".tiff": tiff, ".exr": exr("Z"), ".npy": np.save}[suffix]
    camera = replace(a_rig(1).cameras[0], depth_scale=None)
    write_cameras(tmp_path / "cameras.json", Rig((camera,)))
    for number in range(2):
        write(tmp_path / f"{number}{suffix}", RNG.uniform(1, 2, (6, 8)).astype(np.float32))
    file = tmp_path / f"1{suffix}"
    file.write_bytes(file.read_bytes()[:-20])
    reader = opened(tmp_path)
    first, second = reader
    assert first is not None
    assert second is None
    assert "cut or damaged" in reader.lost[0]


def quaternions(poses: Array) -> Array:
    return np.asarray(Rotation.from_matrix(poses[:, :3, :3]).as_quat())  # the real part last


def lines(file: Path, rows: Any, before: str = "", between: str = " ") -> None:
    text = [between.join(f"{x:.12g}" if isinstance(x, float) else str(x) for x in r) for r in rows]
    file.write_text("\n".join([before, *text]) if before else "\n".join(text))


def images(folder: Path, names: Callable[[int], str] = "{:06d}".format) -> None:
    folder.mkdir(exist_ok=True, parents=True)
    for number in range(5):
        (folder / f"{names(number)}.png").write_bytes(saved(Image.new("I;16", (8, 6), 1000)))


def kitti(root: Path, poses: Array) -> None:
    lines(root / "poses.txt", poses[:, :3].reshape(-1, 12))
    images(root / "depth")


def tum(root: Path, poses: Array) -> None:
    times = [f"{1305031102.0 + n / 30:.6f}" for n in range(5)]
    rows = zip(times, poses[:, :3, 3], quaternions(poses), strict=True)
    lines(root / "poses.txt", [(t, *p, *q) for t, p, q in rows], "# timestamp tx ty tz qx ...")
    images(root / "depth", lambda n: times[n])
    (root / "depth.txt").write_text("\n".join(f"{t} depth/{t}.png" for t in times))
    images(root / "rgb", lambda n: times[n])


def euroc(root: Path, poses: Array) -> None:
    times = [1403636579763555584 + 50000000 * n for n in range(5)]
    rows = zip(times, poses[:, :3, 3], np.roll(quaternions(poses), 1, axis=1), strict=True)
    header = "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w []"
    lines(root / "poses.txt", [(t, *p, *q, 0.0, 0.0) for t, p, q in rows], header, ",")
    images(root / "depth", lambda n: str(times[n]))


def colmap(root: Path, poses: Array) -> None:
    """Its poses lead from the world, and the lines of points may be empty."""
    inverse = np.linalg.inv(poses)
    turns = np.roll(quaternions(inverse), 1, axis=1)
    rows = list[Any]()
    for n in range(5):
        rows += [(n + 1, *turns[n], *inverse[n, :3, 3], 1, f"{n:06d}.jpg"), (12.5, 3.25, -1)]
    rows[1] = ()
    lines(root / "poses.txt", rows, "# Image list with two lines of data per image:\n# ...")
    images(root / "depth")


def seven_scenes(root: Path, poses: Array) -> None:
    images(root / "depth", "frame-{:06d}.depth".format)
    images(root / "depth", "frame-{:06d}.color".format)
    for n, pose in enumerate(poses):
        lines(root / "depth" / f"frame-{n:06d}.pose.txt", pose, between="\t")


def scannet(root: Path, poses: Array) -> None:
    images(root / "depth", str)
    (root / "pose").mkdir()
    for n, pose in enumerate(poses):
        lines(root / "pose" / f"{n}.txt", pose)


def stated(root: Path, **fields: Any) -> Path:
    """A file of cameras, with poses in another one, if there is one."""
    poses = {"poses": "poses.txt"} if (root / "poses.txt").exists() else {}
    camera = {"name": "kinect", "intrinsics": MATRIX, "depth_scale": 1e-3, **poses, **fields}
    (root / "cameras.json").write_text(json.dumps({"cameras": [camera]}))
    return root / "cameras.json"


def poses_of(scans: ScanReader) -> Array:
    """Those of the only camera in each frame."""
    return np.array([scan.poses[0] for scan in scans if isinstance(scan, DepthScan)])


RECORDERS = [kitti, tum, euroc, colmap, seven_scenes, scannet]


@pytest.mark.parametrize("record", RECORDERS)
@pytest.mark.parametrize("lead", [None, "world-to-camera"])
def test_poses_are_read_as_recorders_write_them(
    record: Callable[[Path, Array], None], lead: str | None, tmp_path: Path
) -> None:
    """They may be said to lead from the world; those of COLMAP do already."""
    record(tmp_path, POSES if lead is None or record is colmap else np.linalg.inv(POSES))
    scans = opened(tmp_path / "depth", cameras=stated(tmp_path), poses=lead)
    np.testing.assert_allclose(poses_of(scans), POSES, atol=1e-9)


@pytest.mark.parametrize("value", [-np.inf, np.nan])
@pytest.mark.parametrize("record", [kitti, tum, seven_scenes, scannet])
def test_a_lost_pose_leaves_out_its_camera(
    record: Callable[[Path, Array], None], value: float, tmp_path: Path
) -> None:
    lost = POSES.copy()
    lost[2, :3] = value
    if record is tum:  # whose rotations are quaternions
        lost[2, :3, :3] = np.eye(3)
    record(tmp_path, lost)
    file = stated(tmp_path)
    told = "has no finite pose of camera 'kinect' for frame .*`gaps` lost"
    with pytest.raises(ValueError, match=told):
        opened(tmp_path / "depth", cameras=file)
    reader = opened(tmp_path / "depth", cameras=file, gaps="lost")
    assert [scan is None for scan in reader] == [n == 2 for n in range(5)]
    assert "no pose of camera 'kinect'" in reader.lost[0]


def test_between_two_poses_a_camera_moves_evenly(tmp_path: Path) -> None:
    times = np.arange(5) * 0.1
    rows = zip(times, POSES[:, :3, 3], quaternions(POSES), strict=True)
    lines(tmp_path / "poses.txt", [(t, *p, *q) for t, p, q in rows])
    images(tmp_path / "depth", lambda n: f"{0.02 + 0.09 * n:.3f}")
    reader = opened(tmp_path / "depth", cameras=stated(tmp_path))
    at = 0.02 + 0.09 * np.arange(5)
    turns = Slerp(times, TURNS)(at).as_matrix()
    places = np.array([np.interp(at, times, POSES[:, i, 3]) for i in range(3)]).T
    for scan, turn, place in zip(reader, turns, places, strict=True):
        np.testing.assert_allclose(scan.poses[0][:3], np.column_stack([turn, place]), atol=1e-9)
    assert not reader.remarks
    images(tmp_path / "faster", lambda n: f"{0.05 + 0.01 * n:.3f}")
    told = opened(tmp_path / "faster", cameras=stated(tmp_path)).remarks
    assert "up to 0.05 from a frame, and frames are 0.01 apart" in told[0]


@pytest.mark.parametrize("axis", [0, 1])
def test_a_negative_focal_length_mirrors_the_image(axis: int, tmp_path: Path) -> None:
    file = tmp_path / "0.png"
    file.write_bytes(saved(Image.fromarray(COUNTS)))
    (straight,) = opened(file, cameras=stated(tmp_path, camera_to_world=np.eye(4).tolist()))
    matrix = np.array(MATRIX)
    matrix[axis, axis] *= -1
    pose = np.eye(4).tolist()
    fields = {"camera_to_world": pose, "intrinsics": matrix.tolist()}
    (mirrored,) = opened(file, cameras=stated(tmp_path, **fields))
    expected = straight.cloud * np.where(np.arange(3) == axis, -1, 1)
    found = mirrored.cloud
    np.testing.assert_allclose(sorted(found.tolist()), sorted(expected.tolist()), atol=1e-6)


def test_images_of_tum_are_read_where_their_list_is(tmp_path: Path) -> None:
    tum(tmp_path, POSES)
    reader = opened(tmp_path, cameras=stated(tmp_path))
    assert reader.n_frames == 5
    assert reader.numbers == pytest.approx([1305031102 + n / 30 for n in range(5)], abs=1e-6)


def masked(folder: Path, suffix: str = ".png", size: tuple[int, int] = (8, 6)) -> Path:
    """Masks whose left half is the subject, for images of two cameras in three frames."""
    (folder / "masks").mkdir()
    for number in range(3):
        for camera in ("c0", "c1"):
            mask = np.zeros(size[::-1], np.uint8)
            mask[:, :4] = 3
            file = folder / "masks" / f"depth_{number:05d}_{camera}{suffix}"
            if suffix == ".npy":
                np.save(file, mask)
            else:
                Image.fromarray(mask).save(file)
    return folder / "masks"


@pytest.mark.parametrize("suffix", [".png", ".tif", ".bmp", ".npy"])
@pytest.mark.parametrize("name", ["depth_000", "mask-"])
def test_only_the_subject_is_measured(suffix: str, name: str, tmp_path: Path) -> None:
    """By masks of the same names, or of others with the same numbers."""
    masks = masked(tmp_path, suffix)
    for file in [*masks.iterdir()]:
        file.rename(masks / file.name.replace("depth_000", name))
    for scan in opened(three_frames(tmp_path / "s"), subject=masks):
        for depth in scan.depth:
            assert depth[:, :4].all()
            assert not depth[:, 4:].any()


def test_masks_are_refused_by_name(tmp_path: Path) -> None:
    scans = three_frames(tmp_path / "s")
    masks = masked(tmp_path, size=(9, 6))
    with pytest.raises(ValueError, match=r"_c0.png: has 9 x 6 pixels, but the depth image 8 x 6"):
        list(opened(scans, subject=masks))
    (masks / "depth_00001_c1.png").unlink()
    told = "there is no mask in .*masks for depth_00001_c1.png; with `gaps` lost"
    with pytest.raises(ValueError, match=told):
        opened(scans, subject=masks)
    with pytest.raises(ValueError, match=r"subject: .*must be a folder of masks"):
        opened(scans, subject=tmp_path / "nowhere")
    (tmp_path / "p").mkdir()
    (tmp_path / "p" / "0.xyz").write_text("1 2 3")
    with pytest.raises(ValueError, match="subject: chooses pixels of depth images"):
        opened(tmp_path / "p", subject=masks)


@pytest.mark.parametrize("name", ["confidence/{}", "depth/conf_{}"])
def test_pixels_of_little_confidence_are_not_measured(name: str, tmp_path: Path) -> None:
    images(tmp_path / "depth", "depth_{}".format)
    file = stated(tmp_path, camera_to_world=np.eye(4).tolist())
    depth = tmp_path / "depth" / "depth_*.png"
    told = "no image of confidences beside it for depth_0.png"
    with pytest.raises(ValueError, match=told):
        opened(depth, cameras=file, least_confidence=2)
    for number in range(5):
        place = name.format(number if "conf_" in name else f"depth_{number}")
        other = tmp_path / f"{place}.png"
        other.parent.mkdir(exist_ok=True)
        values = np.zeros((6, 8), np.uint8)
        values[:, :2], values[:, 2:4] = 2, 1
        Image.fromarray(values).save(other)
    for least, columns in ((1, 4), (2, 2)):
        scan, *_ = opened(depth, cameras=file, least_confidence=least)
        assert scan.depth[0].any(axis=0).sum() == columns


def test_some_frames_are_tracked_by_their_numbers(tmp_path: Path) -> None:
    truth = moving_body(5)
    dynmesh.write(tmp_path / "body.obj", truth[1:2])
    for number, frame in enumerate(truth.vertices):
        np.savetxt(tmp_path / f"scan_{10 + number}.xyz", frame)
    run = dynmesh.track(tmp_path, template=tmp_path / "body.obj", frames=slice(11, 14))
    tracked = run.read()
    assert tracked.n_frames == 3
    assert [tracked.header.number(n) for n in range(3)] == [11, 12, 13]
    np.testing.assert_allclose(tracked.vertices, truth.vertices[1:4], atol=0.02)
    scans = tmp_path / "scan_*.xyz"
    found = dynmesh.register(tmp_path / "body.obj", scans, frame=12, align=False).read()
    np.testing.assert_allclose(found.vertices[0], truth.vertices[2], atol=0.02)
    with pytest.raises(ValueError, match="frame: there is no scan 3, only 10 to 14"):
        dynmesh.register(tmp_path / "body.obj", scans, frame=3)
    with pytest.raises(ValueError, match="frames: must be some of 10:15"):
        dynmesh.track(tmp_path, template=tmp_path / "body.obj", frames=slice(20, 22))


def test_frames_are_called_by_the_seconds_since_the_first_if_names_are_clock_times(
    tmp_path: Path,
) -> None:
    truth = moving_body(4)
    dynmesh.write(tmp_path / "body.obj", truth[:1])
    (tmp_path / "scans").mkdir()
    for number, frame in enumerate(truth.vertices):
        np.savetxt(tmp_path / "scans" / f"{1305031102.175 + 0.05 * number:.6f}.xyz", frame)
    run = dynmesh.track(tmp_path / "scans", template=tmp_path / "body.obj")
    run.write(tmp_path / "o.npz")
    run.report.write_csv(tmp_path / "q.csv")
    tracked = dynmesh.read(tmp_path / "o.npz")
    assert mean_rate(tracked.header) == pytest.approx(20)
    html = tracked.view(quality=tmp_path / "q.csv").html
    assert "the frame at 0.150 s is good" in html
