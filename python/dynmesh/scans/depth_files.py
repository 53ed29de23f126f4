"""Depth images, one of each camera and frame: PNG, TIFF, OpenEXR and NPY; and masks of them."""

import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, naming, of_library, require
from .cameras import ScanCamera

SUFFIXES = (".png", ".tif", ".tiff", ".exr", ".npy")
"""Of depth images; files of the first are written."""

MOST_COUNTS = 65535

_MOST_FLOATS = 65504.0
"""The largest number of half precision; renderers write it, or more, where nothing is."""

_MODES = ("I;16", "I;16B", "I", "F")
"""Those of Pillow of one channel; before version 10.3, it has "I" for 16 bits."""

_DEPTHS = ("Z", "V", "Y", "R")
"""Names of channels with depth in OpenEXR, of which the first that there is counts."""

MASK_SUFFIXES = (".png", ".tif", ".tiff", ".bmp", ".npy")
COLOUR_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")


class DepthImage(NamedTuple):
    """What the beginning of a file says of the image in it.

    Attributes:
        size: width and height in pixels.
        largest: that count, or number, and those beyond mean that nothing was measured.
        is_counts: whether it holds counts, whose depth the camera states, instead of metres.
        values: reads (h, w) counts or numbers.
    """

    size: tuple[int, int]
    largest: float
    is_counts: bool
    values: Callable[[], NDArray[Any]]


def require_pillow() -> Any:
    """Imports the library for PNG and TIFF, or raises an error that names the extra."""
    return require("PIL.Image", extra="scans")


def read_depth(
    file: Path, camera: ScanCamera, kept: NDArray[np.bool_] | None = None
) -> NDArray[np.float32]:
    """Reads (h, w) distances in the unit of the rig, of the pixels that are `kept`, or all.

    They are 0 where nothing was measured: where the image holds 0, a negative number, NaN or, as of
    some sensors and renderers, the largest.
    """
    with naming(file), file.open("rb") as opened:
        image = _opened(opened, file)
        _check(image, camera)  # before the image is decoded, which may be a thousand times its file
        values = image.values()
        if values.shape != image.size[::-1]:
            raise InputError(f"states {image.size}, but has {values.shape[::-1]} pixels")
    with np.errstate(invalid="ignore"):
        depth = np.where((values > 0) & (values < image.largest), values, 0).astype(np.float64)
    if kept is not None:
        depth *= kept
    rows, columns = (slice(None, None, -1 if axis in camera.flipped else 1) for axis in "yx")
    return (depth[rows, columns] * (camera.depth_scale or 1.0)).astype(np.float32)


def first_of(files: Iterable[Path], camera: ScanCamera) -> DepthImage | None:
    """Returns what the first image of a camera is whose beginning is whole; None without any."""
    wrong: InputError | None = None
    for file in files:
        try:
            with file.open("rb") as opened:
                image = _opened(opened, file)
        except (OSError, InputError):
            continue
        try:
            with naming(file):
                _check(image, camera)
        except InputError as error:
            wrong = wrong or error
            continue
        return image
    if wrong is not None:
        raise wrong
    return None


def write_depth(file: Path, depth: NDArray[np.floating[Any]], camera: ScanCamera) -> None:
    """Writes a PNG image; depths of 65535 counts and beyond, which it cannot hold, become 0."""
    counts = np.rint(depth / (camera.depth_scale or 1.0))
    held = np.where(counts < MOST_COUNTS, counts, 0).astype(np.uint16)
    require_pillow().fromarray(held).save(file, format="PNG")


def read_mask(file: Path, size: tuple[int, int], least: float | None = None) -> NDArray[np.bool_]:
    """Reads (h, w) where an image is at least this; None: where it is not 0 in every channel."""
    with naming(file):
        with of_library("is cut or damaged"):
            if file.suffix.lower() == ".npy":
                values = np.load(file, allow_pickle=False)
            else:
                values = np.asarray(require_pillow().open(file))
        if values.shape[:2] != size[::-1] or values.ndim > 3:
            raise InputError(
                f"has {' x '.join(map(str, values.shape[1::-1]))} pixels, but the depth image "
                f"{size[0]} x {size[1]}"
            )
        if values.ndim == 3:  # without an alpha channel
            values = values[..., : 1 if values.shape[2] == 2 else 3].max(axis=2)
        return np.asarray(values != 0 if least is None else values >= least)


def read_colours(file: Path, camera: ScanCamera) -> NDArray[np.uint8]:
    """Reads (h, w, 3) colours of the pixels of the depth images of a camera."""
    pillow = require_pillow()
    with naming(file), of_library("is cut or damaged"), pillow.open(file) as image:
        if image.mode.startswith(("I", "F")):  # of which a conversion would cut what is above 255
            raise InputError(f"must have 8 bits a channel, not the mode {image.mode}")
        colours, (width, height) = np.asarray(image.convert("RGB")), camera.size or (0, 0)
        if image.size != camera.size:
            raise InputError(
                f"has {image.size[0]} x {image.size[1]} pixels, but the depth images of camera "
                f"{camera.name!r} have {width} x {height}; colours must be registered to depth"
            )
    rows, columns = (slice(None, None, -1 if axis in camera.flipped else 1) for axis in "yx")
    return np.ascontiguousarray(colours[rows, columns])


