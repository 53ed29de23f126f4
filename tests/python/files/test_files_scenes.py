"""USD stages of other programs."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from commands import dynmesh_command as run
from layers import FACES, REST, layer, mesh, points_at
from sequences import assert_refused

import dynmesh

Sdf, Usd, UsdGeom, UsdUtils = (
    pytest.importorskip(f"pxr.{name}") for name in ("Sdf", "Usd", "UsdGeom", "UsdUtils")
)


@pytest.mark.parametrize(
    ("about", "samples", "fps", "start", "times"),
    [
        # of a surface that rests in between, and no sample is stored
        ("timeCodesPerSecond = 24", "t1=0 t2=1 t5=1 t6=5", 24, 1, None),
        ("timeCodesPerSecond = 25", "t1 t2 t3", 25, 1, None),
        ("", "t1 t2", None, 1, None),
        ("timeCodesPerSecond = 24", "t6 t8 t10", 12, 3, None),
        ("timeCodesPerSecond = 24", "t1 t1_5 t2", 48, 2, None),
        # time codes, where the times do not follow from a rate
        ("timeCodesPerSecond = 25", "t1 t2 t4", 25, 1, [1, 2, 4]),
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
    stated = [sample.split("=") for sample in samples.split()]
    heights = {one[0]: float(one[1] if one[1:] else n) for n, one in enumerate(stated)}
    path = layer(tmp_path / "a.usda", mesh(points_at(**heights)), about=about)
    sequence = dynmesh.read(path)
    expected = [0, 1, 1, 1, 1, 5] if "=" in samples else range(len(heights))
    np.testing.assert_array_equal(sequence.vertices[:, 0, 2], expected)
    assert sequence.fps == (None if fps is None else pytest.approx(fps))
    assert sequence.start == start
    assert (None if sequence.times is None else sequence.times.tolist()) == times


def test_a_mesh_is_chosen_and_info_lists_them(tmp_path: Path) -> None:
    still = mesh(f"point3f[] points = {REST}", name="Still")
    moving = mesh(points_at(t0=1, t1=2), name="Moving")
    other = mesh(points_at(t0=3, t1=4), name="Other")
    path = layer(tmp_path / "a.usda", still, moving)
    assert dynmesh.read(path).name == "/Moving"
    assert dynmesh.read(path, prim="/Still").name == "/Still"
    told = json.loads(run("info", path, "--json").stdout)
    moves = {name: row["moves"] for name, row in told["meshes"].items()}
    assert moves == {"/Still": False, "/Moving": True}
    layer(path, still, moving, other)
    assert_refused(path, ": /Moving, /Other")
    assert dynmesh.read(path, prim="/Other").vertices[0, 0, 2] == 3
    for prim in ("/Nobody", "Moving", "not a path"):
        assert_refused(path, f"'{prim}'.* /Still, /Moving, /Other", prim=prim)
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
        (mesh(points_at(t1=1), faces=""), "no faces"),
        (mesh(points_at(t1=1), faces=FACES.replace("0, ", "")), "3 corners, .* 2"),
        (mesh(FEWER), "time 2: points .*1 .*3"),
        (mesh(points_at(t1=1), TURNED), "time 4: .*faces"),
        (mesh(points_at(t1=1), known("[1, 1]")), "time 1: primvars:known .*2 .*3"),
        (
            mesh(points_at(t1=1), known("['a', 'b', 'c']", kind="token[]")),
            r"primvars:known: .*token",
        ),
        (
            mesh(points_at(t1=1), known("[1, 0]"), "int[] primvars:known:indices = [0, 1, 0]"),
            "primvars:known: .*indices",
        ),
        # masks lack a sample for a frame
        (masked_at("1: [1, 1, 1], 3: [1, 0, 1]"), "time 2: primvars:known"),
    ],
)
def test_unsuitable_meshes_are_refused(
    tmp_path: Path, body: str, told: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert_refused(layer(tmp_path / "a.usda", body), told)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("samples", ["2: [1, 0, 1]", "1: [1, 0, 1], 3: [1, 0, 1]"])
def test_masks_hold_before_after_and_between_equal_samples(tmp_path: Path, samples: str) -> None:
    """As USD has it; those of all frames are not lost for it."""
    path = layer(tmp_path / "a.usda", masked_at(samples))
    for gaps in ("refuse", "lost"):
        read = dynmesh.read(path, gaps=gaps)
        np.testing.assert_array_equal(read.known, [[True, False, True]] * 3)


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
    report = dynmesh.write(tmp_path / "a.usda", sequence)
    (remark,) = [remark for remark in report.remarks if "a:b/1 é" in remark]
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1001, 1003)
    assert (stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()) == (25, 25)
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.01
    assert stage.GetDefaultPrim().GetPath() == "/a_b"
    found: Any = next(p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh))
    assert Sdf.Path.IsValidPathString(str(found.GetPath()))
    assert str(found.GetPath()) in remark
    assert (tmp_path / "a.usda").read_bytes().startswith(b"#usda")
