"""USD stages and Alembic archives of other programs, and results that are laid over them."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from commands import dynmesh_command as run
from sequences import assert_refused
from stages import BODY, FLAG, HAT, TIMES, production

import dynmesh

Sdf, Usd, UsdGeom, UsdUtils = (
    pytest.importorskip(f"pxr.{name}") for name in ("Sdf", "Usd", "UsdGeom", "UsdUtils")
)

FACES = "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]"
REST = "[(0, 0, 0), (1, 0, 0), (0, 1, 0)]"


def points_at(**samples: float) -> str:
    """Formats samples of three points, `t1_5=2` for height 2 at time 1.5."""
    lines = [
        f"{name[1:].replace('_', '.')}: [(0, 0, {z}), (1, 0, {z}), (0, 1, {z})]"
        for name, z in samples.items()
    ]
    return f"point3f[] points.timeSamples = {{ {', '.join(lines)} }}"


def mesh(*lines: str, name: str = "Body", faces: str = FACES) -> str:
    return f'def Mesh "{name}" {{\n' + "\n".join([faces, *lines]) + "\n}\n"


def layer(path: Path, *prims: str, about: str = "") -> Path:
    path.write_text(f"#usda 1.0\n({about})\n" + "\n".join(prims))
    return path


@pytest.mark.parametrize(
    ("about", "samples", "fps", "start", "times"),
    [
        ("timeCodesPerSecond = 25", "t1 t2 t3", 25, 1, None),
        ("framesPerSecond = 30", "t1_25 t2_25", 30, 1.25, None),
        ("", "t1 t2", None, 1, None),
        ("timeCodesPerSecond = 24", "t6 t8 t10", 12, 3, None),
        ("timeCodesPerSecond = 24", "t1 t1_5 t2", 48, 2, None),
        ("timeCodesPerSecond = 24", "t7", 24, 7, None),
        # time codes, where the times do not follow from a rate
        ("timeCodesPerSecond = 25", "t1 t2 t4", 25, 1, [1, 2, 4]),
        ("framesPerSecond = 30", "t1 t2 t3_3", 30, 1, [1, 2, 3.3]),
        ("", "t1 t2 t4", None, 1, [1, 2, 4]),
        ("", "t2 t4 t6", None, 2, [2, 4, 6]),
        ("", "t0 t0_5 t1", None, 0, [0, 0.5, 1]),
    ],
)
def test_samples_are_frames(
    tmp_path: Path,
    about: str,
    samples: str,
    fps: float | None,
    start: float,
    times: list[float] | None,
) -> None:
    heights = {time: float(height) for height, time in enumerate(samples.split())}
    path = layer(tmp_path / "a.usda", mesh(points_at(**heights)), about=about)
    sequence = dynmesh.read(path)
    np.testing.assert_array_equal(sequence.vertices[:, 0, 2], range(len(heights)))
    assert sequence.fps == (None if fps is None else pytest.approx(fps))
    assert sequence.start == start
    assert (None if sequence.times is None else sequence.times.tolist()) == times


def test_samples_that_are_omitted_since_nothing_moved_are_frames(tmp_path: Path) -> None:
    body = mesh(points_at(t1=1, t2=2, t5=2, t6=3))
    sequence = dynmesh.read(layer(tmp_path / "a.usda", body, about="timeCodesPerSecond = 24"))
    np.testing.assert_array_equal(sequence.vertices[:, 0, 2], [1, 2, 2, 2, 2, 3])
    assert (sequence.fps, sequence.start, sequence.times) == (24, 1, None)


def test_points_without_samples_are_one_frame(tmp_path: Path) -> None:
    path = layer(tmp_path / "a.usda", mesh(f"point3f[] points = {REST}"), about='upAxis = "Z"')
    sequence = dynmesh.read(path)
    np.testing.assert_array_equal(sequence.vertices, [[(0, 0, 0), (1, 0, 0), (0, 1, 0)]])
    np.testing.assert_array_equal(sequence.faces, [[0, 1, 2]])
    # Although USD has a default of the unit.
    assert (sequence.up_axis, sequence.metres_per_unit) == ("z", None)


def test_a_mesh_is_chosen_and_info_lists_them(tmp_path: Path) -> None:
    still = mesh(f"point3f[] points = {REST}", name="Still")
    moving = mesh(points_at(t0=1, t1=2), name="Moving")
    other = mesh(points_at(t0=3, t1=4), name="Other")
    path = layer(tmp_path / "a.usda", still, moving)
    assert dynmesh.read(path).name == "/Moving"
    assert dynmesh.read(path, prim="/Still").name == "/Still"
    told = json.loads(run("info", path, "--json").stdout)
    assert told["meshes"] == {"/Still": False, "/Moving": True}
    assert told["sequence"]["name"] == "/Moving"
    assert "meshes" not in json.loads(run("info", path, "--json", "--prim", "/Still").stdout)
    layer(path, still, moving, other)
    assert_refused(path, ": /Moving, /Other")
    assert dynmesh.read(path, prim="/Other").vertices[0, 0, 2] == 3
    for prim in ("/Nobody", "Moving", "not a path"):
        assert_refused(path, f"'{prim}'.* /Still, /Moving, /Other", prim=prim)
    shown = [line.split() for line in run("info", path).stdout.splitlines()]
    assert ["/Still", "does", "not", "move"] in shown
    assert ["/Other", "moves"] in shown
    assert "--prim" in run("info", path, "--strict", code=2).stderr
    assert_refused(layer(path, 'def Xform "Body" {}'))


def known(value: str, *, kind: str = "bool[]", interpolation: str = "vertex") -> str:
    return f'{kind} primvars:known = {value} (interpolation = "{interpolation}")'


def masked_at(samples: str) -> str:
    """Three frames, with masks at some of their times."""
    times = f"bool[] primvars:known.timeSamples = {{{samples}}}"
    return mesh(points_at(t1=1, t2=2, t3=3), known("[1, 1, 1]"), times)


TURNED = "int[] faceVertexIndices.timeSamples = {1: [0, 1, 2], 4: [2, 1, 0]}"
FEWER = f"point3f[] points.timeSamples = {{1: {REST}, 2: [(0, 0, 0)]}}"


@pytest.mark.parametrize(
    ("body", "told"),
    [
        (mesh(), "no points"),
        (mesh(points_at(t1=1), faces=""), "no faces"),
        (mesh(points_at(t1=1), faces=FACES.replace("0, ", "")), "3 corners, .* 2"),
        (mesh(FEWER), "time 2: points .*1 .*3"),
        (mesh(points_at(t1=1), TURNED), "time 4: .*faces"),
        (mesh(points_at(t1=1), known("[1, 1]")), "time 1: primvars:known .*2 .*3"),
        (mesh(points_at(t1=1), known("[1]", interpolation="constant")), r"primvars:known: .*const"),
        (mesh(points_at(t1=1), known("[1, 1, 0]", kind="float[]")), r"primvars:known: .*float\[\]"),
        (
            mesh(points_at(t1=1), known("[1, 0]"), "int[] primvars:known:indices = [0, 1, 0]"),
            "primvars:known: .*indices",
        ),
        # masks lack a sample for a frame
        (masked_at("1: [1, 1, 1], 3: [1, 0, 1]"), "time 2: primvars:known"),
        (masked_at("1: [1, 1, 1], 2: [1, 0, 1]"), "time 3: primvars:known"),
        (masked_at("2: [1, 0, 1]"), "time 1: primvars:known"),
    ],
)
def test_unsuitable_meshes_are_refused(
    tmp_path: Path, body: str, told: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert_refused(layer(tmp_path / "a.usda", body), told)
    assert capfd.readouterr() == ("", "")


def test_masks_that_are_omitted_since_nothing_changes_are_those_before(tmp_path: Path) -> None:
    path = layer(tmp_path / "a.usda", masked_at("1: [1, 0, 1], 3: [1, 0, 1]"))
    np.testing.assert_array_equal(dynmesh.read(path).known, [[True, False, True]] * 3)


def test_stages_are_composed(tmp_path: Path) -> None:
    layer(tmp_path / "body.usda", mesh(points_at(t1=1, t2=2)), about='defaultPrim = "Body"')
    offset = "offset = 10; scale = 2"
    for arc in ("references", "payload"):
        path = layer(
            tmp_path / "a.usda",
            f'def Xform "World" {{\ndef "Him" ({arc} = @body.usda@ ({offset})) {{}}\n}}',
            about="timeCodesPerSecond = 24",
        )
        sequence = dynmesh.read(path)
        assert (sequence.name, sequence.fps) == ("/World/Him", 12)
        np.testing.assert_array_equal(sequence.vertices[:, 0, 2], [1, 2])
    instance = 'def "{}" (instanceable = true\n references = @world.usda@</World>) {{}}'
    layer(tmp_path / "world.usda", path.read_text().partition(")\n")[2])
    layer(path, instance.format("One"), instance.format("Two"))
    assert dynmesh.read(path, prim="/Two/Him").vertices[1, 0, 2] == 2


def test_every_layer_of_a_stage_is_an_input_and_packed_ones_are_only_read(tmp_path: Path) -> None:
    body = layer(tmp_path / "body.usda", mesh(points_at(t1=1, t2=2)), about='defaultPrim = "Body"')
    under = layer(tmp_path / "under.usda")
    him = 'def "Him" (references = @body.usda@) {}'
    path = layer(tmp_path / "a.usda", him, about="subLayers = [@under.usda@]")
    packed = tmp_path / "b.usdz"
    assert UsdUtils.CreateNewUsdzPackage(str(path), str(packed))
    with dynmesh.open(path) as reader:
        assert set(reader.files) == {path, body, under}
    with dynmesh.open(packed) as reader:
        assert reader.files == [packed]
    np.testing.assert_array_equal(dynmesh.read(packed).vertices[:, 0, 2], [1, 2])
    with pytest.raises(ValueError, match=r"'\.usdz'; the suffixes are (?!.*\.(usdz|stl))"):
        dynmesh.write(tmp_path / "c.usdz", dynmesh.read(path))
    before = body.read_text()
    with pytest.raises(ValueError, match=r"body\.usda: is the input"):
        to_file.complete(path, body, overwrite=True)
    assert body.read_text() == before


def test_missing_parts_of_the_mesh_are_reported(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    elsewhere = 'def "Tree" (references = @tree.usd@) {}'
    path = layer(tmp_path / "a.usda", mesh(points_at(t1=1)), elsewhere)
    assert dynmesh.read(path).name == "/Body"
    for about, prims in (
        ("subLayers = [@points.usd@]", [mesh(points_at(t1=1))]),
        ("", ['def Mesh "Body" (references = @body.usd@) {}']),
        ("", ['def "Body" (references = @body.usd@) {}']),
    ):
        assert_refused(layer(path, *prims, about=about), r"@(points|body)\.usd@")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("name", "stated", "scheme"),
    [("/World/Body", None, None), (None, None, "none"), ("/Body", "none", "none"),
     ("/Body", "loop", "loop")],
)  # fmt: skip
def test_a_stated_subdivision_scheme_is_kept(
    tmp_path: Path, name: str | None, stated: str | None, scheme: str | None
) -> None:
    """A mesh that comes from a scene has none unless it is stated."""
    path = tmp_path / "a.usda"
    dynmesh.write(path, dynmesh.Sequence(np.zeros((1, 3, 3)), np.array([[0, 1, 2]]), name=name))
    if stated is not None:
        stage = Usd.Stage.Open(str(path))
        UsdGeom.Mesh(stage.GetPrimAtPath(name)).CreateSubdivisionSchemeAttr(stated)
        stage.GetRootLayer().Save()
        path = tmp_path / "b.usda"
        to_file.convert(tmp_path / "a.usda", path)
    stage = Usd.Stage.Open(str(path))
    attribute = stage.GetPrimAtPath(name or "/mesh").GetAttribute("subdivisionScheme")
    assert (attribute.Get() if attribute.HasAuthoredValue() else None) == scheme
    assert not stage.HasAuthoredMetadata("metersPerUnit")


def test_a_written_stage_is_self_contained(tmp_path: Path) -> None:
    vertices = np.zeros((3, 4, 3))
    vertices[1, 2] = np.nan
    about: Any = {"fps": 25, "up_axis": "y", "start": 1001, "metres_per_unit": 0.01}
    sequence = dynmesh.Sequence(vertices, np.array([[0, 1, 2]]), name="a:b/1 é", **about)
    dynmesh.write(tmp_path / "a.usda", sequence)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1001, 1003)
    assert (stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()) == (25, 25)
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.01
    assert stage.GetDefaultPrim().GetPath() == "/a_b"
    found: Any = next(p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh))
    assert Sdf.Path.IsValidPathString(str(found.GetPath()))
    assert (tmp_path / "a.usda").read_bytes().startswith(b"#usda")


def test_the_suffix_decides_between_binary_and_text(tmp_path: Path) -> None:
    sequence = dynmesh.Sequence(np.zeros((2, 3, 3)), np.array([[0, 1, 2]]))
    for name, magic in (("a.usd", b"PXR-USDC"), ("a.usdc", b"PXR-USDC"), ("a.USDA", b"#usda 1.0")):
        dynmesh.write(tmp_path / name, sequence)
        assert (tmp_path / name).read_bytes().startswith(magic)
    layer(tmp_path / "text.usd", mesh(points_at(t1=1)))
    assert dynmesh.read(tmp_path / "text.usd").vertices.shape == (1, 3, 3)


UsdValidation: Any = pytest.importorskip("pxr.UsdValidation")

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


def stage_of(path: Path) -> Any:
    stage = Usd.Stage.Open(str(path))
    assert stage.GetCompositionErrors() == []
    return stage


def points_of(path: Path, mesh: str) -> dict[float, Any]:
    """The points of a mesh, by the times of their samples."""
    stage = stage_of(path)
    points = UsdGeom.Mesh(stage.GetPrimAtPath(mesh)).GetPointsAttr()
    return {time: np.array(points.Get(time)) for time in points.GetTimeSamples()}


def values_of(stage: Any) -> dict[str, Any]:
    """Everything that the stage says, by the path of the prim, the property or the metadata."""
    found: dict[str, Any] = {}
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)):
        found[str(prim.GetPath())] = (prim.GetTypeName(), prim.GetAppliedSchemas())
        for attribute in prim.GetAuthoredAttributes():
            samples = attribute.GetTimeSamples()
            found[str(attribute.GetPath())] = (
                [str(attribute.Get(time)) for time in samples or [Usd.TimeCode.Default()]],
                samples,
                attribute.GetAllMetadata(),
                attribute.GetConnections(),
            )
        for relation in prim.GetAuthoredRelationships():
            found[str(relation.GetPath())] = relation.GetTargets()
    return found


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
    for name in CHANGED - {"points", "extent", "extentsHint"}:
        assert not stage.GetAttributeAtPath(f"{BODY}.{name}").HasAuthoredValue()


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


def test_the_mesh_alone_is_written_by_a_conversion_or_from_other_formats(tmp_path: Path) -> None:
    scene = production(tmp_path / "scene.usda")
    said = run("convert", scene, tmp_path / "alone.usda", "--prim", BODY).stderr
    stage = stage_of(tmp_path / "alone.usda")
    assert [str(prim.GetPath()) for prim in stage.Traverse()] == ["/World", BODY]
    told = (
        "materials, normals, other meshes, transforms and velocities of scene.usda are not written"
    )
    assert told in said
    to_file.complete(scene, tmp_path / "one.npz", source={"prim": BODY})
    to_file.complete(tmp_path / "one.npz", tmp_path / "one.usda")
    assert not Sdf.Layer.FindOrOpen(str(tmp_path / "one.usda")).subLayerPaths


@pytest.mark.parametrize("mesh", MOVING)
def test_the_points_are_those_of_the_mesh_completed_alone(
    shot: Path, tmp_path: Path, mesh: str
) -> None:
    to_file.complete(shot / "scene.usda", tmp_path / "one.npz", source={"prim": mesh})
    expected = dynmesh.read(tmp_path / "one.npz").vertices
    report = over(shot / "scene.usda", tmp_path / "over.usda", mesh, provenance=True)
    said = any("normals, velocities of scene.usda are blocked" in told for told in report.remarks)
    assert said == (mesh == BODY)  # the others have no normals and velocities
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


def test_usdchecker_finds_nothing(shot: Path, tmp_path: Path) -> None:
    registry = UsdValidation.ValidationRegistry()
    check = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators()).Validate
    assert [error.GetMessage() for error in check(stage_of(shot / "done" / "over.usda"))] == []
    bare = Usd.Stage.CreateNew(str(tmp_path / "bare.usda"))
    bare.DefinePrim("/a", "Mesh")
    assert check(bare)  # it does find something elsewhere


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
imath: Any = pytest.importorskip("imath")
Abc, Core, Geometry = alembic.Abc, alembic.AbcCoreAbstract, alembic.AbcGeom
VERTEX = Geometry.GeometryScope.kVertexScope
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32)


def integers(*values: int) -> Any:
    return imath.IntArrayFromBuffer(np.array(values, np.int32))


def add_mesh(archive: Any, name: str, heights: list[float], sampling: int = 0) -> Any:
    """Adds a triangle that rises; returns its schema."""
    schema = Geometry.OPolyMesh(archive.getTop(), name).getSchema()
    schema.setTimeSampling(sampling)
    for height in heights:
        schema.set(sample(CORNERS + np.float32(height), 2, 1, 0))
    return schema


def sample(points: Any, *corners: int) -> Any:
    faces = (integers(*corners), integers(3)) if corners else ()
    return Geometry.OPolyMeshSchemaSample(imath.V3fArrayFromBuffer(points), *faces)


def archive_of(path: Path, heights: list[float], times: Any = None) -> Path:
    archive = Abc.OArchive(str(path))
    add_mesh(archive, "Body", heights, 0 if times is None else archive.addTimeSampling(times))
    return path


def stored_at(*times: float, cycle: float | None = None) -> Any:
    """Samples at these times, or at these of each cycle."""
    stored = Core.TimeVector()
    stored[:] = times
    kind = Core.AcyclicFlag.kAcyclic if cycle is None else (len(times), cycle)
    kinds = kind if isinstance(kind, tuple) else (kind,)
    return Core.TimeSampling(Core.TimeSamplingType(*kinds), stored)


@pytest.mark.parametrize(
    ("sampling", "fps", "start", "times"),
    [
        (None, None, 0, None),
        (Core.TimeSampling(1 / 25, 0.04), 25, 1, None),
        (Core.TimeSampling(1001 / 30000, 1001 * 1001 / 30000), 30000 / 1001, 1001, None),
        (Core.TimeSampling(0.5, 0.25), 2, 0.5, None),
        (Core.TimeSampling(1.0, 5.0), None, 5, None),
        (stored_at(0.5, 0.75, 1.0), 4, 2, None),
        (stored_at(0.5, 0.75, 2.0), 4, 2, [2, 3, 8]),
        (stored_at(1 / 24, 5 / 24, 6 / 24), 24, 1, [1, 5, 6]),
        (stored_at(5.0, 6.0, 9.5), None, 5, [5, 6, 9.5]),
        (stored_at(0.0, 0.25, cycle=1.0), 4, 0, [0, 1, 4]),
    ],
)
def test_samples_of_archives_are_frames(
    tmp_path: Path, sampling: Any, fps: float | None, start: float, times: list[float] | None
) -> None:
    sequence = dynmesh.read(archive_of(tmp_path / "a.abc", [1, 2, 3], sampling))
    np.testing.assert_array_equal(sequence.vertices[:, 0, 2], [1, 2, 3])
    np.testing.assert_array_equal(sequence.faces, [[0, 1, 2]])  # counterclockwise
    assert sequence.fps == (None if fps is None else pytest.approx(fps))
    assert sequence.start == start
    assert (None if sequence.times is None else sequence.times.tolist()) == times
    assert sequence.name == "/Body"


@pytest.mark.parametrize("rate", [24.0, 59.94, 24000 / 1001, 30000 / 1001, 60000 / 1001])
def test_uneven_samples_are_counted_at_the_rate_of_the_program(tmp_path: Path, rate: float) -> None:
    path = tmp_path / "a.abc"
    archive = Abc.CreateArchiveWithInfo(str(path), rate, "another program", "")
    times = [1001, 1003, 1005, 1010]
    sampling = archive.addTimeSampling(stored_at(*(time / rate for time in times)))
    add_mesh(archive, "Body", [1, 2, 3, 4], sampling)
    del archive
    again = dynmesh.read(path)
    assert again.fps == rate
    np.testing.assert_array_equal(again.times, times)
    dynmesh.write(tmp_path / "b.abc", again)
    found = Abc.IArchive(str(tmp_path / "b.abc")).getTop().getChild("Body")
    stored = Geometry.IPolyMesh(found.getParent(), "Body").getSchema().getTimeSampling()
    np.testing.assert_array_equal(
        [stored.getSampleTime(i) for i in range(4)], np.array(times) / rate
    )


def parameter(schema: Any, kind: str, scope: Any, *samples: Any) -> None:
    parameter = getattr(Geometry, f"O{kind}GeomParam")(
        schema.getArbGeomParams(), "known", False, scope, 1
    )
    for sample in samples:
        parameter.set(getattr(Geometry, f"O{kind}GeomParamSample")(sample, scope))


def masked(*values: int) -> Any:
    array = imath.UnsignedCharArray(len(values))
    np.asarray(array)[:] = values
    return array


FACEVARYING = Geometry.GeometryScope.kFacevaryingScope
UNSUITABLE: list[tuple[Callable[[Any], None], str]] = [
    (lambda s: parameter(s, "Int32", VERTEX, integers(1, 1, 0)), "known: .*uchar"),
    (lambda s: parameter(s, "Uchar", FACEVARYING, masked(1, 1, 0)), "known: .*per vertex"),
    (lambda s: parameter(s, "Uchar", VERTEX, masked(1, 1, 0), masked(1, 0, 0)), "known: .*2 .*3"),
    (lambda s: parameter(s, "Uchar", VERTEX, masked(1, 1)), "frame 0: known .*2 .*3"),
    (
        lambda s: parameter(s, "Uchar", VERTEX, *[masked(1, 1, 1)] * 2, masked(0, 1, 255)),
        "frame 2: known: .*0 or 1",
    ),
    (lambda s: s.set(sample(CORNERS[:2])), "frame 3: positions .*2 .*3"),
    (lambda s: s.set(sample(CORNERS, 0, 1, 2)), "frame 3: .*faces"),
]


@pytest.mark.parametrize(("add", "told"), UNSUITABLE)
def test_unsuitable_meshes_of_archives_are_refused(tmp_path: Path, add: Any, told: str) -> None:
    path = tmp_path / "a.abc"
    archive = Abc.OArchive(str(path))
    add(add_mesh(archive, "Body", [1, 2, 3]))
    del archive
    assert_refused(path, told)


def test_a_mask_may_be_constant_and_an_archive_empty(tmp_path: Path) -> None:
    path = tmp_path / "a.abc"
    archive = Abc.OArchive(str(path))
    parameter(add_mesh(archive, "Body", [1, 2, 3]), "Uchar", VERTEX, masked(1, 1, 0))
    del archive
    np.testing.assert_array_equal(dynmesh.read(path).known, [[True, True, False]] * 3)
    assert_refused(archive_of(tmp_path / "empty.abc", []))


def test_written_archives_follow_conventions(tmp_path: Path) -> None:
    vertices = np.zeros((3, 4, 3))
    vertices[1, 2] = np.nan
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    path = tmp_path / "a.abc"
    dynmesh.write(path, dynmesh.Sequence(vertices, faces, fps=25, name="/Him/Body", start=1))
    archive = Abc.IArchive(str(path))
    above = archive.getTop().getChild("Him")
    assert Geometry.IXform.matches(above.getHeader())
    schema = Geometry.IPolyMesh(above, "Body").getSchema()
    assert list(schema.getFaceIndicesProperty().getValue(0)) == [2, 1, 0, 3, 2, 0]  # clockwise
    assert schema.getTopologyVariance() == Geometry.MeshTopologyVariance.kHomogenousTopology
    assert [schema.getTimeSampling().getSampleTime(i) for i in range(3)] == [0.04, 0.08, 0.12]
    assert Abc.GetArchiveInfo(archive)["dccFPS"] == 25
    bounds = schema.getSelfBoundsProperty().samples[1]
    assert (tuple(bounds.min()), tuple(bounds.max())) == ((0, 0, 0), (0, 0, 0))


def test_what_surrounds_the_mesh_is_not_written_which_is_said(tmp_path: Path) -> None:
    path = tmp_path / "a.abc"
    archive = Abc.OArchive(str(path))
    world = Geometry.OXform(archive.getTop(), "world")
    moved = Geometry.XformSample()
    moved.setTranslation(imath.V3d(1, 2, 3))
    world.getSchema().set(moved)
    schema = Geometry.OPolyMesh(world, "body").getSchema()
    normals = Geometry.ON3fGeomParamSample(imath.V3fArrayFromBuffer(CORNERS), VERTEX)
    for height in (0, 1):
        mesh = sample(CORNERS + np.float32(height), 2, 1, 0)
        mesh.setNormals(normals)
        schema.set(mesh)
    add_mesh(archive, "still", [1])
    del archive, world, schema
    report = to_file.convert(path, tmp_path / "b.abc")
    (remark,) = (remark for remark in report.remarks if "of a.abc are not written" in remark)
    assert remark == "normals, other meshes and transforms of a.abc are not written"
    assert to_file.convert(tmp_path / "b.abc", tmp_path / "c.abc").remarks == ()


POLYGONS = "int[] faceVertexCounts = [4, 3]\nint[] faceVertexIndices = [0, 1, 2, 3, 0, 3, 4]"
PLACES = np.random.default_rng(0).random((7, 2)).astype(np.float32)
"""The texture coordinates of the corners of a quadrilateral and a triangle."""


def textured(path: Path, *more: str, name: str = "st", texture: Any = PLACES) -> Path:
    """A mesh with these texture coordinates, of corners or of vertices."""
    points = "[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (-1, 0, 0)]"
    kind = "faceVarying" if len(texture) == 7 else "vertex"
    values = ", ".join(str(tuple(row)) for row in texture.tolist())
    lines = (
        f"point3f[] points.timeSamples = {{1: {points}, 2: {points}}}",
        f'texCoord2f[] primvars:{name} = [{values}] (interpolation = "{kind}")',
    )
    return layer(path, mesh(*lines, *more, faces=POLYGONS))


def texture_in(path: Path) -> Any:
    with dynmesh.open(path) as reader:
        return reader.header.texture


def corners_in_obj(path: Path) -> list[list[tuple[list[float], int]]]:
    """The texture coordinates and the vertices of the corners of each face."""
    lines = [line.split() for line in path.read_text().splitlines()]
    places = [[float(x) for x in words] for kind, *words in lines if kind == "vt"]
    faces = [[word.split("/") for word in words] for kind, *words in lines if kind == "f"]
    return [[(places[int(t) - 1], int(v) - 1) for v, t in face] for face in faces]


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
    faces = dynmesh.read(path).polygons
    assert faces is not None
    assert faces.corners.tolist() == [3, 2, 1, 0, 4, 3, 0]
    np.testing.assert_array_equal(texture_in(path), PLACES[[3, 2, 1, 0, 6, 5, 4]])
    by_vertex = textured(tmp_path / "b.usda", told, texture=PLACES[:5])
    np.testing.assert_array_equal(texture_in(by_vertex), PLACES[faces.corners])
    to_file.convert(path, tmp_path / "c.usda")
    again = dynmesh.read(tmp_path / "c.usda").polygons
    assert again is not None
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
    for words in (
        ("convert", path, tmp_path / "b.npz"),
        ("info", path),
        ("evaluate", path, path),
        ("view", path, "-o", tmp_path / "b.html"),
        ("picture", path, "-o", tmp_path / "b.png"),
    ):
        done = run(*words)
        told = done.stdout + done.stderr
        assert ("moved by" in told) == (f"the mesh is moved by {mover}," in told) == bool(mover)


@pytest.mark.parametrize("moves", [False, True])
def test_transforms_that_move_a_mesh_of_an_archive_are_said(tmp_path: Path, moves: bool) -> None:
    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    world = Geometry.OXform(archive.getTop(), "world")
    for x in (0, 1) if moves else (1,):
        placed = Geometry.XformSample()
        placed.setTranslation(imath.V3d(x, 2, 3))
        world.getSchema().set(placed)
    Geometry.OPolyMesh(world, "body").getSchema().set(sample(CORNERS, 2, 1, 0))
    del archive, world
    assert ("moved by transforms" in run("info", tmp_path / "a.abc").stdout) == moves


def test_archives_are_written_where_space_cannot_be_reserved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr("os.posix_fallocate")
    ocean = dynmesh.synth.ocean(2, grid=4)
    dynmesh.write(tmp_path / "a.abc", ocean)
    np.testing.assert_array_equal(dynmesh.read(tmp_path / "a.abc").vertices, ocean.vertices)


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
        for make in (to_file.convert, to_file.complete):
            remarks = make(path, tmp_path / name, overwrite=True).remarks
            assert [one for one in remarks if "of a.usda" in one] == [told]
    assert to_file.convert(path, tmp_path / "alone.usda").remarks == (left,)
    layered = to_file.complete(path, tmp_path / "over.usda").remarks
    assert not [one for one in layered if "written" in one]
    to_file.convert(path, tmp_path / "one.obj", frames=slice(1, 2))
    remarks = to_file.convert(tmp_path / "one.obj", tmp_path / "f.abc").remarks
    assert remarks == ("texture coordinates of one.obj are not written",)
    moving = "texCoord2f[] primvars:st.timeSamples = {1: [(0, 0)], 2: [(1, 1)]}"
    path = layer(tmp_path / "g.usda", mesh(points_at(t1=1), moving))
    assert to_file.convert(path, tmp_path / "g.abc").remarks == ("st of g.usda are not written",)


def test_a_template_provides_the_texture_coordinates(tmp_path: Path) -> None:
    path = textured(tmp_path / "a.usda")
    partial = dynmesh.read(path)
    dynmesh.write(tmp_path / "partial.npz", partial)
    to_file.complete(tmp_path / "partial.npz", tmp_path / "b.abc", template=path)
    np.testing.assert_array_equal(texture_in(tmp_path / "b.abc"), PLACES)
