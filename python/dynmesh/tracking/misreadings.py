"""What may be wrong with a camera file, and what makes the cameras that are meant."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from .._arrays import Floats
from ..scans import ScanCamera
from ..scans.other_cameras import OPENGL


def _transposed(pose: Floats) -> Floats:
    turned = pose.copy()
    turned[..., :3, :3] = np.swapaxes(pose[..., :3, :3], -1, -2)
    return turned


def _posed(change: Callable[[Floats], Any], camera: ScanCamera) -> ScanCamera:
    return replace(camera, camera_to_world=change(camera.camera_to_world))


def _scaled(positions: float, depths: float, camera: ScanCamera) -> ScanCamera:
    """Multiplies the position of the camera and the depth of a count."""
    pose = camera.camera_to_world * np.array([[1, 1, 1, positions]] * 3 + [[1] * 4])
    return replace(camera, camera_to_world=pose, depth_scale=depths * (camera.depth_scale or 1.0))


def _resized(factor: float, camera: ScanCamera) -> ScanCamera:
    return replace(camera, intrinsics=np.diag([factor, factor, 1]) @ np.asarray(camera.intrinsics))


def _with_centre_exchanged(camera: ScanCamera) -> ScanCamera:
    matrix = np.array(camera.intrinsics)
    matrix[..., :2, 2] = matrix[..., 1::-1, 2]
    return replace(camera, intrinsics=matrix)


def _with_counts_in_a_unit(camera: ScanCamera) -> ScanCamera:
    return replace(camera, depth_scale=1 / (camera.depth_scale or 1.0))


def exchanged(one: str, other: str, camera: ScanCamera) -> ScanCamera:
    """Gives a camera the images of the other one, if it is one of these."""
    return replace(camera, name={one: other, other: one}.get(camera.name, camera.name))


Reading: TypeAlias = tuple[str, Callable[[ScanCamera], ScanCamera]]
"""What may be wrong with a camera file, in a sentence, and what makes a camera that is meant."""

READINGS: tuple[Reading, ...] = (
    (
        "the poses are inverted: they lead from the world to the cameras, as extrinsics do",
        partial(_posed, np.linalg.inv),
    ),
    (
        "the cameras have the axes of OpenGL, x right, y up, z back, instead of those of OpenCV",
        partial(_posed, lambda pose: pose @ OPENGL),
    ),
    (
        "the poses are inverted, from the world to the cameras, which have the axes of OpenGL",
        partial(_posed, lambda pose: np.linalg.inv(pose) @ OPENGL),
    ),
    ("the rotations of the poses are transposed", partial(_posed, _transposed)),
    *(
        (f"depth_scale is {factor} times too {which}", partial(_scaled, 1, factor**power))
        for factor in (5, 10, 100, 1000)
        for which, power in (("large", -1.0), ("small", 1.0))
    ),
    ("the intrinsics are those of images twice as large", partial(_resized, 0.5)),
    ("the intrinsics are those of images half as large", partial(_resized, 2)),
    ("cx and cy of the intrinsics are exchanged", _with_centre_exchanged),
    (
        "depth_scale is the number of counts in a unit instead of the depth of one count",
        _with_counts_in_a_unit,
    ),
    (
        "the positions of the cameras are in millimetres and everything else in metres",
        partial(_scaled, 1e-3, 1),
    ),
    (
        "positions and depths of the cameras are in millimetres and the template in metres",
        partial(_scaled, 1e-3, 1e-3),
    ),
)

READINGS_OF_IMAGES: tuple[Reading, ...] = (
    (
        "depths are distances from the camera along the rays of the pixels, not along the axis",
        partial(replace, along_ray=True),
    ),
    ("the images are mirrored: left and right are exchanged", partial(replace, flipped="x")),
    ("the images are flipped: top and bottom are exchanged", partial(replace, flipped="y")),
    ("the images are turned by 180 degrees", partial(replace, flipped="xy")),
)
"""Those that come last, as mirrored images of a symmetric subject look as from other cameras."""
