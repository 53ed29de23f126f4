"""Depth images: which is of which camera and frame, and other, damaged, vast and lost ones."""

import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scan_files import a_rig, saved, seen, some_points, three_frames

from dynmesh._errors import DynmeshError
from dynmesh.scans import DepthFolder, DepthScan, Rig, open_scans, write_cameras
from dynmesh.scans.depth_files import read_depth


def test_depth_images_come_back_to_half_a_count(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    rig = a_rig(2)
    images = rng.uniform(0.5, 60.0, (3, 2, 6, 8)).astype(np.float32)
    images[0, 0, 2, 3] = 0
    images[1, 1, 0, 0] = 70.0  # more than 65535 counts
    matrices = [np.asarray(camera.intrinsics) for camera in rig.cameras]
    poses = [camera.camera_to_world for camera in rig.cameras]
    with DepthFolder(tmp_path / "scans", rig) as folder:
        for pair in images:
            folder.append(DepthScan(list(pair), matrices, poses))
    images[1, 1, 0, 0] = 0
    reader = open_scans(tmp_path / "scans")
    for pair, found in zip(images, reader, strict=True):
        assert isinstance(found, DepthScan)
        np.testing.assert_allclose(found.depth, pair, atol=0.0005 + 1e-5)
        assert (np.array(found.depth) == 0).sum() == (pair == 0).sum()
        np.testing.assert_array_equal(found.intrinsics, matrices)
        np.testing.assert_array_equal(found.poses, poses)


def test_gaps_are_refused_or_lost(tmp_path: Path) -> None:
    for number in (10, 12, 13):
        np.savetxt(tmp_path / f"scan_{number}.xyz", some_points().points)
    with pytest.raises(ValueError, match=r"scan_11\.xyz is missing"):
        open_scans(tmp_path)
    reader = open_scans(tmp_path, gaps="lost")
    assert [scan is None for scan in reader] == [False, True, False, False]
    assert (reader.start, reader.step) == (10, 1)


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
    reader = open_scans(folder)
    assert seen(reader) == [[("c1", 1)], [], [("c0", 3), ("c1", 3)]]
    assert len(reader.lost) == 3
    assert all(told in why for why in reader.lost)
    (folder / "depth_00002_c1.png").unlink()
    reader = open_scans(folder, gaps="lost")
    assert seen(reader) == [[("c1", 1)], [], [("c0", 3)]]
    for pattern in ("depth_%05d_c0.png", "depth_*_c0.png", "depth_%05d.png"):
        assert open_scans(folder / pattern, gaps="lost").n_frames == 3
    assert "'c1'" in reader.lost[-1]
    assert "frame 2" in reader.lost[-1]


def test_a_camera_with_other_images_only_is_refused(tmp_path: Path) -> None:
    folder = three_frames(tmp_path / "s")
    for file in folder.glob("*_c1.png"):
        file.write_bytes(saved(Image.new("I;16", (9, 6), 7)))
    with pytest.raises(
        DynmeshError, match=r"_c1\.png: has 9 x 6 pixels, but camera 'c1' has 8 x 6"
    ):
        open_scans(folder)


@pytest.mark.parametrize("named", ["{camera}/{n}", "{camera}/frame_{n}", "{camera}/d_{n}_{camera}"])
@pytest.mark.parametrize("names", ["01", "ab"])
def test_each_camera_may_have_a_folder(tmp_path: Path, named: str, names: str) -> None:
    rig = Rig(tuple(replace(c, name=n) for c, n in zip(a_rig(2).cameras, names, strict=True)))
    write_cameras(tmp_path / "cameras.json", rig)
    for number in range(2):
        for camera in names:
            file = tmp_path / (named.format(camera=camera, n=number) + ".png")
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(saved(Image.new("I;16", (8, 6), 1000 + number)))
    expected = [[(camera, 1 + number / 1000) for camera in names] for number in range(2)]
    assert seen(open_scans(tmp_path)) == expected
    glob = open_scans(tmp_path / "*" / "*.png", cameras=tmp_path / "cameras.json")
    assert seen(glob) == expected
    colours = tmp_path / "colours" / "0.png"
    colours.parent.mkdir()
    colours.write_bytes(saved(Image.new("RGB", (8, 6))))
    assert seen(open_scans(tmp_path)) == expected
    write_cameras(tmp_path / "one.json", Rig(rig.cameras[:1]))
    one = open_scans(tmp_path, cameras=tmp_path / "one.json")
    assert seen(one) == [scans[:1] for scans in expected]


def png(mode: str, size: tuple[int, int] = (8, 6)) -> bytes:
    """An image of another kind."""
    image = Image.new(mode, size)
    image.putpixel((3, 2), 1234 if mode == "I;16" else 0)
    return saved(image)


def chunk(kind: bytes, content: bytes) -> bytes:
    """A part of a PNG file."""
    return (
        struct.pack(">I", len(content)) + kind + content
        + struct.pack(">I", zlib.crc32(kind + content))
    )  # fmt: skip


def sized(image: bytes, width: int, height: int) -> bytes:
    """The image with a header that states another size."""
    return image[:8] + chunk(b"IHDR", struct.pack(">II", width, height) + image[24:29]) + image[33:]


def with_data(rows: bytes, interlaced: int = 0) -> bytes:
    """An image of 8 x 6 pixels with this as the compressed image data."""
    header = struct.pack(">IIBBBBB", 8, 6, 16, 0, 0, 0, interlaced)
    return png("I;16")[:8] + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def noisy() -> bytes:
    """An image whose pixels are all different, so that each bit of the file counts."""
    return saved(Image.fromarray(np.random.default_rng(5).integers(1, 65535, (6, 8), np.uint16)))


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (png("L"), "one channel of 16 bits, .* not the mode L$"),
        (png("P"), "one channel of 16 bits, .* not the mode P$"),
        (png("I;16", (4, 4)), "has 4 x 4 pixels, but camera 'c0' has 8 x 6"),
        (sized(png("I;16"), 60000, 60000), "too large: "),
        (with_data(zlib.compress(bytes(101))), "is a PNG image that is cut or damaged: "),
        (with_data(zlib.compress(b"\x09" * 102)), "is a PNG image that is cut or damaged: "),
        (b"P5 2 2 65535\n" + struct.pack(">4H", 1, 2, 3, 4), "is not a PNG image"),
    ],
)
def test_other_images_are_refused(tmp_path: Path, content: bytes, told: str) -> None:
    write_cameras(tmp_path / "cameras.json", a_rig(1))
    (tmp_path / "depth_00000_c0.png").write_bytes(content)
    with pytest.raises(ValueError, match=f"depth_00000_c0.png: .*{told.replace('$', '(;|$)')}"):
        list(open_scans(tmp_path))


def test_each_flipped_bit_and_each_lost_byte_of_an_image_is_noticed(tmp_path: Path) -> None:
    """Up to the chunk that ends the image and says nothing."""
    content, camera = noisy(), replace(a_rig(1).cameras[0], size=None)
    file = tmp_path / "image.png"
    file.write_bytes(content)
    expected = read_depth(file, camera)
    for length in range(len(content) - 12):
        file.write_bytes(content[:length])
        with pytest.raises(DynmeshError, match=r"image\.png: "):
            read_depth(file, camera)
    for place in range(8 * (len(content) - 12)):
        damaged = bytearray(content)
        damaged[place // 8] ^= 1 << place % 8
        file.write_bytes(damaged)
        with pytest.raises(DynmeshError, match=r"image\.png: "):
            read_depth(file, camera)
    file.write_bytes(content + b"more")
    np.testing.assert_array_equal(read_depth(file, camera), expected)
