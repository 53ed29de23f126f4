"""All meshes of a scene are completed into one file, whatever is wrong with some of them."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from archives import HAT as HAT_IN_ALEMBIC
from archives import Production, alembic3d, content, imath
from commands import dynmesh_command
from memory import own_memory
from stages import BODY, FLAG, HAT, STONE, TIMES, production
from watches import interrupted_after

import dynmesh

Sdf: Any = pytest.importorskip("pxr.Sdf")
Usd: Any = pytest.importorskip("pxr.Usd")
UsdGeom: Any = pytest.importorskip("pxr.UsdGeom")
Vt: Any = pytest.importorskip("pxr.Vt")

MOVING = (BODY, HAT, FLAG, FLAG.replace("First", "Second"))


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return production(tmp_path / "scene.usda")


def spoil(path: Path) -> None:
    """Adds broken meshes: each is broken in another way, two of them in a later frame."""
    stage = Usd.Stage.Open(str(path))
    original = UsdGeom.Mesh(stage.GetPrimAtPath(BODY))
    corners = original.GetFaceVertexIndicesAttr()
    for name in ("Absent", "Faces", "Short", "Late", "Outside"):
        mesh = UsdGeom.Mesh.Define(stage, f"/World/A{name}")
        mesh.CreateFaceVertexCountsAttr(original.GetFaceVertexCountsAttr().Get())
        mesh.CreateFaceVertexIndicesAttr(corners.Get())
        for time in TIMES:
            points = np.array(original.GetPointsAttr().Get(TIMES[0])) + np.float32(time - TIMES[0])
            if name == "Absent":
                points[:] = np.nan
            if name == "Short" and time == TIMES[3]:
                points = points[:-1]
            mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points), time)
        if name == "Faces":
            mesh.GetFaceVertexIndicesAttr().Set(list(corners.Get())[::-1], TIMES[2])
            mesh.GetFaceVertexIndicesAttr().Set(corners.Get(), TIMES[0])
        if name == "Outside":
            mesh.GetFaceVertexIndicesAttr().Set([99, *corners.Get()[1:]])
        if name == "Late":
            known = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
                "known", Sdf.ValueTypeNames.BoolArray, "vertex"
            )
            known.Set([True] * 25)
            broken = np.full((25, 3), np.nan, np.float32)
            mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(broken), TIMES[4])
    stage.GetRootLayer().Save()


REASONS = {
    "/World/AAbsent": "frames: no vertex is known in any of them",
    "/World/AFaces": "time 1005: the faces differ",
    "/World/AShort": "time 1007: points has 24 values",
    "/World/ALate": "frame 504.5: points: row 0 is at (nan, nan, nan)",
    "/World/AOutside": "faces: face 0 refers to vertex 99",
}


@pytest.mark.parametrize("name", ["over.usdc", "plain.usdc", "plain.abc"])
def test_broken_meshes_do_not_keep_the_others_from_being_completed(
    tmp_path: Path, scene: Path, name: str
) -> None:
    expected = tmp_path / f"expected_{name}"
    dynmesh.complete_scene(scene, expected, overlay=name.startswith("over"))
    spoil(scene)
    options = ["--overlay"] if name.startswith("over") else []
    said = dynmesh_command("complete", scene, tmp_path / name, "--prim", "all", *options, code=1)
    for mesh, reason in REASONS.items():
        (line,) = (line for line in said.stderr.splitlines() if f": {mesh}: not completed" in line)
        assert reason in line
    assert "4 of 9 moving meshes completed" in said.stderr
    for mesh in MOVING:
        one, other = (dynmesh.read(path, prim=mesh) for path in (tmp_path / name, expected))
        np.testing.assert_array_equal(one.vertices, other.vertices)
    assert {path.name for path in tmp_path.iterdir()} == {scene.name, expected.name, name}
    if name.startswith("over"):
        layer = Sdf.Layer.FindOrOpen(str(tmp_path / name))
        assert not any(layer.GetPrimAtPath(mesh) for mesh in REASONS)
    else:
        meshes = open_paths(tmp_path / name)
        assert meshes == {*MOVING}


def open_paths(path: Path) -> set[str]:
    with pytest.raises(ValueError, match="has no mesh 'none'; the meshes are ") as caught:
        dynmesh.open(path, prim="none")
    return set(str(caught.value).rpartition(" are ")[2].split(", "))


def test_broken_meshes_of_an_archive_stay_as_they_were(tmp_path: Path) -> None:
    Production(tmp_path / "scene.abc")
    report = dynmesh.complete_scene(tmp_path / "scene.abc", tmp_path / "whole.abc")
    assert report.failed == {}
    scene = tmp_path / "broken.abc"
    Production(scene, first_frames_lack=HAT_IN_ALEMBIC)
    report = dynmesh.complete_scene(scene, tmp_path / "done.abc", start="whole")
    assert list(report.failed) == [HAT_IN_ALEMBIC]
    before, after, whole = (
        content(tmp_path / name) for name in ("broken.abc", "done.abc", "whole.abc")
    )
    for name in after:
        same_as = before if name.startswith(HAT_IN_ALEMBIC) else whole
        assert repr(after[name]) == repr(same_as[name])


def test_a_plain_file_holds_the_completed_meshes_alone_and_says_so(
    tmp_path: Path, scene: Path
) -> None:
    report = dynmesh.complete_scene(scene, tmp_path / "done.usda", provenance=True)
    assert open_paths(tmp_path / "done.usda") == {*MOVING}
    (remark,) = (remark for remark in report.remarks if "alone" in remark or "without" in remark)
    assert STONE in remark
    assert "--overlay" in remark
    stage = Usd.Stage.Open(str(tmp_path / "done.usda"))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (TIMES[0] / 2, TIMES[-1] / 2)
    again = dynmesh.read(tmp_path / "done.usda", prim=HAT)
    before = dynmesh.read(scene, prim=HAT)
    assert (again.fps, again.start) == (before.fps, before.start)
    assert (again.up_axis, again.metres_per_unit) == ("z", 0.01)


def test_meshes_of_other_rates_keep_their_seconds(tmp_path: Path) -> None:
    """The first mesh determines the time codes of the file."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    stage.SetTimeCodesPerSecond(24)
    for name, step in (("slow", 4), ("fast", 1), ("uneven", 0)):
        mesh = UsdGeom.Mesh.Define(stage, f"/{name}")
        mesh.CreateFaceVertexCountsAttr([3])
        mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
        for number in range(5):
            time = 48 + (number * step or number**2)
            mesh.GetPointsAttr().Set([(0, 0, number), (1, 0, number), (0, 1, number)], time)
    stage.GetRootLayer().Save()
    dynmesh.complete_scene(tmp_path / "a.usda", tmp_path / "b.usda")
    for name in ("slow", "fast", "uneven"):
        seconds: list[Any] = []
        for path in ("a.usda", "b.usda"):
            one = dynmesh.read(tmp_path / path, prim=f"/{name}")
            numbers = one.start + np.arange(5) if one.times is None else one.times
            assert one.fps is not None
            seconds.append(numbers / one.fps)
        np.testing.assert_allclose(seconds[0], seconds[1], rtol=1e-12)


