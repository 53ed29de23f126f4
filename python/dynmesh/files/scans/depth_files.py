"""Depth images: PNG files with 16 bits a pixel, one of each camera and frame."""

import io
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._errors import DynmeshError, InputError
from ..._extras import require
from ...frames.naming import naming
from .cameras import ScanCamera
from .png import HEADER_SIZE, SIGNATURE, PngHeader, read_header, sound_image

SUFFIX = ".png"

MOST_COUNTS = 65535

_MOST_PIXELS = 2**26
"""8192 by 8192, far above what depth cameras deliver."""

_LOOKED_AT = 9
"""Images whose headers tell the size of those of a camera."""

_GREY = 0
_CHANNELS = {
    _GREY: "one channel",
    2: "colours (RGB)",
    3: "a palette",
    4: "one channel and transparency",
    6: "colours and transparency (RGBA)",
}
"""What images have, by how PNG numbers it."""


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
        beginning = opened.read(HEADER_SIZE)
        if not beginning:
            raise ValueError("is empty; a depth image is a PNG image with 16 bits")
        if not beginning.startswith(SIGNATURE[: len(beginning)]):
            raise ValueError(f"is not a PNG image: it begins with {beginning[:8]!r}")
        header = read_header(beginning)
        _check(header, camera)  # before the image, which may be a thousand times its file
        content = sound_image(beginning + opened.read(), header)
        try:
            with image.open(io.BytesIO(content), formats=["PNG"]) as found:
                counts = np.asarray(found)
        except (OSError, SyntaxError, ValueError) as error:  # with words for programmers
            raise ValueError(f"is a PNG image that is cut or damaged: {error}") from error
    scale = 1.0 if camera.depth_scale is None else camera.depth_scale
    return (counts * scale).astype(np.float32)


def usual_size(files: Sequence[Path], camera: ScanCamera) -> tuple[int, int] | None:
    """Returns the width and height of most images of a camera, judged by the headers of a few.

    Damaged headers do not count; without any other, this is what the camera states.

    Raises:
        ValueError: these images are of another kind, or of another size than the camera states.
    """
    sizes: Counter[tuple[int, int]] = Counter()
    first: InputError | None = None
    for number in np.linspace(0, len(files) - 1, min(len(files), _LOOKED_AT)).astype(int):
        header = _header_of(files[number])
        if header is not None:
            try:
                with naming(files[number]):
                    _check(header, camera)
                sizes[header.width, header.height] += 1
            except InputError as error:
                first = first or error
    if first is not None and not sizes:
        raise first
    return sizes.most_common(1)[0][0] if sizes else camera.size


def read_size(file: Path) -> tuple[int, int] | None:
    """Returns the width and height of an image, or None if it is damaged."""
    header = _header_of(file)
    return None if header is None else (header.width, header.height)


def _header_of(file: Path) -> PngHeader | None:
    """Returns the header of an image, or None if it is damaged."""
    try:
        with naming(file), file.open("rb") as opened:
            beginning = opened.read(HEADER_SIZE)
            return read_header(beginning) if beginning.startswith(SIGNATURE) else None
    except (DynmeshError, OSError):
        return None


def write_depth(file: Path, depth: NDArray[np.floating[Any]], camera: ScanCamera) -> None:
    """Writes an image; depths beyond 65535 counts become 0, as nothing can be measured there."""
    scale = 1.0 if camera.depth_scale is None else camera.depth_scale
    counts = np.rint(depth / scale)
    held = np.where(counts <= MOST_COUNTS, counts, 0).astype(np.uint16)
    require_png().fromarray(held).save(file, format="PNG")


def _check(header: PngHeader, camera: ScanCamera) -> None:
    if (header.bits, header.channels) != (16, _GREY):
        raise ValueError(
            "must have one channel of 16 bits, the depth in counts, but has "
            f"{_CHANNELS.get(header.channels, 'another kind of channels')} of {header.bits} "
            f"bit{'s' if header.bits > 1 else ''}"
        )
    if camera.size is not None and (header.width, header.height) != camera.size:
        raise ValueError(
            f"has {header.width} x {header.height} pixels, but camera {camera.name!r} has "
            f"{camera.size[0]} x {camera.size[1]}"
        )
    if header.width * header.height > _MOST_PIXELS:
        raise ValueError(
            f"is damaged, or too large: its header states {header.width} x {header.height} pixels, "
            f"more than {_MOST_PIXELS}"
        )
