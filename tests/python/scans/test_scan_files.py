"""Files of cameras and depth images."""

import json
import struct
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import LONGER
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from scan_files import a_rig, opened, saved, seen, three_frames
from sequences import assert_refused

from dynmesh._errors import DynmeshError
from dynmesh.scans import (
    DepthScan,
    Rig,
    ScanCamera,
    read_cameras,
    scan_folder,
    write_cameras,
)
from dynmesh.scans.depth_files import read_depth

LENS = [-0.28, 0.09, 0.002, -0.001, 0.01]

RATIONAL = [0.55, -0.02, -7e-5, 2e-5, -0.003, 0.89, 0.09, -0.014]
INTRINSICS = {"fx": 100.0, "fy": 95.0, "cx": 62.0, "cy": 45.5, "width": 120, "height": 90}


def through_lens(x: Any, y: Any, k: list[float]) -> tuple[Any, Any]:
    """Where a direction appears, by the formulas in the documentation of OpenCV."""
    k1, k2, p1, p2, k3, k4, k5, k6 = [*k, 0, 0, 0, 0][:8]
    r2 = x**2 + y**2
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    return (
        x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2),
        y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y,
    )


def tilted(told: dict[str, float], k: list[float], slope: tuple[float, float]) -> bytes:
    """An image of a plane, whose depth in counts is linear in the undistorted direction."""
    v, u = np.mgrid[: told["height"], : told["width"]].astype(float)
    seen = (u - told["cx"]) / told["fx"], (v - told["cy"]) / told["fy"]
    x, y = seen
    for _ in range(80):
        at = through_lens(x, y, k)
        x, y = x + 0.5 * (seen[0] - at[0]), y + 0.5 * (seen[1] - at[1])
    counts = 20000 + 8000 * (slope[0] * x + slope[1] * y)
    return saved(Image.fromarray(np.rint(counts).astype(np.uint16)))


def deviation(scans: Path, slope: tuple[float, float]) -> tuple[float, float, float]:
    """The bias and spread of the cloud from that plane, in pixels, and its part of the image."""
    (scan,) = opened(scans)
    x, y, z = scan.cloud.T
    expected = 20 + 8 * (slope[0] * x + slope[1] * y) / z
    pixels = (z - expected) / 8 * scan.intrinsics[0][1, 1]
    return abs(float(pixels.mean())), float(pixels.std()), len(z) / scan.depth[0].size


@pytest.mark.parametrize("slope", [(1.0, 0.0), (0.0, 1.0)])
@pytest.mark.parametrize("k", [LENS, RATIONAL, [0.2, 0.05, 0.01, 0.0]])
def test_a_distortion_is_undone(tmp_path: Path, k: list[float], slope: tuple[float, float]) -> None:
    (tmp_path / "0.png").write_bytes(tilted(INTRINSICS, k, slope))
    fx, fy, cx, cy, width, height = INTRINSICS.values()
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    camera = ScanCamera("a", np.eye(4), matrix, 1e-3, (int(width), int(height)))
    write_cameras(tmp_path / "cameras.json", Rig((camera,)))
    assert deviation(tmp_path, slope)[1] > 0.6
    write_cameras(tmp_path / "cameras.json", Rig((replace(camera, distortion=tuple(k)),)))
    bias, spread, share = deviation(tmp_path, slope)
    assert bias < 0.1
    assert spread < 0.4  # of nearest pixels: 0.29
    assert share > 0.6


@pytest.mark.parametrize("unit", [None, 1.0, 0.01, 0.001, 0.0254])
def test_cameras_come_back(tmp_path: Path, unit: float | None) -> None:
    rig = a_rig(3, unit=unit)
    bare = ScanCamera("bare", rig.cameras[0].camera_to_world)
    write_cameras(tmp_path / "c.json", Rig((*rig.cameras, bare), unit))
    found = read_cameras(tmp_path / "c.json")
    assert found.metres_per_unit == unit
    for ours, theirs in zip((*rig.cameras, bare), found.cameras, strict=True):
        np.testing.assert_equal(vars(theirs), vars(ours))


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                ["unit", "cameras", "name", "camera_to_world", "intrinsics", "depth_scale", "x"]
            ),
            inner,
            max_size=5,
        )
    ),
    max_leaves=12,
)


