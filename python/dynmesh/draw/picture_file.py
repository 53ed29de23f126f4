"""Files of pictures: PNG, and GIF, WebP and MP4, which move."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from .._extras import require, require_all

MOVING = (".gif", ".webp", ".mp4")
PICTURES = (".png", *MOVING)
"""Suffixes."""


def require_format(path: Path) -> None:
    """Imports what a file needs, so that a missing library is reported before any work."""
    if path.suffix.lower() == ".mp4":
        require_all("imageio.v2", "imageio_ffmpeg", extra="movie")


def write(images: Iterable[Any], path: Path, fps: float) -> Any:
    """Writes images of Pillow, all of one size, and returns the first of them.

    GIF and WebP are in memory until they are written, and play again and again.
    """
    if path.suffix.lower() == ".mp4":
        return _write_movie(images, path, fps)
    first, *others = images
    if others:
        first.save(path, save_all=True, append_images=others, duration=1000 / fps, loop=0)
    else:
        first.save(path)
    return first


def _write_movie(images: Iterable[Any], path: Path, fps: float) -> Any:
    first = None
    imageio = require("imageio.v2", extra="movie")
    with imageio.get_writer(path, fps=fps, macro_block_size=1) as writer:
        for image in images:
            first = first or image
            height, width = image.height, image.width
            # H.264 stores colours of two by two pixels.
            even = ((0, height % 2), (0, width % 2), (0, 0))
            writer.append_data(np.pad(np.asarray(image), even, mode="edge"))
    return first
