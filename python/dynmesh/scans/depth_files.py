"""Depth images: PNG files with 16 bits a pixel, one of each camera and frame."""

import os
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError
from .._extras import require
from ..files.naming import naming
from .cameras import ScanCamera

SUFFIX = ".png"

MOST_COUNTS = 65535

_LOOKED_AT = 9
"""Images whose headers tell the size of those of a camera."""

_MODES = ("I;16", "I")
"""Of one channel of 16 bits; Pillow before 10.3 has the latter."""

_KINDS = {
    "1": "one channel of 1 bit",
    "L": "one channel of 8 bits",
    "LA": "one channel and transparency",
    "P": "a palette",
    "RGB": "colours (RGB)",
    "RGBA": "colours and transparency (RGBA)",
}
"""What images of other modes have, by the names that Pillow gives these."""


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
    with naming(file), file.open("rb") as opened:
        image = _image(opened)
        _check(image, camera)  # before the image is decoded, which may be a thousand times its file
        try:
            # Decoding alone skips the checksums, so that a flipped bit would become other depths;
            # once Pillow has looked at them, it must open the image again to decode it.
            image.verify()
            counts = np.asarray(_image(opened))
        except (OSError, SyntaxError) as error:
            raise ValueError(f"is a PNG image that is cut or damaged: {error}") from error
    return (counts * (camera.depth_scale or 1.0)).astype(np.float32)


def usual_size(files: Sequence[Path], camera: ScanCamera) -> tuple[int, int] | None:
    """Returns the width and height of most images of a camera, judged by the headers of a few.

    Damaged headers do not count; without any other, this is what the camera states.

    Raises:
        ValueError: these images are of another kind, or of another size than the camera states.
    """
    sizes: Counter[tuple[int, int]] = Counter()
    first: InputError | None = None
    for number in np.linspace(0, len(files) - 1, min(len(files), _LOOKED_AT)).astype(int):
        file = files[number]
        try:
            with file.open("rb") as opened:
                image = _image(opened)
        except (OSError, ValueError):
            continue
        try:
            with naming(file):
                _check(image, camera)
            sizes[image.size] += 1
        except InputError as error:
            first = first or error
    if first is not None and not sizes:
        raise first
    return sizes.most_common(1)[0][0] if sizes else camera.size


def write_depth(file: Path, depth: NDArray[np.floating[Any]], camera: ScanCamera) -> None:
    """Writes an image; depths beyond 65535 counts become 0, as nothing can be measured there."""
    scale = 1.0 if camera.depth_scale is None else camera.depth_scale
    counts = np.rint(depth / scale)
    held = np.where(counts <= MOST_COUNTS, counts, 0).astype(np.uint16)
    require_png().fromarray(held).save(file, format="PNG")


def _image(opened: BinaryIO) -> Any:
    """Reads the header of an image."""
    pillow = require_png()
    if not opened.seek(0, os.SEEK_END):
        raise InputError("is empty; a depth image is a PNG image with 16 bits")
    opened.seek(0)
    try:
        return pillow.open(opened, formats=["PNG"])
    except pillow.UnidentifiedImageError as error:  # with words for programmers
        raise InputError("is not a PNG image, or its beginning is damaged") from error
    except (OSError, SyntaxError, ValueError, pillow.DecompressionBombError) as error:
        raise InputError(f"is a PNG image that is cut, damaged or too large: {error}") from error


def _check(image: Any, camera: ScanCamera) -> None:
    if image.mode not in _MODES:
        raise InputError(
            "must have one channel of 16 bits, the depth in counts, but has "
            + _KINDS.get(image.mode, f"the mode {image.mode}")
        )
    if camera.size is not None and image.size != camera.size:
        raise InputError(
            f"has {image.width} x {image.height} pixels, but camera {camera.name!r} has "
            f"{camera.size[0]} x {camera.size[1]}"
        )
