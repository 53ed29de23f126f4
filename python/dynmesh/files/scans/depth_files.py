"""Depth images: PNG files with 16 bits a pixel, one of each camera and frame."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._extras import require
from ..naming import naming
from .cameras import ScanCamera

SUFFIX = ".png"

MOST_COUNTS = 65535


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
        try:
            with image.open(opened, formats=["PNG"]) as found:
                mode, size = found.mode, found.size
                _check(mode, size, camera)
                counts = np.asarray(found)
        except (OSError, SyntaxError, image.DecompressionBombError) as error:
            raise ValueError(f"is not a PNG image, or damaged: {error}") from error
    scale = 1.0 if camera.depth_scale is None else camera.depth_scale
    return (counts * scale).astype(np.float32)


def write_depth(file: Path, depth: NDArray[np.floating[Any]], camera: ScanCamera) -> None:
    """Writes an image; depths beyond 65535 counts become 0, as nothing can be measured there."""
    scale = 1.0 if camera.depth_scale is None else camera.depth_scale
    counts = np.rint(depth / scale)
    held = np.where(counts <= MOST_COUNTS, counts, 0).astype(np.uint16)
    require_png().fromarray(held).save(file, format="PNG")


def _check(mode: str, size: tuple[int, int], camera: ScanCamera) -> None:
    if not mode.startswith("I"):
        raise ValueError(f"must have one channel of 16 bits, but its mode is {mode}")
    if camera.size is not None and size != camera.size:
        raise ValueError(
            f"has {size[0]} x {size[1]} pixels, but camera {camera.name!r} has "
            f"{camera.size[0]} x {camera.size[1]}"
        )
