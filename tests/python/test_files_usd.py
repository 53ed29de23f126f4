"""USD stages of others, and ours laid over them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dynmesh

Sdf, Usd, UsdGeom, UsdUtils = (
    pytest.importorskip(f"pxr.{name}") for name in ("Sdf", "Usd", "UsdGeom", "UsdUtils")
)

FACES = "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]"
REST = "[(0, 0, 0), (1, 0, 0), (0, 1, 0)]"


def points_at(**samples: float) -> str:
    """Samples of three points, `t1_5=2` for height 2 at time 1.5."""
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
    ("about", "samples", "heights", "fps", "start"),
    [
        ("timeCodesPerSecond = 25", {"t1": 1, "t2": 2, "t3": 3}, [1, 2, 3], 25, 1),
        ("framesPerSecond = 30", {"t1_25": 1, "t2_25": 2}, [1, 2], 30, 1.25),
        ("", {"t1": 1, "t2": 2}, [1, 2], None, 1),
        ("", {"t2": 1, "t4": 2}, [1, 2], None, 2),
        ("timeCodesPerSecond = 24", {"t6": 1, "t8": 2, "t10": 3}, [1, 2, 3], 12, 3),
        ("timeCodesPerSecond = 24", {"t1": 1, "t1_5": 2, "t2": 3}, [1, 2, 3], 48, 2),
        ("timeCodesPerSecond = 24", {"t7": 1}, [1], 24, 7),
        # what an exporter left out, since nothing moved
        ("timeCodesPerSecond = 24", {"t1": 1, "t2": 2, "t5": 2, "t6": 3}, [1, *[2] * 4, 3], 24, 1),
        # what is missing
        ("timeCodesPerSecond = 24", {"t1": 1, "t2": 2, "t4": 3}, [1, 2, 3], None, 1),
        ("timeCodesPerSecond = 24", {"t1": 1, "t2": 2, "t3_3": 3}, [1, 2, 3], None, 1),
    ],
)
def test_samples_are_frames(
    tmp_path: Path,
    about: str,
    samples: dict[str, float],
    heights: list[float],
    fps: float | None,
    start: float,
) -> None:
    path = layer(tmp_path / "a.usda", mesh(points_at(**samples)), about=about)
    sequence = dynmesh.read(path)
    np.testing.assert_array_equal(sequence.vertices[:, 0, 2], heights)
    assert sequence.fps == (None if fps is None else pytest.approx(fps))
    assert sequence.start == start


def test_points_without_samples_are_one_frame(tmp_path: Path) -> None:
    path = layer(tmp_path / "a.usda", mesh(f"point3f[] points = {REST}"), about='upAxis = "Z"')
    sequence = dynmesh.read(path)
    np.testing.assert_array_equal(sequence.vertices, [[(0, 0, 0), (1, 0, 0), (0, 1, 0)]])
    np.testing.assert_array_equal(sequence.faces, [[0, 1, 2]])
    assert sequence.up_axis == "z"


def test_a_mesh_is_chosen(tmp_path: Path) -> None:
    still = mesh(f"point3f[] points = {REST}", name="Still")
    moving = mesh(points_at(t0=1, t1=2), name="Moving")
    other = mesh(points_at(t0=3, t1=4), name="Other")
    path = layer(tmp_path / "a.usda", still, moving)
    assert dynmesh.read(path).name == "/Moving"
    assert dynmesh.read(path, prim="/Still").name == "/Still"
    layer(path, still, moving, other)
    with pytest.raises(ValueError, match="several meshes; choose one with --prim: /Moving, /Other"):
        dynmesh.read(path)
    assert dynmesh.read(path, prim="/Other").vertices[0, 0, 2] == 3
    for prim in ("/Nobody", "Moving", "not a path"):
        with pytest.raises(ValueError, match=f"no mesh '{prim}', but /Still, /Moving, /Other"):
            dynmesh.read(path, prim=prim)
    layer(path, 'def Xform "Body" {}')
    with pytest.raises(ValueError, match="holds no mesh of polygons"):
        dynmesh.read(path)


def known(value: str, *, kind: str = "bool[]", interpolation: str = "vertex") -> str:
    return f'{kind} primvars:known = {value} (interpolation = "{interpolation}")'


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (mesh(), "the mesh has no points"),
        (mesh(points_at(t1=1), faces=""), "the mesh has no faces"),
        (
            mesh(points_at(t1=1), faces=FACES.replace("0, ", "")),
            "3 corners are announced, but there are 2",
        ),
        (
            mesh("point3f[] points.timeSamples = {1: [(0, 0, 0), (1, 0, 0)], 2: [(0, 0, 0)]}"),
            "time 2: points has 1 values, but the mesh has 2 vertices in its first frame",
        ),
        (
            mesh("point3f[] points.timeSamples = {1: [(0, 0, 0)], 2: None}"),
            "time 2: points has 0 values, but the mesh has 1 vertices",
        ),
        (
            mesh(
                points_at(t1=1),
                "int[] faceVertexIndices.timeSamples = {1: [0, 1, 2], 4: [2, 1, 0]}",
            ),
            "time 4: the faces are others than in the first frame",
        ),
        (
            mesh(points_at(t1=1), known("[1, 1]")),
            "time 1: primvars:known has 2 values, but the mesh has 3 vertices",
        ),
        (
            mesh(points_at(t1=1), known("[1]", interpolation="constant")),
            r"primvars:known: must be bool\[\] .*, not bool\[\] with constant interpolation",
        ),
        (
            mesh(points_at(t1=1), known("[1, 1, 0]", interpolation="faceVarying")),
            "primvars:known: must be .*, not .* with faceVarying interpolation",
        ),
        (
            mesh(points_at(t1=1), known("[1, 1, 0]", kind="float[]")),
            r"primvars:known: must be .*, not float\[\] with vertex",
        ),
        (
            mesh(points_at(t1=1), known("[1, 0]"), "int[] primvars:known:indices = [0, 1, 0]"),
            "primvars:known: must be .* without indices",
        ),
    ],
)
def test_meshes_that_are_no_sequence_are_refused(
    tmp_path: Path, body: str, message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = layer(tmp_path / "a.usda", body)
    with pytest.raises(ValueError, match=message) as caught:
        dynmesh.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def with_mask(path: Path, times: Mapping[int, list[bool]]) -> None:
    stage = Usd.Stage.Open(str(path))
    primvar = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/Body")).CreatePrimvar(
        "known", Sdf.ValueTypeNames.BoolArray, UsdGeom.Tokens.vertex
    )
    for time, value in times.items():
        primvar.Set(value, time)
    stage.Save()


def test_masks_have_a_sample_for_every_frame(tmp_path: Path) -> None:
    some, all_ = [True, False, True], [True] * 3
    path = layer(tmp_path / "a.usda", mesh(points_at(t1=1, t2=2, t3=3)))
    with_mask(path, {1: all_, 3: all_})  # left out, since nothing changes
    np.testing.assert_array_equal(dynmesh.read(path).known, [all_] * 3)
    for times, missing in (({1: all_, 3: some}, 2), ({1: all_, 2: some}, 3), ({2: some}, 1)):
        layer(path, mesh(points_at(t1=1, t2=2, t3=3)))
        with_mask(path, times)
        with pytest.raises(ValueError, match=f"time {missing}: primvars:known has no sample"):
            dynmesh.read(path)


def test_generation_without_age_is_not_ours(tmp_path: Path) -> None:
    age = 'float primvars:age = 3 (interpolation = "constant")'
    path = layer(tmp_path / "a.usda", mesh(points_at(t1=1), age))
    assert dynmesh.read(path).age is None


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


def test_what_is_missing_from_the_mesh_is_said(
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
        layer(path, *prims, about=about)
        with pytest.raises(ValueError, match=r"is not all there: .*@(points|body)\.usd@"):
            dynmesh.read(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(("times", "start"), [((1, 2), 1), ((1001.5, 1002.5), 1001.5), ((4, 6), 2)])
def test_a_result_is_laid_over_its_original(
    tmp_path: Path, times: tuple[float, float], start: float
) -> None:
    skin = 'def Material "Skin" {}\n'
    body = mesh(
        points_at(**{f"t{time}".replace(".", "_"): i + 1 for i, time in enumerate(times)}),
        'uniform token subdivisionScheme = "none"',
        'texCoord2f[] primvars:st = [(0, 0), (1, 0), (0, 1)] (interpolation = "vertex")',
        "rel material:binding = </World/Skin>",
    ).replace('"Body" {', '"Body" (prepend apiSchemas = ["MaterialBindingAPI"]) {')
    place = """double3 xformOp:translate = (1, 2, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]"""
    original = layer(
        tmp_path / "original.usda",
        f'def Xform "World" {{\n{place}\n{skin}{body}}}',
        about='timeCodesPerSecond = 24\nupAxis = "Z"\ndefaultPrim = "World"',
    )
    completed = tmp_path / "completed.usdc"
    with dynmesh.open(original) as reader, dynmesh.files.create_like(reader, completed) as writer:
        for frame in reader:
            writer.append(frame.points * 10 + 7)
    layers = "subLayers = [@completed.usdc@, @original.usda@]"
    over = layer(tmp_path / "both.usda", about=f"{layers}\ntimeCodesPerSecond = 24")
    for path, (first, second) in ((over, times), (completed, (start, start + 1))):
        stage = Usd.Stage.Open(str(path))
        found = UsdGeom.Mesh(stage.GetPrimAtPath("/World/Body"))
        points = [np.array(found.GetPointsAttr().Get(t)) for t in (first, second)]
        np.testing.assert_array_equal(np.array(points)[:, 0], [(7, 7, 17), (7, 7, 27)])
        extent = np.array(found.GetExtentAttr().Get(second))
        np.testing.assert_array_equal(extent, [(7, 7, 27), (17, 17, 27)])
        assert found.GetFaceVertexCountsAttr().Get() == [3]
        assert [p.GetPath() for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)] == [found.GetPath()]
        assert stage.GetDefaultPrim() == (
            stage.GetPrimAtPath("/World") if path == completed else Usd.Prim()
        )
    stage = Usd.Stage.Open(str(over))
    world, body_prim = stage.GetPrimAtPath("/World"), stage.GetPrimAtPath("/World/Body")
    assert world.GetTypeName() == "Xform"
    assert tuple(UsdGeom.Xformable(world).GetLocalTransformation().GetRow3(3)) == (1, 2, 3)
    assert len(UsdGeom.PrimvarsAPI(body_prim).GetPrimvar("st").Get()) == 3
    assert body_prim.GetRelationship("material:binding").GetTargets() == ["/World/Skin"]


def test_what_is_written_says_all_of_itself(tmp_path: Path) -> None:
    vertices = np.zeros((3, 4, 3))
    vertices[1, 2] = np.nan
    sequence = dynmesh.Sequence(
        vertices, np.array([[0, 1, 2]]), fps=25, up_axis="y", name="a:b/1 é", start=1001
    )
    dynmesh.write(tmp_path / "a.usda", sequence)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1001, 1003)
    assert (stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()) == (25, 25)
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert stage.GetDefaultPrim().GetPath() == "/a_b"
    found: Any = next(p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh))
    assert Sdf.Path.IsValidPathString(str(found.GetPath()))
    assert UsdGeom.Mesh(found).GetSubdivisionSchemeAttr().Get() == "none"
    assert (tmp_path / "a.usda").read_bytes().startswith(b"#usda")


def test_the_suffix_decides_between_binary_and_text(tmp_path: Path) -> None:
    sequence = dynmesh.Sequence(np.zeros((2, 3, 3)), np.array([[0, 1, 2]]))
    for name, magic in (("a.usd", b"PXR-USDC"), ("a.usdc", b"PXR-USDC"), ("a.USDA", b"#usda 1.0")):
        dynmesh.write(tmp_path / name, sequence)
        assert (tmp_path / name).read_bytes().startswith(magic)
    layer(tmp_path / "text.usd", mesh(points_at(t1=1)))
    assert dynmesh.read(tmp_path / "text.usd").vertices.shape == (1, 3, 3)


def test_packed_stages_are_only_read(tmp_path: Path) -> None:
    path = layer(tmp_path / "a.usda", mesh(points_at(t1=1, t2=2)))
    assert UsdUtils.CreateNewUsdzPackage(str(path), str(tmp_path / "a.usdz"))
    np.testing.assert_array_equal(dynmesh.read(tmp_path / "a.usdz").vertices[:, 0, 2], [1, 2])
    with pytest.raises(ValueError, match="usdz files are only read"):
        dynmesh.write(tmp_path / "b.usdz", dynmesh.read(path))