def test_meshes_whose_names_are_the_same_in_usd_are_refused(tmp_path: Path) -> None:
    archive = alembic3d.Abc.OArchive(str(tmp_path / "a.abc"))
    for name in ("left hat", "left_hat"):
        schema = alembic3d.AbcGeom.OPolyMesh(archive.getTop(), name).getSchema()
        for height in (0, 1):
            points = imath.V3fArrayFromBuffer(np.eye(3, dtype=np.float32) + np.float32(height))
            corners = imath.IntArrayFromBuffer(np.arange(3, dtype=np.int32))
            sizes = imath.IntArrayFromBuffer(np.array([3], np.int32))
            schema.set(alembic3d.AbcGeom.OPolyMeshSchemaSample(points, corners, sizes))
    del archive, schema
    with pytest.raises(
        ValueError, match=r"cannot be written, since /left_hat in USD is that of another mesh"
    ):
        dynmesh.complete_scene(tmp_path / "a.abc", tmp_path / "b.usda")
    assert [path.name for path in tmp_path.iterdir()] == ["a.abc"]


def test_one_bar_counts_the_frames_of_all_meshes(tmp_path: Path, scene: Path) -> None:
    calls = []

    def watch(frames: Iterator[Any], whole: int, done: int) -> Iterator[Any]:
        seen = 0
        for frame in frames:
            assert frame.points.shape == (25, 3)
            seen += 1
            yield frame
        calls.append((whole, done, seen))

    dynmesh.complete_scene(scene, tmp_path / "done.usdc", watch=watch)
    assert calls == [(4 * len(TIMES), 0, 4 * len(TIMES))]


def test_an_interrupted_run_leaves_nothing(tmp_path: Path, scene: Path) -> None:
    watch = interrupted_after(15)
    with pytest.raises(KeyboardInterrupt):
        dynmesh.complete_scene(scene, tmp_path / "done.usdc", overlay=True, watch=watch)
    assert list(tmp_path.iterdir()) == [scene]


def test_zeros_that_a_scanner_wrote_can_be_missing(tmp_path: Path, scene: Path) -> None:
    dynmesh.complete_scene(scene, tmp_path / "a.usdc", source={"missing": "zero"})
    stage = Usd.Stage.Open(str(scene))
    UsdGeom.PrimvarsAPI(stage.GetPrimAtPath(HAT)).RemovePrimvar("known")
    stage.GetRootLayer().Save()
    dynmesh.complete_scene(scene, tmp_path / "b.usdc", source={"missing": "zero"})
    one, other = (dynmesh.read(tmp_path / name, prim=HAT) for name in ("a.usdc", "b.usdc"))
    np.testing.assert_array_equal(one.vertices, other.vertices)


def test_memory_does_not_grow_with_the_meshes(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usdc"))
    points = np.random.default_rng(0).random((60_000, 3)).astype(np.float32)
    for number in range(12):
        mesh = UsdGeom.Mesh.Define(stage, f"/mesh{number}")
        mesh.CreateFaceVertexCountsAttr([3])
        mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
        for time in range(8):
            points[0] += 1
            mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points), time)
        stage.GetRootLayer().Save()
    del stage, mesh
    used = []

    def watch(frames: Iterator[Any], *_: int) -> Iterator[Any]:
        for number, frame in enumerate(frames):
            if number % 8 == 7:
                used.append(own_memory())
            yield frame

    paths = (tmp_path / "a.usdc", tmp_path / "b.usdc")
    dynmesh.complete_scene(*paths, overlay=True, method="motion", watch=watch)
    assert len(used) == 12
    assert max(used[3:]) - used[2] < 40_000  # 12 meshes are 69 MB
