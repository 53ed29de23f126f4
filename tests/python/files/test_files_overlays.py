"""What is written into or over a USD stage agrees with it, and formats keep texture coordinates."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from commands import dynmesh_command as run
from layers import PLACES, REST, layer, mesh, textured
from plain_files import corners_in_obj
from stages import BODY, FLAG, HAT, RATE, TIMES, frames_of, production, stage_of, values_of

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
        partial: Any = dynmesh.read(scene, prim=HAT)
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
    again: Any = dynmesh.read(tmp_path / "over.usda", prim=mesh)
    np.testing.assert_array_equal(again.vertices, expected)
    assert again.known is None


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
    for name, alone in ((BODY, "body.usda"), (HAT, "hat.usda")):
        found, expected = (points_of(tmp_path / file, name) for file in ("both.usda", alone))
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


alembic = pytest.importorskip("alembic3d")
Abc, Geometry = alembic.Abc, alembic.AbcGeom


def texture_in(path: Path) -> Any:
    with dynmesh.open(path) as reader:
        return reader.texture


@pytest.mark.parametrize("of_vertices", [False, True])
def test_texture_coordinates_go_from_format_to_format(tmp_path: Path, of_vertices: bool) -> None:
    texture = PLACES[:5] if of_vertices else PLACES
    corners = [0, 1, 2, 3, 0, 3, 4]
    expected = texture[corners] if of_vertices else texture
    path = textured(tmp_path / "a.usda", name="UVMap", texture=texture)
    for name in ("b.abc", "c.usdc", "d.abc", "e.abc"):
        assert to_file.convert(path, tmp_path / name).remarks == ()
        path = tmp_path / name
        np.testing.assert_array_equal(texture_in(path), expected)
    for name, made in (("f_%d.obj", "f_2.obj"), ("g.pc2", "g.obj")):
        assert "texture" not in " ".join(to_file.convert(path, tmp_path / name).remarks)
        found = corners_in_obj(tmp_path / made)
        assert [vertex for face in found for _, vertex in face] == corners
        assert list(map(len, found)) == [4, 3]
        np.testing.assert_array_equal([place for face in found for place, _ in face], expected)
    archive = Abc.IArchive(str(tmp_path / "e.abc"))
    schema = Geometry.IPolyMesh(archive.getTop(), "Body").getSchema()
    order = [3, 2, 1, 0, 6, 5, 4]
    assert list(schema.getFaceIndicesProperty().getValue(0)) == [corners[i] for i in order]
    values = np.array(schema.getUVsParam().getExpandedValue(1).getVals())
    np.testing.assert_array_equal(values, expected[order])


def test_faces_of_left_handed_meshes_are_turned_with_their_texture(tmp_path: Path) -> None:
    told = 'uniform token orientation = "leftHanded"'
    path = textured(tmp_path / "a.usda", told)
    faces: Any = dynmesh.read(path).polygons
    assert faces.corners.tolist() == [3, 2, 1, 0, 4, 3, 0]
    np.testing.assert_array_equal(texture_in(path), PLACES[[3, 2, 1, 0, 6, 5, 4]])
    by_vertex = textured(tmp_path / "b.usda", told, texture=PLACES[:5])
    np.testing.assert_array_equal(texture_in(by_vertex), PLACES[faces.corners])
    to_file.convert(path, tmp_path / "c.usda")
    again: Any = dynmesh.read(tmp_path / "c.usda").polygons
    np.testing.assert_array_equal(again.corners, faces.corners)
    to_file.complete(path, tmp_path / "over.usda")  # a layer, which leaves the faces alone
    stage = stage_of(tmp_path / "over.usda")
    left = stage.GetPrimAtPath("/Body")
    assert left.GetAttribute("orientation").Get() == "leftHanded"
    assert list(left.GetAttribute("faceVertexIndices").Get()) == [0, 1, 2, 3, 0, 3, 4]


POSED = f"point3f[] points = {REST}"
MOVERS: dict[str, tuple[str, str]] = {
    "a skeleton": ("", "rel skel:skeleton = </Rig>"),
    "blend shapes": ("", 'uniform token[] skel:blendShapes = ["smile"]'),
    "transforms": (
        "double3 xformOp:translate.timeSamples = {1: (0, 0, 0), 2: (1, 0, 0)}\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]', ""
    ),
    "": (
        "double3 xformOp:translate = (1, 0, 0)\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]', ""
    ),
}  # fmt: skip


@pytest.mark.parametrize("mover", MOVERS)
def test_what_moves_a_mesh_and_is_not_read_is_said(tmp_path: Path, mover: str) -> None:
    above, of_mesh = MOVERS[mover]
    world = f'def Xform "World" {{\n{above}\n{mesh(POSED, of_mesh)}}}'
    path = layer(tmp_path / "a.usda", world)
    for words in (("info", path), ("view", path, "-o", tmp_path / "b.html")):
        done = run(*words)
        told = done.stdout + done.stderr
        assert ("moved by" in told) == (f"the mesh is moved by {mover}," in told) == bool(mover)


def test_what_a_conversion_leaves_out_is_said_in_one_sentence(tmp_path: Path) -> None:
    path = textured(
        tmp_path / "a.usda",
        'texCoord2f[] primvars:lightmap = [(0, 0)] (interpolation = "vertex")',
        "color3f[] primvars:displayColor = [(1, 0, 0)]",
        "rel material:binding = </Body/skin>",
        'def Material "skin" {}',
        'def GeomSubset "face" { uniform token elementType = "face"\nint[] indices = [0]\n}',
    )
    left = "colours, lightmap, materials and subsets of a.usda are not written"
    more = "colours, lightmap, materials, subsets and texture coordinates of a.usda are not written"
    for name, told in (("b.abc", left), ("c_%d.obj", left), ("d.npz", more)):
        remarks = to_file.convert(path, tmp_path / name).remarks
        assert [one for one in remarks if "of a.usda" in one] == [told]
    layered = to_file.complete(path, tmp_path / "over.usda").remarks
    assert not [one for one in layered if "written" in one]


def test_a_template_provides_the_texture_coordinates(tmp_path: Path) -> None:
    path = textured(tmp_path / "a.usda")
    partial = dynmesh.read(path)
    dynmesh.write(tmp_path / "partial.npz", partial)
    to_file.complete(tmp_path / "partial.npz", tmp_path / "b.abc", template=path)
    np.testing.assert_array_equal(texture_in(tmp_path / "b.abc"), PLACES)
    remarks = to_file.complete(tmp_path / "partial.npz", tmp_path / "c.usda", template=path).remarks
    assert not any("alone" in remark for remark in remarks)  # it does not lie over the template


TRUTH, _ = frames_of(0)
KINDS = ("completed", "masked", "degraded", "opened in part")
OPTIONS = {"to_unit": "inch", "to_up": "y", "fps": 30.0, "frames": slice(501.5, 504.5), "scale": 3}
CHANGES: list[dict[str, Any]] = [{}, OPTIONS, *({name: OPTIONS[name]} for name in OPTIONS)]


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
