"""Depth images: PNG files with 16 bits a pixel, one of each camera and frame."""

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, naming, of_library
from .._extras import require
from .cameras import ScanCamera

SUFFIX = ".png"

MOST_COUNTS = 65535

_TRIED = "is a PNG image that is cut or damaged"

_MODES = ("I;16", "I")
"""Of one channel of 16 bits; Pillow before 10.3 has the latter."""


def require_png() -> Any:
    """Imports the library for PNG, or raises an error that names the extra."""
    return require("PIL.Image", extra="scans")


def read_depth(file: Path, camera: ScanCamera) -> NDArray[np.float32]:
    """Reads an image.

    Returns:
        (h, w) distances in the unit of the rig, 0 where nothing was measured: where the count is 0
        or, as of some sensors, the largest.
    """
    with naming(file), file.open("rb") as opened:
        image = _image(opened)
        _check(image, camera)  # before the image is decoded, which may be a thousand times its file
        with of_library(_TRIED):
            # Decoding alone skips the checksums, so that a flipped bit would become other depths;
            # once Pillow has looked at them, it must open the image again to decode it.
            image.verify()
            counts = np.asarray(_image(opened))
            counts = np.where(counts < MOST_COUNTS, counts, 0)
        if counts.shape != image.size[::-1]:
            raise InputError(f"states {image.size}, but has {counts.shape[::-1]} pixels")
    rows, columns = (slice(None, None, -1 if axis in camera.flipped else 1) for axis in "yx")
    return (counts[rows, columns] * (camera.depth_scale or 1.0)).astype(np.float32)


def size_of(files: Iterable[Path], camera: ScanCamera) -> tuple[int, int] | None:
    """Returns the width and height of the first image of a camera whose header is whole.

    Without any, this is what the camera states.
    """
    wrong: InputError | None = None
    for file in files:
        try:
            with file.open("rb") as opened:
                image = _image(opened)
        except (OSError, InputError):
            continue
        try:
            with naming(file):
                _check(image, camera)
        except InputError as error:
            wrong = wrong or error
            continue
        width, height = image.size
        return width, height
    if wrong is not None:
        raise wrong
    return camera.size


def write_depth(file: Path, depth: NDArray[np.floating[Any]], camera: ScanCamera) -> None:
    """Writes an image; depths of 65535 counts and beyond become 0, as nothing can be measured."""
    counts = np.rint(depth / (camera.depth_scale or 1.0))
    held = np.where(counts < MOST_COUNTS, counts, 0).astype(np.uint16)
    require_png().fromarray(held).save(file, format="PNG")


def _image(opened: BinaryIO) -> Any:
    """Reads the header of an image."""
    pillow = require_png()
    if not opened.seek(0, os.SEEK_END):
        raise InputError("is empty; a depth image is a PNG image with 16 bits")
    opened.seek(0)
    with of_library(_TRIED):
        try:
            return pillow.open(opened, formats=["PNG"])
        except pillow.UnidentifiedImageError as error:  # with words for programmers
            raise InputError("is not a PNG image, or its beginning is damaged") from error


def _check(image: Any, camera: ScanCamera) -> None:
    if image.mode not in _MODES:
        raise InputError(
            f"must have one channel of 16 bits, the depth in counts, not the mode {image.mode}"
        )
    if camera.size is not None and image.size != camera.size:
        raise InputError(
            f"has {image.width} x {image.height} pixels, but camera {camera.name!r} has "
            f"{camera.size[0]} x {camera.size[1]}"
        )


def along_axis(
    distances: NDArray[np.float32], intrinsics: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Returns (h, w) distances along the axis of a camera, given those along the rays of pixels."""
    rows, columns = np.indices(distances.shape)
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(intrinsics).T
    return np.asarray(distances / np.linalg.norm(rays, axis=-1), np.float32)


def undistortion(
    camera: ScanCamera,
) -> tuple[NDArray[np.float64], Callable[[NDArray[np.float32]], NDArray[np.float32]]]:
    """Finds how OpenCV undoes the distortion of a camera, without interpolation between depths.

    Returns:
        The intrinsics (3, 3) of the new images, which show everything that the distorted ones do,
        and a function that returns the new image of a distorted one. It has no depth where that
        has no pixel.
    """
    cv: Any = require("cv2", extra="scans")
    size, coefficients = camera.size, np.array(camera.distortion)
    assert size is not None
    stated = np.reshape(np.asarray(camera.intrinsics), (-1, 3, 3))[0]  # those of all poses
    intrinsics, _ = cv.getOptimalNewCameraMatrix(stated, coefficients, size, 1)
    # For each pixel of a new image, the one that it takes its depth from.
    places = cv.initUndistortRectifyMap(stated, coefficients, None, intrinsics, size, cv.CV_32FC1)
    return intrinsics, lambda depth: np.asarray(cv.remap(depth, *places, cv.INTER_NEAREST))
