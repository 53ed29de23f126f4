"""What may be meant by a file of cameras that do not fit as they are stated."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from .._arrays import Floats
from ..scans import ScanCamera
from ..scans.trajectories import OPENGL


def _posed(change: Callable[[Floats], Any], camera: ScanCamera) -> ScanCamera:
    return replace(camera, camera_to_world=change(camera.camera_to_world))


def _scaled(positions: float, depths: float, camera: ScanCamera) -> ScanCamera:
    pose = camera.camera_to_world * np.array([[1, 1, 1, positions]] * 3 + [[1] * 4])
    return replace(camera, camera_to_world=pose, depth_scale=depths * (camera.depth_scale or 1.0))


def _resized(factor: float, camera: ScanCamera) -> ScanCamera:
    return replace(camera, intrinsics=np.diag([factor, factor, 1]) @ np.asarray(camera.intrinsics))


def _flipped(axes: str, camera: ScanCamera) -> ScanCamera:
    return replace(camera, flipped="".join(sorted({*camera.flipped} ^ {*axes})))


Reading: TypeAlias = Callable[[ScanCamera], ScanCamera]

READINGS: dict[str, Reading] = {
    "the poses are inverted: `poses` says where they lead": partial(_posed, np.linalg.inv),
    "the cameras have the axes of OpenGL, x right, y up, z back": partial(
        _posed, lambda pose: pose @ OPENGL
    ),
    "depth_scale is 1000 times too large": partial(_scaled, 1, 1e-3),
    "depth_scale is 1000 times too small": partial(_scaled, 1, 1e3),
    "the positions of the cameras are 1000 times too large": partial(_scaled, 1e-3, 1),
    "positions and depths of the cameras are 1000 times too large": partial(_scaled, 1e-3, 1e-3),
    "positions and depths of the cameras are 1000 times too small": partial(_scaled, 1e3, 1e3),
    "the intrinsics are those of images twice as large": partial(_resized, 0.5),
    "the intrinsics are those of images half as large": partial(_resized, 2),
    "along_ray is wrong: whether depths are distances along the rays of the pixels": (
        lambda camera: replace(camera, along_ray=not camera.along_ray)
    ),
    "flipped is wrong: left and right are exchanged": partial(_flipped, "x"),
    "flipped is wrong: top and bottom are exchanged": partial(_flipped, "y"),
}
"""What is wrong in a file of cameras, and what makes the camera that is meant."""
