"""PNG files of depths: other, damaged and vast ones."""

import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scan_files import a_rig, saved

from dynmesh._errors import DynmeshError
from dynmesh.scans import open_scans, write_cameras
from dynmesh.scans.depth_files import read_depth


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
        (png("L"), "one channel of 16 bits, .* but has one channel of 8 bits$"),
        (png("P"), "one channel of 16 bits, .* but has a palette$"),
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
