"""What is written into or over a stage agrees: points, unit, up axis, rate, range and extents."""

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stages import BODY, RATE, TIMES, frames_of, production, stage_of

import dynmesh

Sdf: Any = pytest.importorskip("pxr.Sdf")
UsdGeom: Any = pytest.importorskip("pxr.UsdGeom")

TRUTH, _ = frames_of(0)
KINDS = ("completed", "masked", "degraded", "opened in part")
OPTIONS = {"to_unit": "inch", "to_up": "y", "fps": 30.0, "frames": slice(501.5, 504.5), "scale": 3}
CHANGES: list[dict[str, Any]] = [
    {name: OPTIONS[name] for name in OPTIONS if name in names}
    for names in product(*((name, "") for name in OPTIONS))
]


def completed(kind: str, path: Path) -> Any:
    """Completed frames of the body of the production."""
    if kind == "masked":
        return dynmesh.complete(dynmesh.open(path, prim=BODY, missing="zero"))
    frames = dynmesh.open(path, prim=BODY)
    if kind == "degraded":
        return dynmesh.complete(dynmesh.degrade(frames, known=0.9))
    return dynmesh.complete(frames[1:4] if kind == "opened in part" else frames, start="best")


def check(path: Path, numbers: range, changes: dict[str, Any]) -> None:
    """Compares observed points of a stage, as USD reads it, with the truth in metres and z up."""
    stage = stage_of(path)
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(BODY))
    points, extent = mesh.GetPointsAttr(), mesh.GetExtentAttr()
    generation = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("generation")
    times = points.GetTimeSamples()
    assert times == extent.GetTimeSamples() == generation.GetTimeSamples()
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (times[0], times[-1])
    seconds = np.array(TIMES)[numbers] / RATE * (RATE / 2 / changes.get("fps", RATE / 2))
    np.testing.assert_allclose(np.array(times) / stage.GetTimeCodesPerSecond(), seconds)
    for number, time in zip(numbers, times, strict=True):
        found = np.array(points.Get(time))
        np.testing.assert_array_equal(extent.Get(time), [found.min(axis=0), found.max(axis=0)])
        if UsdGeom.GetStageUpAxis(stage) == "Y":
            found = found[:, [0, 2, 1]] * [1, -1, 1]
        found = found * UsdGeom.GetStageMetersPerUnit(stage) / changes.get("scale", 1)
        observed = np.array(generation.Get(time)) == 0
        assert observed.any()
        expected = 0.01 * TRUTH[number][observed]
        np.testing.assert_allclose(found[observed], expected, rtol=1e-5, atol=1e-6)
    velocities = mesh.GetVelocitiesAttr()
    if velocities.HasAuthoredValue():
        step = (times[1] - times[0]) / stage.GetTimeCodesPerSecond()
        expected = np.gradient(np.array([points.Get(time) for time in times], float), step, axis=0)
        found = np.array([velocities.Get(time) for time in velocities.GetTimeSamples()])
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5)
    for name in ("normals", "accelerations"):
        assert not mesh.GetPrim().GetAttribute(name).HasAuthoredValue()


@pytest.mark.filterwarnings("ignore::dynmesh.DoubtfulWarning")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("changes", CHANGES, ids=lambda one: "-".join(one) or "unchanged")
def test_what_is_converted_agrees_with_its_stage(
    tmp_path: Path, kind: str, changes: dict[str, Any]
) -> None:
    """Also if it is completed again. It lies over the scene if that is of the same frames."""
    scene = production(tmp_path / "scene.usda")
    is_part = kind == "opened in part"
    if is_part:
        changes = {name: value for name, value in changes.items() if name != "frames"}
    numbers = range(1, 4) if is_part or "frames" in changes else range(6)
    for name in ("once.usda", "twice.usdc"):
        frames: Any = dynmesh.convert(completed(kind, scene), **changes)
        frames = dynmesh.complete(frames, start="best") if name == "twice.usdc" else frames
        remarks = " ".join(dynmesh.write(tmp_path / name, frames).remarks)
        check(tmp_path / name, numbers, changes)
        stays = changes.keys() <= {"scale"} and not is_part
        layer = Sdf.Layer.FindOrOpen(str(tmp_path / name))
        assert list(layer.subLayerPaths) == (["./scene.usda"] if stays else [])
        assert ("materials" in remarks) == (not stays)
