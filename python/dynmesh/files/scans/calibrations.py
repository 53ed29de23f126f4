"""Calibrations as other programs write them, in the words of `cameras.json`.

Open3D writes matrices column by column, and poses from the world to the camera. The Azure Kinect
stores its calibration in recordings, in shares of the sensor with the corner of the first pixel at
(0, 0), of which each mode of the depth camera shows a part. librealsense has no files of its own,
but what is written with its names of intrinsics is recognised: `ppx`, `ppy`, `coeffs`, `model`.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

_KINECT_MODES = {
    (640, 576): (1024, 192, 180),
    (320, 288): (512, 96, 90),
    (512, 512): (512, 0, 0),
    (1024, 1024): (1024, 0, 0),
}
"""By the size of the images of a mode of the depth camera: the side of the sensor in its pixels,
and the column and row at which it begins."""

_KINECT_RADIUS = 1.7
"""Where a calibration states none."""

_BROWN_CONRADY = ("4", "brownconrady", "distortionbrownconrady")
"""The model of librealsense that is that of OpenCV, as it is numbered or named."""

_SizeOfImages = Callable[[], tuple[int, int] | None]


def as_cameras(found: Any, size_of_images: _SizeOfImages) -> dict[str, Any] | None:
    """Returns what `cameras.json` would hold; None if it is no calibration of another program.

    The cameras of Open3D are named by their numbers from 0; a single depth camera is "depth", and
    the world has its axes.

    Raises:
        ValueError: the calibration is incomplete, or of a kind that is not read.
    """
    if not isinstance(found, dict):
        return None
    kind = found.get("class_name")
    try:
        if kind == "PinholeCameraTrajectory":
            cameras = [_of_open3d(str(n), one) for n, one in enumerate(found["parameters"])]
            return {"cameras": cameras}
        if kind == "PinholeCameraParameters":
            return {"cameras": [_of_open3d("0", found)]}
        if "CalibrationInformation" in found:
            cameras = found["CalibrationInformation"]["Cameras"]
            return {"unit": "m", "cameras": [_of_kinect(cameras, size_of_images())]}
        if {"ppx", "ppy"} <= found.keys():
            return {"unit": "m", "cameras": [_of_realsense(found)]}
    except KeyError as error:
        raise ValueError(f"{error.args[0]}: is missing in this calibration") from error
    except (TypeError, AttributeError, IndexError) as error:
        raise ValueError(f"is a calibration of another form: {error}") from error
    return None


def _of_open3d(name: str, told: dict[str, Any]) -> dict[str, Any]:
    intrinsic = told["intrinsic"]
    matrix = np.array(intrinsic["intrinsic_matrix"], np.float64).reshape(3, 3).T
    to_camera = np.array(told["extrinsic"], np.float64).reshape(4, 4).T
    return {
        "name": name,
        "camera_to_world": np.linalg.inv(to_camera).round(15).tolist(),
        "intrinsics": matrix.tolist(),
        "depth_scale": None,
        "width": intrinsic["width"],
        "height": intrinsic["height"],
    }


def _of_kinect(cameras: list[Any], size: tuple[int, int] | None) -> dict[str, Any]:
    camera = {"name": "depth", "camera_to_world": np.eye(4).tolist()}
    if size is None:  # without images, only the position counts
        return camera
    depth = [one for one in cameras if one["Location"] == "CALIBRATION_CameraLocationD0"]
    if not depth:
        raise ValueError("CalibrationInformation: holds no depth camera")
    if size not in _KINECT_MODES:
        modes = ", ".join(f"{width} x {height}" for width, height in _KINECT_MODES)
        raise ValueError(
            f"the images have {size[0]} x {size[1]} pixels, but those of the depth camera of an "
            f"Azure Kinect have {modes}; for others, such as those transformed to the colour "
            "camera, write a cameras.json"
        )
    model = depth[0]["Intrinsics"]["ModelType"]
    if model != "CALIBRATION_LensDistortionModelBrownConrady":
        raise ValueError(f"ModelType: {model!r:.60} is not read")
    cx, cy, fx, fy, k1, k2, k3, k4, k5, k6, _, _, p2, p1 = depth[0]["Intrinsics"]["ModelParameters"]
    side, column, row = _KINECT_MODES[size]
    radius = depth[0]["MetricRadius"]
    return camera | {
        "fx": fx * side,
        "fy": fy * side,
        "cx": cx * side - column - 0.5,
        "cy": cy * side - row - 0.5,
        "depth_scale": 0.001,
        "width": size[0],
        "height": size[1],
        "distortion": [k1, k2, p1, p2, k3, k4, k5, k6],
        "distortion_radius": radius if radius > 1e-4 else _KINECT_RADIUS,
    }


def _of_realsense(told: dict[str, Any]) -> dict[str, Any]:
    model = told.get("model", told.get("distortion_model", ""))
    name = "".join(letter for letter in str(model).lower() if letter.isalnum())
    distortion = {"distortion": told["coeffs"]} if any(told.get("coeffs", ())) else {}
    if distortion and name not in _BROWN_CONRADY:
        raise ValueError(f"model: {model!r:.60} is not read, only 'brown_conrady'")
    return {
        "name": "depth",
        "camera_to_world": np.eye(4).tolist(),
        "fx": told["fx"],
        "fy": told["fy"],
        "cx": told["ppx"],
        "cy": told["ppy"],
        "depth_scale": told.get("depth_scale"),
        "width": told["width"],
        "height": told["height"],
        **distortion,
    }
