"""The file of the cameras, and the distortions of their lenses, by OpenCV as it describes them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import LONGER
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from scan_files import a_rig, saved

from dynmesh._errors import DynmeshError
from dynmesh.scans import DepthScan, Rig, ScanCamera, open_scans, read_cameras, write_cameras

LENS = [-0.28, 0.09, 0.002, -0.001, 0.01]

RATIONAL = [0.55, -0.02, -7e-5, 2e-5, -0.003, 0.89, 0.09, -0.014]


INTRINSICS = {"fx": 100.0, "fy": 95.0, "cx": 62.0, "cy": 45.5, "width": 120, "height": 90}


def a_camera() -> dict[str, Any]:
    """A camera as its file describes it, without a distortion."""
    fx, fy, cx, cy, width, height = INTRINSICS.values()
    return {
        "name": "a",
        "camera_to_world": np.eye(4).tolist(),
        "intrinsics": [[fx, 0, cx], [0, fy, cy], [0, 0, 1]],
        "depth_scale": 1e-3,
        "width": int(width),
        "height": int(height),
    }


def through_lens(x: Any, y: Any, k: list[float]) -> tuple[Any, Any]:
    """Where a direction appears, by the formulas in the documentation of OpenCV."""
    k1, k2, p1, p2, k3, k4, k5, k6 = [*k, 0, 0, 0, 0][:8]
    r2 = x**2 + y**2
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    return (
        x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2),
        y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y,
    )


def tilted(told: dict[str, float], k: list[float], slope: tuple[float, float]) -> bytes:
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
    rig = tmp_path / "cameras.json"
    (tmp_path / "0.png").write_bytes(tilted(INTRINSICS, k, slope))
    camera = a_camera()
    rig.write_text(json.dumps({"cameras": [camera]}))
    assert deviation(tmp_path, slope)[1] > 0.6
    rig.write_text(json.dumps({"cameras": [camera | {"distortion": k}]}))
    bias, spread, share = deviation(tmp_path, slope)
    assert bias < 0.1
    assert spread < 0.4  # of nearest pixels: 0.29
    assert share > 0.6
    write_cameras(rig, read_cameras(rig))
    assert deviation(tmp_path, slope) == (bias, spread, share)


@pytest.mark.parametrize("unit", [None, 1.0, 0.01, 0.001, 0.0254])
def test_cameras_come_back(tmp_path: Path, unit: float | None) -> None:
    rig = a_rig(3, unit=unit)
    bare = ScanCamera("bare", rig.cameras[0].camera_to_world)
    write_cameras(tmp_path / "c.json", Rig((*rig.cameras, bare), unit))
    found = read_cameras(tmp_path / "c.json")
    assert found.metres_per_unit == unit
    for ours, theirs in zip((*rig.cameras, bare), found.cameras, strict=True):
        assert (ours.name, ours.depth_scale, ours.size) == (
            theirs.name, theirs.depth_scale, theirs.size
        )  # fmt: skip
        np.testing.assert_array_equal(ours.camera_to_world, theirs.camera_to_world)
        if ours.intrinsics is not None:
            np.testing.assert_array_equal(ours.intrinsics, np.asarray(theirs.intrinsics))


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                ["unit", "cameras", "name", "camera_to_world", "intrinsics", "depth_scale", "x"]
            ),
            inner,
            max_size=5,
        )
    ),
    max_leaves=12,
)


@given(JSON)
@settings(max_examples=60 * LONGER)
def test_any_json_is_refused_as_cameras(
    tmp_path_factory: pytest.TempPathFactory, found: Any
) -> None:
    file = tmp_path_factory.getbasetemp() / "cameras.json"
    file.write_text(json.dumps(found))
    with pytest.raises(DynmeshError, match=r"cameras\.json: "):
        read_cameras(file)


@given(st.data())
@settings(max_examples=100 * LONGER)
def test_a_changed_field_of_a_camera_is_refused_or_kept(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    file = tmp_path_factory.getbasetemp() / "changed.json"
    write_cameras(file, a_rig(1))
    told = json.loads(file.read_text())
    camera = told["cameras"][0]
    name = data.draw(st.sampled_from(sorted(camera)))
    value = data.draw(JSON)
    camera[name] = value
    file.write_text(json.dumps(told))
    try:
        (read,) = read_cameras(file).cameras
    except DynmeshError as error:
        found = str(error)
    else:
        kept = {"name": read.name, "depth_scale": read.depth_scale}
        kept |= dict(zip(("width", "height"), read.size or (), strict=False))
        assert kept[name] == value
        return
    assert f"camera 0: {name}: " in found
