"""Distortions of lenses, also those of calibrations that devices write, are undone."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scan_files import a_rig, saved

from dynmesh._errors import DynmeshError
from dynmesh.files.scans import DepthScan, open_scans, read_cameras, write_cameras

LENS = [-0.28, 0.09, 0.002, -0.001, 0.01]

RATIONAL = [0.55, -0.02, -7e-5, 2e-5, -0.003, 0.89, 0.09, -0.014]


def through_lens(x: Any, y: Any, k: list[float]) -> tuple[Any, Any]:
    """Where a direction appears, by the formulas in the documentation of OpenCV."""
    k1, k2, p1, p2, k3, k4, k5, k6 = [*k, 0, 0, 0, 0][:8]
    r2 = x**2 + y**2
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    return (
        x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2),
        y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y,
    )


def tilted(told: dict[str, Any], k: list[float], slope: tuple[float, float]) -> bytes:
    """An image of a plane, whose depth in counts is linear in the undistorted direction."""
    v, u = np.mgrid[: told["height"], : told["width"]].astype(float)
    seen = (u - told["cx"]) / told["fx"], (v - told["cy"]) / told["fy"]
    x, y = seen
    for _ in range(80):
        at = through_lens(x, y, k)
        x, y = x + 0.5 * (seen[0] - at[0]), y + 0.5 * (seen[1] - at[1])
    counts = 20000 + 8000 * (slope[0] * x + slope[1] * y)
    return saved(Image.fromarray(np.rint(counts).astype(np.uint16)))


def deviation(scans: Path, slope: tuple[float, float]) -> tuple[float, float, float]:
    """The bias and spread of the cloud from that plane, in pixels, and its part of the image."""
    (scan,) = open_scans(scans)
    assert isinstance(scan, DepthScan)
    x, y, z = scan.cloud.T
    expected = 20 + 8 * (slope[0] * x + slope[1] * y) / z
    pixels = (z - expected) / 8 * scan.intrinsics[0][1, 1]
    return abs(float(pixels.mean())), float(pixels.std()), len(z) / scan.depth[0].size


@pytest.mark.parametrize("slope", [(1.0, 0.0), (0.0, 1.0)])
@pytest.mark.parametrize("k", [LENS, RATIONAL, [0.2, 0.05, 0.01, 0.0]])
def test_a_distortion_is_undone(tmp_path: Path, k: list[float], slope: tuple[float, float]) -> None:
    told = {"fx": 100.0, "fy": 95.0, "cx": 62.0, "cy": 45.5, "width": 120, "height": 90}
    camera = told | {"name": "a", "camera_to_world": np.eye(4).tolist(), "depth_scale": 1e-3}
    rig = tmp_path / "cameras.json"
    (tmp_path / "0_a.png").write_bytes(tilted(told, k, slope))
    rig.write_text(json.dumps({"cameras": [camera]}))
    assert deviation(tmp_path, slope)[1] > 0.6
    rig.write_text(json.dumps({"cameras": [camera | {"distortion": k}]}))
    bias, spread, share = deviation(tmp_path, slope)
    assert bias < 0.1
    assert spread < 0.4  # of nearest pixels: 0.29
    assert share > 0.6
    write_cameras(rig, read_cameras(rig))
    assert deviation(tmp_path, slope) == (bias, spread, share)


def test_the_margins_of_a_distorted_image_are_kept(tmp_path: Path) -> None:
    told = {"fx": 100.0, "fy": 95.0, "cx": 62.0, "cy": 45.5, "width": 120, "height": 90}
    camera = {"name": "a", "camera_to_world": np.eye(4).tolist(), "depth_scale": 1e-3}
    cameras = {"cameras": [camera | told | {"distortion": LENS}]}
    (tmp_path / "cameras.json").write_text(json.dumps(cameras))
    (tmp_path / "0.png").write_bytes(tilted(told, LENS, (0.0, 0.0)))
    (scan,) = open_scans(tmp_path)
    assert isinstance(scan, DepthScan)
    x, y, z = scan.cloud.T
    u, v = through_lens(x / z, y / z, LENS)
    assert np.ptp(u) * told["fx"] == pytest.approx(told["width"] - 1, abs=1.5)
    assert np.ptp(v) * told["fy"] == pytest.approx(told["height"] - 1, abs=1.5)


@pytest.mark.parametrize("k", [[0, 0, 0, 3.0], [0, 0, 0, 0, 0, 40.0, 0, 0]])
def test_a_distortion_that_folds_over_is_refused(tmp_path: Path, k: list[float]) -> None:
    write_cameras(tmp_path / "c.json", a_rig(2))
    told = json.loads((tmp_path / "c.json").read_text())
    told["cameras"][1]["distortion"] = k
    (tmp_path / "c.json").write_text(json.dumps(told))
    with pytest.raises(DynmeshError, match="camera 1: distortion: that of camera 'c1': folds"):
        read_cameras(tmp_path / "c.json")


KINECT = [0.513, 0.517, 0.4928, 0.4929, 0.548, -0.021, -0.00265, 0.8897, 0.0861, -0.0139, 0, 0]

KINECT += [-7.2e-3, 2.06e-3]


def kinect(told: dict[str, Any]) -> dict[str, Any]:
    """As in the recordings of an Azure Kinect."""
    camera = {
        "Intrinsics": {
            "ModelParameterCount": 14,
            "ModelParameters": KINECT,
            "ModelType": "CALIBRATION_LensDistortionModelBrownConrady",
        },
        "Location": "CALIBRATION_CameraLocationD0",
        "MetricRadius": 1.74,
        "Rt": {"Rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "Translation": [0, 0, 0]},
        "SensorHeight": 1024,
        "SensorWidth": 1024,
    }
    # The narrow field of view, every second pixel in both directions.
    told["fx"], told["fy"] = 512 * KINECT[2], 512 * KINECT[3]
    told["cx"], told["cy"] = 512 * KINECT[0] - 96 - 0.5, 512 * KINECT[1] - 90 - 0.5
    told["width"], told["height"] = 320, 288
    return {"CalibrationInformation": {"Cameras": [camera], "InertialSensors": []}}


def realsense(told: dict[str, Any]) -> dict[str, Any]:
    """With the names of librealsense."""
    names = {"cx": "ppx", "cy": "ppy"}
    own = {names.get(name, name): value for name, value in told.items()}
    model = {"model": "distortion.brown_conrady", "coeffs": LENS, "depth_scale": 0.001}
    return own | model | {"serial": "1"}


@pytest.mark.parametrize("slope", [(1.0, 0.0), (0.0, 1.0)])
@pytest.mark.parametrize(
    ("written", "k"),
    [(kinect, [*KINECT[4:6], KINECT[13], KINECT[12], *KINECT[6:10]]), (realsense, LENS)],
)
def test_calibrations_of_devices_are_read(
    tmp_path: Path, written: Any, k: list[float], slope: tuple[float, float]
) -> None:
    told = {"fx": 100.0, "fy": 95.0, "cx": 62.0, "cy": 45.5, "width": 120, "height": 90}
    (tmp_path / "cameras.json").write_text(json.dumps(written(told)))
    (tmp_path / "0.png").write_bytes(tilted(told, k, slope))
    bias, spread, share = deviation(tmp_path, slope)
    assert bias < 0.1
    assert spread < 0.4
    assert share > 0.6
    assert open_scans(tmp_path).metres_per_unit == 1


def test_other_models_of_realsense_are_refused(tmp_path: Path) -> None:
    told = {"fx": 100.0, "fy": 95.0, "cx": 62.0, "cy": 45.5, "width": 120, "height": 90}
    model = {"model": "distortion.inverse_brown_conrady"}
    (tmp_path / "c.json").write_text(json.dumps(realsense(told) | model))
    with pytest.raises(DynmeshError, match="inverse_brown_conrady"):
        read_cameras(tmp_path / "c.json")