@given(st.data())
@settings(max_examples=100 * LONGER)
def test_a_changed_field_of_a_camera_is_refused_or_kept(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    file = tmp_path_factory.getbasetemp() / "changed.json"
    write_cameras(file, a_rig(1))
    told = json.loads(file.read_text())
    camera = told["cameras"][0]
    name = data.draw(st.sampled_from(sorted(camera)))
    value = data.draw(JSON)
    camera[name] = value
    file.write_text(json.dumps(told))
    try:
        (read,) = read_cameras(file).cameras
    except DynmeshError as error:
        found = str(error)
    else:
        kept = {"name": read.name, "depth_scale": read.depth_scale}
        kept |= dict(zip(("width", "height"), read.size or (), strict=False))
        assert kept[name] == value
        return
    assert f"camera 0: {name}: " in found


def test_depth_images_come_back_to_half_a_count(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    rig = a_rig(2)
    images = rng.uniform(0.5, 60.0, (3, 2, 6, 8)).astype(np.float32)
    images[0, 0, 2, 3] = 0
    images[1, 1, 0, 0] = 70.0  # more than 65535 counts
    matrices = [np.asarray(camera.intrinsics) for camera in rig.cameras]
    poses = [camera.camera_to_world for camera in rig.cameras]
    with scan_folder(tmp_path / "scans", rig) as append:
        for pair in images:
            append(DepthScan(list(pair), matrices, poses))
    images[1, 1, 0, 0] = 0
    emptied = tmp_path / "scans" / "depth_00000_c0.png"  # by a sensor that says so by the largest
    counts = np.array(Image.open(emptied))
    Image.fromarray(np.where(counts == 0, 65535, counts).astype(np.uint16)).save(emptied)
    reader = opened(tmp_path / "scans")
    for pair, found in zip(images, reader, strict=True):
        np.testing.assert_allclose(found.depth, pair, atol=0.0005 + 1e-5)
        assert (np.array(found.depth) == 0).sum() == (pair == 0).sum()
        np.testing.assert_array_equal(found.intrinsics, matrices)
        np.testing.assert_array_equal(found.poses, poses)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "is empty"),
        (saved(Image.new("I;16", (8, 6), 7))[:60], "cut or damaged"),
        (saved(Image.new("I;16", (8, 7), 7)), "8 x 7"),
        (None, "cannot be read"),
    ],
)
def test_damaged_images_are_lost(tmp_path: Path, content: bytes | None, told: str) -> None:
    folder = three_frames(tmp_path / "s")
    for name in ("00000_c0", "00001_c0", "00001_c1"):
        file = folder / f"depth_{name}.png"
        file.unlink()
        if content is None:
            file.mkdir()
        else:
            file.write_bytes(content)
    reader = opened(folder)
    assert seen(reader) == [[("c1", 1)], [], [("c0", 3), ("c1", 3)]]
    assert len(reader.lost) == 3
    assert all(told in why for why in reader.lost)
    (folder / "depth_00002_c1.png").unlink()
    reader = opened(folder, gaps="lost")
    assert seen(reader) == [[("c1", 1)], [], [("c0", 3)]]
    for pattern in ("depth_%05d_c0.png", "depth_*_c0.png", "depth_%05d.png"):
        assert opened(folder / pattern, gaps="lost").n_frames == 3
    assert "'c1'" in reader.lost[-1]
    assert "frame 2" in reader.lost[-1]


@pytest.mark.parametrize(
    ("named", "names"),
    [
        ("{camera}/{n}", ("0", "1")),
        ("{camera}/frame_{n}", ("a", "b")),
        ("{camera}/d_{n}_{camera}", ("0", "1")),
        ("{camera}/data/raw/{n}", ("cam0", "cam1")),
        ("{camera}/depth/{n:06d}", ("left_ir", "right_ir")),
        ("depth/{camera}/{n:06d}", ("cam0", "cam1")),
    ],
)
def test_any_folder_of_an_image_may_name_its_camera(
    tmp_path: Path, named: str, names: tuple[str, str]
) -> None:
    """Beside colour images in folders of the same names, which are not read."""
    rig = Rig(tuple(replace(c, name=n) for c, n in zip(a_rig(2).cameras, names, strict=True)))
    write_cameras(tmp_path / "cameras.json", rig)
    for number in range(2):
        for camera in names:
            file = tmp_path / (named.format(camera=camera, n=number) + ".png")
            colours = tmp_path / "colours" / "0.png"
            if "depth" in named:
                colours = Path(str(file).replace("depth", "color"))
            for made in (file, colours):
                made.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(saved(Image.new("I;16", (8, 6), 1000 + number)))
            colours.write_bytes(saved(Image.new("RGB", (8, 6))))
    expected = [[(camera, 1 + number / 1000) for camera in names] for number in range(2)]
    assert seen(opened(tmp_path)) == expected
    pattern = named.format(camera="*", n=0).replace("000000", "*").replace("0", "*")
    glob = opened(tmp_path / f"{pattern}.png", cameras=tmp_path / "cameras.json")
    assert seen(glob) == expected
    write_cameras(tmp_path / "one.json", Rig(rig.cameras[:1]))
    one = opened(tmp_path, cameras=tmp_path / "one.json")
    assert seen(one) == [scans[:1] for scans in expected]


