"""Results that are laid over USD stages."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from stages import BODY, FLAG, HAT, TIMES, production, stage_of, values_of

import dynmesh

Sdf, Usd, UsdGeom, UsdUtils = (
    pytest.importorskip(f"pxr.{name}") for name in ("Sdf", "Usd", "UsdGeom", "UsdUtils")
)

MOVING = (BODY, HAT, FLAG, FLAG.replace("First", "Second"))
CHANGED = {"points", "extent", "normals", "velocities", "extentsHint"}
TRACES = {"primvars:generation", "primvars:age"}


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the production, and one in it with an overlay of the body, named `over`."""
    folder = tmp_path_factory.mktemp("shot")
    production(folder / "scene.usda")
    (folder / "done").mkdir()
    over(folder / "scene.usda", folder / "done" / "over.usda", provenance=True)
    return folder


def over(scene: Path, output: Path, mesh: str = BODY, **options: Any) -> Any:
    return to_file.complete(scene, output, source={"prim": mesh}, **options)


def points_of(path: Path, mesh: str) -> dict[float, Any]:
    """The points of a mesh, by the times of their samples."""
    stage = stage_of(path)
    points = UsdGeom.Mesh(stage.GetPrimAtPath(mesh)).GetPointsAttr()
    return {time: np.array(points.Get(time)) for time in points.GetTimeSamples()}


def test_nothing_changes_but_the_points_and_what_no_longer_fits_them(shot: Path) -> None:
    before, after = (values_of(stage_of(shot / name)) for name in ("scene.usda", "done/over.usda"))
    changed = {path for path in before | after if before.get(path) != after.get(path)}
    assert {path.partition(".")[2] for path in changed} == CHANGED | TRACES
    assert {path.partition(".")[0] for path in changed} == {BODY, "/World"}
    assert {path for path in changed if path.startswith("/World.")} == {"/World.extentsHint"}
    layer = Sdf.Layer.FindOrOpen(str(shot / "done" / "over.usda"))
    specs: list[Any] = []
    layer.Traverse("/", lambda path: specs.append(layer.GetObjectAtPath(path)))
    prims = [spec for spec in specs if isinstance(spec, Sdf.PrimSpec)]
    assert {spec.specifier for spec in prims if spec.name} == {Sdf.SpecifierOver}
    attributes = {spec.name for spec in specs if isinstance(spec, Sdf.AttributeSpec)}
    assert attributes == CHANGED | TRACES
    assert list(layer.subLayerPaths) == ["./../scene.usda"]
    stage = stage_of(shot / "done" / "over.usda")
    assert not stage.GetAttributeAtPath(f"{BODY}.normals").HasAuthoredValue()


@pytest.mark.parametrize("is_overlay", [False, True])
def test_extents_are_those_of_the_points_in_each_frame(tmp_path: Path, is_overlay: bool) -> None:
    """Of known ones alone; a frame without any is empty."""
    scene = production(tmp_path / "scene.usda")
    if is_overlay:
        over(scene, tmp_path / "a.usda", HAT)
    else:
        partial = dynmesh.read(scene, prim=HAT)
        assert partial.known is not None
        partial.known[2] = False
        dynmesh.write(tmp_path / "a.usda", partial)
    made, stage = dynmesh.read(tmp_path / "a.usda", prim=HAT), stage_of(tmp_path / "a.usda")
    extent = UsdGeom.Mesh(stage.GetPrimAtPath(HAT)).GetExtentAttr()
    times = UsdGeom.Mesh(stage.GetPrimAtPath(HAT)).GetPointsAttr().GetTimeSamples()
    assert extent.GetTimeSamples() == times
    for number, time in enumerate(times):
        found, known = np.array(extent.Get(time)), made.known
        points = made.vertices[number][... if known is None else known[number]]
        assert (found[0] > found[1]).all() == (len(points) == 0)
        if len(points):
            np.testing.assert_array_equal(found, [points.min(axis=0), points.max(axis=0)])


@pytest.mark.parametrize("mesh", MOVING)
def test_the_points_are_those_of_the_mesh_completed_alone(
    shot: Path, tmp_path: Path, mesh: str
) -> None:
    to_file.complete(shot / "scene.usda", tmp_path / "one.npz", source={"prim": mesh})
    expected = dynmesh.read(tmp_path / "one.npz").vertices
    report = over(shot / "scene.usda", tmp_path / "over.usda", mesh, provenance=True)
    said = any("normals of scene.usda are blocked" in told for told in report.remarks)
    assert said == (mesh == BODY)  # the others have no normals
    points = points_of(tmp_path / "over.usda", mesh)
    assert tuple(points) == TIMES
    np.testing.assert_array_equal(list(points.values()), expected)
    again = dynmesh.read(tmp_path / "over.usda", prim=mesh)
    np.testing.assert_array_equal(again.vertices, expected)
    assert again.known is None
    assert again.generation is not None


def test_instances_become_ordinary_prims_which_is_said_once(tmp_path: Path) -> None:
    """Also an instance in an instance, from another file."""
    production(tmp_path / "scene.usda")
    crowd = Usd.Stage.CreateNew(str(tmp_path / "crowd.usda"))
    one = crowd.DefinePrim("/crowd/one")
    one.GetReferences().AddReference("./scene.usda")
    one.SetInstanceable(True)
    crowd.GetRootLayer().Save()
    mesh = FLAG.replace("/World", "/crowd/one")
    report = over(tmp_path / "crowd.usda", tmp_path / "over.usda", mesh)
    assert np.isfinite(list(points_of(tmp_path / "over.usda", mesh).values())).all()
    (remark,) = (remark for remark in report.remarks if "instance" in remark)
    assert remark.partition(": ")[2] == "/crowd/one, /crowd/one/Flags/First"


def test_several_meshes_are_completed_in_layers_over_each_other(tmp_path: Path) -> None:
    """The points of both are stated by the stage itself."""
    scene = production(tmp_path / "scene.usda")
    over(scene, tmp_path / "body.usda")
    over(scene, tmp_path / "hat.usda", HAT)
    over(tmp_path / "body.usda", tmp_path / "both.usda", HAT)
    for mesh, alone in ((BODY, "body.usda"), (HAT, "hat.usda")):
        found, expected = (points_of(tmp_path / file, mesh) for file in ("both.usda", alone))
        assert tuple(found) == TIMES
        np.testing.assert_array_equal(list(found.values()), list(expected.values()))
    assert values_of(stage_of(tmp_path / "both.usda"))["/World/Rig/Hat.primvars:st"]


def test_samples_have_the_times_of_the_scene_to_the_last_bit(tmp_path: Path) -> None:
    """A sublayer with another rate has its samples at times that have many digits."""
    production(tmp_path / "fast.usda")
    layer = Sdf.Layer.FindOrOpen(str(tmp_path / "fast.usda"))
    layer.timeCodesPerSecond = 30000 / 1001
    layer.Save()
    scene = Sdf.Layer.CreateNew(str(tmp_path / "scene.usda"))
    scene.subLayerPaths.append("./fast.usda")
    scene.timeCodesPerSecond = 25
    scene.Save()
    over(tmp_path / "scene.usda", tmp_path / "over.usda")
    before, after = (points_of(tmp_path / name, BODY) for name in ("scene.usda", "over.usda"))
    assert list(before) == list(after)
    assert any(time % 1 for time in before)
    assert np.isfinite(list(after.values())).all()
