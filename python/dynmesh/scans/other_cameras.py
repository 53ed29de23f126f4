"""Cameras in `transforms.json`, as `cameras.json` would hold them.

As nerfstudio and instant-ngp read it, it has a pose for each image. They lead from the axes of
OpenGL, x right, y up, z back, to the world; the corner of the first pixel is at (0, 0); and depth
images may have fewer pixels than those of the intrinsics.
"""

import re
import struct
from pathlib import Path
from typing import Any

import numpy as np

from .._checks import check_finite, check_positive
from .._errors import InputError, within
from ..formats.names import by_number, numbers_in
from .matrices import pose_of

OPENGL = np.diag([1.0, -1, -1, 1])
"""From the axes of a camera in OpenGL to those in OpenCV."""

_MODELS = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE")
_LENS = ("k1", "k2", "k3", "k4", "p1", "p2", "is_fisheye")
_MATRIX = ("fl_x", "fl_y", "cx", "cy", "w", "h")


def as_cameras(transforms: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Returns what `cameras.json` would hold: a camera that moves for each folder of images.

    Args:
        transforms: the object in the file.
        folder: of the file, from which the names of images lead to them.
    """
    frames = transforms["frames"]
    if not isinstance(frames, list) or not frames:
        raise InputError(f"frames: must be a list of them, not {frames!r:.60}")
    by_folder = dict[str, dict[Path, dict[str, Any]]]()
    for number, frame in enumerate(frames):
        if not isinstance(frame, dict):
            raise InputError(f"frames: {number} must be an object, not {frame!r:.60}")
        name = frame.get("depth_file_path", frame.get("file_path"))
        if not isinstance(name, str):
            raise InputError(f"frames: {number}: file_path: must be a name, not {name!r:.60}")
        file = folder / name.replace("\\", "/")
        by_folder.setdefault(file.parent.name, {})[file] = frame
    return {"cameras": [_camera(name, images, transforms) for name, images in by_folder.items()]}


def _camera(
    name: str, images: dict[Path, dict[str, Any]], transforms: dict[str, Any]
) -> dict[str, Any]:
    """Describes the camera of the images in a folder."""
    files, poses = [*images], list[dict[str, Any]]()
    described: dict[str, Any] = {
        "name": re.sub("[^A-Za-z0-9.-]", "-", name) or "camera",
        "poses": poses,
    }
    numbers, pattern = numbers_in(files, [file.stem for file in files])
    if pattern is None:
        raise InputError(
            f"frames: {files[0].name}: has no number of a frame, or the names differ in several"
        )
    for number, file in by_number(zip(numbers, files, strict=True)).items():
        with within(f"frames: {file.name}"):
            stated = _joined(transforms, images[file])
            pose = pose_of("transform_matrix", _needed("transform_matrix", stated)) @ OPENGL
            poses.append({"frame": number, "camera_to_world": pose.tolist()})
            if "fl_x" in stated:
                if "width" not in described:
                    described |= _images(files[0], stated)
                size = described["width"], described["height"]
                poses[-1]["intrinsics"] = _intrinsics(stated, *size)
    return described


def _joined(transforms: dict[str, Any], frame: dict[str, Any]) -> dict[str, Any]:
    """Returns what the file states of all images and of this one, which must not disagree."""
    stated = {**transforms, **frame}
    for field in _MATRIX:
        if transforms.get(field, stated.get(field)) != stated.get(field):
            message = f"is {frame[field]!r:.40}, but {transforms[field]!r:.40} for all images"
            raise InputError(f"{field}: {message}; remove one of them")
    for field in _LENS:
        if stated.get(field):
            message = f"is {stated[field]!r:.40}, but must be 0: undistort the images"
            raise InputError(f"{field}: {message}")
    if stated.get("camera_model", _MODELS[0]) not in _MODELS:
        message = f"must be one of {', '.join(_MODELS)}, not {stated['camera_model']!r:.60}"
        raise InputError(f"camera_model: {message}")
    return stated


def _intrinsics(stated: dict[str, Any], width: int, height: int) -> list[list[float]]:
    """Returns those of images of this size, with the centre of the first pixel at (0, 0)."""
    for field in ("fl_x", "fl_y", "cx", "cy"):
        check_finite(field, _needed(field, stated))
    across, down = width / stated["w"], height / stated["h"]
    return [
        [stated["fl_x"] * across, 0, stated["cx"] * across - 0.5],
        [0, stated["fl_y"] * down, stated["cy"] * down - 0.5],
        [0, 0, 1],
    ]


def _images(first: Path, stated: dict[str, Any]) -> dict[str, Any]:
    """Describes depth images like the first, which may have fewer pixels than is stated."""
    for field in ("w", "h"):
        check_positive(field, _needed(field, stated))
    width, height = int(stated["w"]), int(stated["h"])
    if first.suffix.lower() == ".png" and first.is_file():
        with first.open("rb") as image:
            header = image.read(24)
        if len(header) == 24:
            width, height = struct.unpack(">II", header[16:])
    metres, scale = stated.get("depth_unit_scale_factor", 1e-3), stated.get("applied_scale", 1.0)
    for field, value in (("depth_unit_scale_factor", metres), ("applied_scale", scale)):
        check_positive(field, value)
    # That of instant-ngp is in the unit of the poses.
    count = stated.get("integer_depth_scale", metres * scale)
    return {"width": width, "height": height, "depth_scale": count}


def _needed(field: str, stated: dict[str, Any]) -> Any:
    if field not in stated:
        raise InputError(f"{field}: is missing")
    return stated[field]