@pytest.mark.parametrize(
    ("names", "pattern", "numbers"),
    [
        (["frame-000000.depth", "frame-000001.depth"], "", [0, 1]),
        (["f-000.depth", "f-000.color", "f-001.depth"], "f-%03d.depth.png", [0, 1]),
        (["f-000.depth", "f-001.depth"], "f-*.depth.png", [0, 1]),
        (["0007_depth", "0008_depth"], "", [7, 8]),
        (["d_-0001_c0", "d_-0002_c0"], "", [-2, -1]),
        (["1305.86", "1305.893", "1305.96"], "", [1305.86, 1305.893, 1305.9265, 1305.96]),
    ],
)
def test_images_are_numbered_as_all_frames(
    tmp_path: Path, names: list[str], pattern: str, numbers: list[float]
) -> None:
    write_cameras(tmp_path / "cameras.json", a_rig(1))
    for name in names:
        (tmp_path / f"{name}.png").write_bytes(saved(Image.new("I;16", (8, 6), 1000)))
    found = opened(tmp_path / pattern, gaps="lost").numbers
    assert found == pytest.approx(numbers)


@pytest.mark.parametrize("named", ["{n}_{camera}", "{camera}/{n}"])
@pytest.mark.parametrize(
    "names",
    [
        ["2024-10-27_23-59-58", "2024-10-27_23-59-59", "2024-10-28_00-00-00"],
        ["140_9", "140_763555584", "141_8"],
        ["take1_9", "take1_10", "take2_1"],
    ],
)
def test_images_of_several_cameras_are_paired_by_their_names(
    tmp_path: Path, named: str, names: list[str]
) -> None:
    write_cameras(tmp_path / "cameras.json", a_rig(2))
    for number, name in enumerate(names):
        for camera in ("c0", "c1")[: 1 if number == 1 else 2]:
            file = tmp_path / (named.format(n=name, camera=camera) + ".png")
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(saved(Image.new("I;16", (8, 6), 1000 + number)))
    reader = opened(tmp_path, gaps="lost")
    assert reader.numbers == [0, 1, 2]
    expected = [["c0", "c1"], ["c0"], ["c0", "c1"]]
    assert [[camera for camera, _ in of_frame] for of_frame in seen(reader)] == expected
    assert [of_frame[0][1] for of_frame in seen(reader)] == [1, 1.001, 1.002]
    assert_refused(tmp_path, "no image of camera 'c1' for frame 1", opened)


def chunk(kind: bytes, content: bytes) -> bytes:
    """A part of a PNG file."""
    return (
        struct.pack(">I", len(content)) + kind + content
        + struct.pack(">I", zlib.crc32(kind + content))
    )  # fmt: skip


def with_data(rows: bytes, width: int = 8, height: int = 6) -> bytes:
    """An image of this size with this as the image data."""
    header = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    parts = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (saved(Image.new("L", (8, 6))), "one channel of 16 bits, .* not the mode L$"),
        (saved(Image.new("P", (8, 6))), "one channel of 16 bits, .* not the mode P$"),
        (saved(Image.new("I;16", (4, 4))), "has 4 x 4 pixels, but camera 'c0' has 8 x 6"),
        (with_data(bytes(102), 60000, 60000), "exceeds limit"),
        (with_data(bytes(101)), "is a PNG image that is cut or damaged: "),
        (with_data(b"\x09" * 102), "is a PNG image that is cut or damaged: "),
        (b"P5 2 2 65535\n" + struct.pack(">4H", 1, 2, 3, 4), "is not a PNG image"),
    ],
)
def test_other_images_are_refused(tmp_path: Path, content: bytes, told: str) -> None:
    write_cameras(tmp_path / "cameras.json", a_rig(1))
    (tmp_path / "depth_00000_c0.png").write_bytes(content)
    with pytest.raises(ValueError, match=f"depth_00000_c0.png: .*{told.replace('$', '(;|$)')}"):
        list(opened(tmp_path))


def test_each_flipped_bit_and_each_lost_byte_of_an_image_is_noticed(tmp_path: Path) -> None:
    """Up to the chunk that ends the image and says nothing, where all pixels are different."""
    pixels = np.random.default_rng(5).integers(1, 65535, (6, 8), np.uint16)
    content, camera = saved(Image.fromarray(pixels)), replace(a_rig(1).cameras[0], size=None)
    file = tmp_path / "image.png"
    file.write_bytes(content)
    expected = read_depth(file, camera)
    for length in range(len(content) - 12):
        file.write_bytes(content[:length])
        assert_refused(file, read=read_depth, camera=camera)
    for place in range(8 * (len(content) - 12)):
        damaged = bytearray(content)
        damaged[place // 8] ^= 1 << place % 8
        file.write_bytes(damaged)
        assert_refused(file, read=read_depth, camera=camera)
    file.write_bytes(content + b"more")
    np.testing.assert_array_equal(read_depth(file, camera), expected)
