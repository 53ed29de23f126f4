"""Depth images: PNG files with 16 bits a pixel, one of each camera and frame."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._extras import require
from ..naming import naming
from .cameras import ScanCamera

SUFFIX = ".png"

MOST_COUNTS = 65535

_BEGINNING = b"\x89PNG\r\n\x1a\n"
_MODES = {
    "1": "one bit",
    "L": "one of 8 bits",
    "P": "a palette",
    "LA": "one of 8 bits and transparency",
    "RGB": "colours",
    "RGBA": "colours or transparency",
}
"""What images of other kinds have, by Pillow's name of the kind."""


def require_png() -> Any:
    """Imports the library for PNG, or raises an error that names the extra."""
    return require("PIL.Image", extra="scans")


def read_depth(file: Path, camera: ScanCamera) -> NDArray[np.float32]:
    """Reads an image.

    Returns:
        (h, w) distances in the unit of the rig, 0 where nothing was measured.

    Raises:
        ImportError: Pillow is not installed.
        OSError: the file cannot be read.
        ValueError: it is no such image, or has another size than the camera states.
    """
    image = require_png()
    with naming(file), file.open("rb") as opened:
        header = opened.read(24)
        _check_beginning(header)
        opened.seek(0)
        try:
            with image.open(opened, formats=["PNG"]) as found:
                counts = np.asarray(found)
                mode, size = found.mode, found.size
        except image.DecompressionBombError as error:
            width, height = struct.unpack(">II", header[16:])
            raise ValueError(
                f"is damaged, or too large: its header states {width} x {height} pixels"
            ) from error
        except (OSError, SyntaxError, ValueError) as error:  # with words for programmers
            raise ValueError(
                f"is a PNG image that is cut or damaged; it has {file.stat().st_size} bytes"
            ) from error
        _check(mode, size, camera)
    scale = 1.0 if camera.depth_scale is None else camera.depth_scale
    return (counts * scale).astype(np.float32)


def write_depth(file: Path, depth: NDArray[np.floating[Any]], camera: ScanCamera) -> None:
    """Writes an image; depths beyond 65535 counts become 0, as nothing can be measured there."""
    scale = 1.0 if camera.depth_scale is None else camera.depth_scale
    counts = np.rint(depth / scale)
    held = np.where(counts <= MOST_COUNTS, counts, 0).astype(np.uint16)
    require_png().fromarray(held).save(file, format="PNG")


def _check_beginning(header: bytes) -> None:
    if not header:
        raise ValueError("is empty; a depth image is a PNG image with 16 bits")
    if not header.startswith(_BEGINNING[: len(header)]):
        raise ValueError(f"is not a PNG image: it begins with {header[:8]!r}")


def _check(mode: str, size: tuple[int, int], camera: ScanCamera) -> None:
    if not mode.startswith("I"):
        raise ValueError(
            "must have one channel of 16 bits, the depth in counts, but has "
            f"{_MODES.get(mode, 'another kind of channels')} (mode {mode})"
        )
    if camera.size is not None and size != camera.size:
        raise ValueError(
            f"has {size[0]} x {size[1]} pixels, but camera {camera.name!r} has "
            f"{camera.size[0]} x {camera.size[1]}"
        )