def _opened(opened: BinaryIO, file: Path) -> DepthImage:
    if not opened.seek(0, os.SEEK_END):
        raise InputError("is empty")
    opened.seek(0)
    suffix = file.suffix.lower()
    if suffix == ".npy":
        return _npy(file)
    return _exr(file) if suffix == ".exr" else _of_pillow(opened, suffix)


def _of_pillow(opened: BinaryIO, suffix: str) -> DepthImage:
    pillow = require_pillow()
    kind = "PNG" if suffix == ".png" else "TIFF"
    tried = f"is a {kind} image that is cut or damaged"

    def begun() -> Any:
        with of_library(tried):
            try:
                return pillow.open(opened, formats=[kind])
            except pillow.UnidentifiedImageError as error:  # with words for programmers
                message = f"is not a {kind} image, or its beginning is damaged"
                raise InputError(message) from error

    image = begun()
    if image.mode not in _MODES:
        raise InputError(
            "must have one channel of 16 bits, the depth in counts, or of 32-bit floats, in "
            f"metres, not the mode {image.mode}"
        )

    def values() -> NDArray[Any]:
        with of_library(tried):
            # Decoding alone skips the checksums, so that a flipped bit would become other depths;
            # once Pillow has looked at them, it must open the image again to decode it.
            image.verify()
            return np.asarray(begun())

    is_counts = image.mode != "F"
    largest = MOST_COUNTS if kind == "PNG" or image.mode != "I" else np.iinfo(np.int32).max
    return DepthImage(image.size, largest if is_counts else _MOST_FLOATS, is_counts, values)


def _exr(file: Path) -> DepthImage:
    library = require("OpenEXR", extra="scans")
    tried = "is an OpenEXR image that is cut or damaged"
    with of_library(tried), library.File(str(file), header_only=True) as image:
        low, high = image.header()["dataWindow"]
        names = [channel.name for channel in image.header()["channels"]]
    ends = [name.rpartition(".")[2] for name in names]
    name = next((names[ends.index(end)] for end in _DEPTHS if end in ends), names[0])

    def values() -> NDArray[Any]:
        with of_library(tried), library.File(str(file), separate_channels=True) as image:
            return np.array(image.channels()[name].pixels, np.float64)

    width, height = (int(n) for n in high - low + 1)
    return DepthImage((width, height), _MOST_FLOATS, False, values)


def _npy(file: Path) -> DepthImage:
    with of_library("is an NPY file that is cut or damaged"):
        values = np.load(file, mmap_mode="r", allow_pickle=False)
    if values.ndim != 2 or values.dtype.kind not in "uif":
        raise InputError(f"must hold (h, w) numbers, not {values.shape} of {values.dtype}")
    is_counts = values.dtype.kind != "f"
    largest = np.iinfo(values.dtype).max if is_counts else _MOST_FLOATS
    return DepthImage(values.shape[::-1], largest, is_counts, lambda: np.array(values))


def _check(image: DepthImage, camera: ScanCamera) -> None:
    if camera.size is not None and image.size != camera.size:
        raise InputError(
            f"has {image.size[0]} x {image.size[1]} pixels, but camera {camera.name!r} has "
            f"{camera.size[0]} x {camera.size[1]}"
        )
    if image.is_counts and camera.depth_scale is None:
        raise InputError(
            f"holds counts, but camera {camera.name!r} states no depth_scale, the depth of one"
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

    Returns the intrinsics (3, 3) of the new images, which show everything that the distorted ones
    do, and a function of a distorted one. A new image has no depth where that has no pixel.
    """
    cv: Any = require("cv2", extra="scans")
    size, coefficients = camera.size, np.array(camera.distortion)
    assert size is not None
    stated = np.reshape(np.asarray(camera.intrinsics), (-1, 3, 3))[0]  # those of all poses
    intrinsics, _ = cv.getOptimalNewCameraMatrix(stated, coefficients, size, 1)
    # For each pixel of a new image, the one that it takes its depth from.
    places = cv.initUndistortRectifyMap(stated, coefficients, None, intrinsics, size, cv.CV_32FC1)
    return intrinsics, lambda depth: np.asarray(cv.remap(depth, *places, cv.INTER_NEAREST))


def without_mirrors(camera: ScanCamera) -> ScanCamera:
    """Returns a camera with positive focal lengths, whose images are reversed instead."""
    matrices = np.array(camera.intrinsics, np.float64)
    first = matrices.reshape(-1, 3, 3)[0]
    axes = [axis for axis, focal in enumerate((first[0, 0], first[1, 1])) if focal < 0]
    if not axes or camera.size is None:
        return camera
    for axis in axes:
        matrices[..., axis, :] *= -1
        matrices[..., axis, 2] += camera.size[axis] - 1
    flipped = {*camera.flipped} ^ {"xy"[axis] for axis in axes}
    return replace(camera, intrinsics=matrices, flipped="".join(sorted(flipped)))
