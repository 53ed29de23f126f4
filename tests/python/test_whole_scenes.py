"""Scenes are shown and converted with all their meshes."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from archives import BODY as ARCHIVE_BODY
from archives import Production, alembic3d, content, imath
from commands import dynmesh_command as run
from meshes import Array, sheet
from stages import BODY, FLAG, HAT, STONE, TIMES, frames_of, production

import dynmesh
from dynmesh.draw.heatmap import Heatmap
from dynmesh.files.scene_files import open_scene
from dynmesh.files.whole_scene import WholeScene
from dynmesh.frames.header import header_of
from dynmesh.frames.times import frame_seconds
from dynmesh.jobs.showing import open_shown

Usd, UsdGeom, Vt = (pytest.importorskip(f"pxr.{name}") for name in ("Usd", "UsdGeom", "Vt"))
images = pytest.importorskip("PIL.Image")

MESHES = {BODY, HAT, STONE, FLAG, FLAG.replace("First", "Second")}


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return production(tmp_path / "scene.usda")


def points_of(reader: WholeScene, frame: int) -> dict[str, Array]:
    """The points of each mesh of the whole in a frame."""
    (one,) = reader.frames(frame, frame + 1)
    ends = np.cumsum(list(reader.meshes.values()))
    return dict(zip(reader.meshes, np.split(one.points, ends[:-1]), strict=True))


def stage_of(path: Path, times: dict[str, list[float]], rate: float = 24) -> Path:
    """A stage with meshes that rise by one from frame to frame; one time makes a still one."""
    stage = Usd.Stage.CreateNew(str(path))
    stage.SetTimeCodesPerSecond(rate)
    rest = sheet(4)
    for place, (name, own) in enumerate(times.items()):
        mesh = UsdGeom.Mesh.Define(stage, name)
        mesh.CreateFaceVertexCountsAttr([3] * len(rest.faces))
        mesh.CreateFaceVertexIndicesAttr(rest.faces.ravel().tolist())
        for number, time in enumerate(own):
            points = rest.vertices + np.array([6 * place, 0, number])
            mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)), time)
    stage.GetRootLayer().Save()
    return path


def heights(reader: WholeScene, mesh: str) -> list[int]:
    """How far a mesh of such a stage has risen in each frame."""
    rest = sheet(4).vertices[0, 2]
    return [round(float(points_of(reader, n)[mesh][0, 2] - rest)) for n in range(reader.n_frames)]


def test_meshes_are_at_their_places_in_a_stage(scene: Path) -> None:
    """The world moves along x, the rig is turned by 30 degrees, the flags are 5 further along y."""
    with open_shown(scene) as whole:
        assert isinstance(whole, WholeScene)
        assert set(whole.meshes) == MESHES
        found = points_of(whole, 3)
        assert (whole.n_frames, whole.fps, whole.header.up_axis) == (len(TIMES), 12, "z")
    moved = np.array([TIMES[3], 0, 0])
    body, seen = frames_of(0)
    known = seen[3]
    np.testing.assert_allclose(found[BODY][known], body[3, known] + moved, rtol=1e-6)
    assert np.isnan(found[BODY][~known]).all()
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    hat, seen = frames_of(1)
    np.testing.assert_allclose(
        found[HAT][seen[3]], hat[3, seen[3]] @ turn + moved, rtol=1e-5, atol=1e-4
    )
    flag, seen = frames_of(2)
    expected = flag[3, seen[3]] + moved + [0, 5, 0]
    np.testing.assert_allclose(found[FLAG][seen[3]], expected, rtol=1e-6)
    np.testing.assert_allclose(found[STONE], frames_of(3)[0][0] + moved, rtol=1e-6)


def test_meshes_are_at_their_places_in_an_archive(tmp_path: Path) -> None:
    Production(tmp_path / "a.abc", holes=False)
    with open_shown(tmp_path / "a.abc") as whole:
        assert isinstance(whole, WholeScene)
        found = points_of(whole, 4)
        assert (whole.header.number(4), whole.fps) == (1005, 24)
    angle = np.radians(20)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    expected = (frames_of(0)[0][4] * [1, 2, 1]) @ turn + [4, 2, 0]
    np.testing.assert_allclose(found[ARCHIVE_BODY], expected, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(found["/hat"], frames_of(1)[0][4], rtol=1e-6)
    np.testing.assert_allclose(found["/stone"], frames_of(2)[0][0], rtol=1e-6)


def test_places_in_an_archive_follow_one_another(tmp_path: Path) -> None:
    """Unless one starts anew."""
    geom = alembic3d.AbcGeom
    archive = alembic3d.Abc.OArchive(str(tmp_path / "a.abc"))
    above = archive.getTop()
    for name, inherits in (("a", True), ("b", False), ("c", True), ("d", True)):
        above = geom.OXform(above, name)
        sample = geom.XformSample()
        sample.setTranslation(imath.V3d(1, 0, 0))
        sample.setScale(imath.V3d(2, 2, 2))
        sample.setInheritsXforms(inherits)
        above.getSchema().set(sample)
    points = imath.V3fArrayFromBuffer(np.eye(3, dtype=np.float32))
    corners, sizes = (imath.IntArrayFromBuffer(np.array(x, np.int32)) for x in ([0, 1, 2], [3]))
    sample = geom.OPolyMeshSchemaSample(points, corners, sizes)
    geom.OPolyMesh(above, "mesh").getSchema().set(sample)
    del archive, above, sample
    with WholeScene(open_scene(tmp_path / "a.abc")) as whole:
        (frame,) = whole
    np.testing.assert_array_equal(frame.points, 8 * np.eye(3) + [7, 0, 0])


def test_frames_are_joined_by_their_times(tmp_path: Path) -> None:
    path = stage_of(
        tmp_path / "a.usda",
        {
            "/slow": [101, 103, 105],
            "/late": [104, 105, 106, 107],
            "/uneven": [102, 104.5, 105],
            "/still": [7],
        },
    )
    with open_shown(path) as whole:
        assert isinstance(whole, WholeScene)
        numbers = [101, 102, 103, 104, 104.5, 105, 106, 107]
        assert [whole.header.number(n) for n in range(whole.n_frames)] == numbers
        np.testing.assert_allclose(frame_seconds(whole.header) * 24, numbers)
        assert heights(whole, "/slow") == [0, 0, 1, 1, 1, 2, 2, 2]
        assert heights(whole, "/late") == [0, 0, 0, 0, 0, 1, 2, 3]
        assert heights(whole, "/uneven") == [0, 0, 0, 0, 1, 2, 2, 2]
        assert heights(whole, "/still") == [0] * 8
        (remark,) = whole.remarks
        assert remark.endswith("first: /slow, /late, /uneven")
    even = stage_of(tmp_path / "b.usda", {"/slow": [101, 103, 105], "/fast": [102, 103, 104]})
    with open_shown(even) as whole:
        assert (whole.header.start, whole.header.times, whole.fps) == (101, None, 24)
        assert whole.n_frames == 5


def test_an_unreadable_mesh_is_left_out_and_named(tmp_path: Path) -> None:
    path = stage_of(tmp_path / "a.usda", {"/good": [1, 2], "/bad": [1, 2]})
    stage = Usd.Stage.Open(str(path))
    UsdGeom.Mesh(stage.GetPrimAtPath("/bad")).GetFaceVertexIndicesAttr().Set([99] * 54)
    stage.GetRootLayer().Save()
    with open_shown(path) as whole:
        assert isinstance(whole, WholeScene)
        assert set(whole.meshes) == {"/good"}
        assert whole.remarks[0].startswith("/bad is left out: faces: face 0 refers to vertex 99")
    UsdGeom.Mesh(stage.GetPrimAtPath("/good")).GetFaceVertexIndicesAttr().Set([99] * 54)
    stage.GetRootLayer().Save()
    with pytest.raises(ValueError, match=r"a.usda: /good is left out: .*; /bad is left out"):
        open_shown(path)


def test_a_mesh_that_breaks_off_is_named(tmp_path: Path) -> None:
    path = stage_of(tmp_path / "a.usda", {"/good": [1, 2, 3], "/bad": [1, 2, 3]})
    stage = Usd.Stage.Open(str(path))
    UsdGeom.Mesh(stage.GetPrimAtPath("/bad")).GetPointsAttr().Set([(0, 0, 0)], 3)
    stage.GetRootLayer().Save()
    reason = r"a\.usda: .*/bad: time 3: points has 1 values"
    with open_shown(path) as whole, pytest.raises(ValueError, match=reason):
        list(whole)
    with pytest.raises(ValueError, match=reason):
        dynmesh.convert_file(path, tmp_path / "b.usda")
    assert [file.name for file in tmp_path.iterdir()] == ["a.usda"]


def test_what_only_some_meshes_have_counts_as_observed_in_others(
    tmp_path: Path, scene: Path
) -> None:
    dynmesh.complete_scene(scene, tmp_path / "done.usdc", overlay=True, provenance=True)
    with open_shown(tmp_path / "done.usdc") as whole:
        assert isinstance(whole, WholeScene)
        *_, last = whole
        starts = dict(zip(whole.meshes, np.cumsum([0, *whole.meshes.values()]), strict=False))
        assert last.generation is not None
        stone = slice(starts[STONE], starts[STONE] + 25)
        body = slice(starts[BODY], starts[BODY] + 25)
        assert not last.generation[stone].any()
        alone = dynmesh.read(tmp_path / "done.usdc", prim=BODY).generation
        assert alone is not None
        np.testing.assert_array_equal(last.generation[body], alone[-1])
        assert Heatmap(whole).colours[0] == "generation"


def test_standard_errors_have_the_size_of_their_place(tmp_path: Path) -> None:
    mesh = sheet(4)
    ones = np.ones((2, 16), np.int32)
    sequence = dynmesh.Sequence(
        np.stack([mesh.vertices] * 2).astype(np.float32), mesh.faces, fps=24.0, name="/a/b",
        generation=ones, age=ones, standard_error=ones.astype(np.float32),
    )  # fmt: skip
    dynmesh.write(tmp_path / "a.usda", sequence)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    UsdGeom.Xformable(UsdGeom.Xform.Define(stage, "/a")).AddScaleOp().Set((3, 3, 3))
    stage.GetRootLayer().Save()
    with WholeScene(open_scene(tmp_path / "a.usda")) as whole:
        first = next(iter(whole))
    np.testing.assert_allclose(first.points, 3 * mesh.vertices, rtol=1e-6)
    assert first.standard_error is not None
    np.testing.assert_allclose(first.standard_error, 3, rtol=1e-6)


def colours_in(path: Path) -> set[int]:
    """The strongest of red, green and blue in the coloured pixels beside the legend."""
    with images.open(path) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)[60:-40, :-210].reshape(-1, 3)
    return set(pixels[np.ptp(pixels, axis=1) > 60].argmax(axis=1).tolist())


def test_pages_and_pictures_show_all_meshes_unless_one_is_named(tmp_path: Path) -> None:
    path = stage_of(tmp_path / "a.usda", {"/world/left": [1, 2], "/world/right": [1, 2, 3]})
    said = run("picture", path, "-o", tmp_path / "all.png").stderr
    assert "/world/left" in said
    assert colours_in(tmp_path / "all.png") == {0, 2}  # orange and blue
    run("picture", path, "-o", tmp_path / "one.png", "--prim", "/world/left")
    assert colours_in(tmp_path / "one.png") == set()
    said = run("view", path, "-o", tmp_path / "all.html", "--prim", "all").stderr
    assert "where a mesh has no frame" in said
    html = (tmp_path / "all.html").read_text()
    assert '"name": "mesh"' in html
    assert '"label": "right"' in html
    assert "where a mesh has no frame" in html
    one = dynmesh.view(path, reference=path).html
    assert '"colour": "error"' in one
    with dynmesh.open(path, prim="/world/right") as reader:
        assert '"n_vertices": 16,' in dynmesh.view(reader).html


def assert_same(one: Path, other: Path, mesh: str, prim: str | None = None) -> None:
    ours, theirs = dynmesh.read(one, prim=mesh), dynmesh.read(other, prim=prim or mesh)
    np.testing.assert_array_equal(ours.vertices, theirs.vertices)
    np.testing.assert_array_equal(ours.faces, theirs.faces)
    for name, values in ours.attributes().items():
        np.testing.assert_array_equal(values, theirs.attributes()[name])
    assert len(ours) == len(theirs)
    if len(ours) > 1:
        seconds, expected = (frame_seconds(header_of(one)) for one in (ours, theirs))
        np.testing.assert_allclose(seconds, expected)


@pytest.mark.parametrize("names", [("b.usdc",), ("b.abc",), ("b.abc", "c.usda")])
def test_all_meshes_are_converted(tmp_path: Path, scene: Path, names: tuple[str, ...]) -> None:
    paths = [scene, *(tmp_path / name for name in names)]
    for one, other in pairwise(paths):
        report = dynmesh.convert_file(one, other)
        assert set(report.meshes) == MESHES
        assert (report.frames, report.vertices) == (len(TIMES), 125)
        assert report.remarks[-1].startswith("holds the meshes alone")
    with open_shown(paths[-1]) as whole:
        assert isinstance(whole, WholeScene)
        assert set(whole.meshes) == MESHES
        assert whole.n_frames == len(TIMES)  # the mesh that is still is at the time of the others
    for mesh in MESHES:
        assert_same(paths[-1], scene, mesh)
    if paths[-1].suffix != ".abc":
        stage = Usd.Stage.Open(str(paths[-1]))
        rate = stage.GetTimeCodesPerSecond() / 24
        first, last = stage.GetStartTimeCode(), stage.GetEndTimeCode()
        assert (first, last) == (TIMES[0] * rate, TIMES[-1] * rate)


def test_an_archive_is_converted_with_everything_in_it(tmp_path: Path) -> None:
    Production(tmp_path / "a.abc")
    report = dynmesh.convert_file(tmp_path / "a.abc", tmp_path / "b.abc")
    assert set(report.meshes) == {"/rig/body", "/hat", "/stone"}
    before, after = content(tmp_path / "a.abc"), content(tmp_path / "b.abc")
    assert before.keys() - after.keys() == {"/:/.childBnds"}  # which have become wrong
    assert after.keys() <= before.keys()
    for name in ("/stone", "/rig", "/camera", "/copies"):
        for found in before:
            if found.startswith(f"{name}:"):
                assert repr(before[found]) == repr(after[found])
    for mesh in report.meshes:
        assert_same(tmp_path / "b.abc", tmp_path / "a.abc", mesh)


def test_conversions_apply_to_all_meshes(tmp_path: Path) -> None:
    times: dict[str, list[float]] = {"/a": [101, 102, 103, 104], "/b": [101, 102, 103, 104]}
    path = stage_of(tmp_path / "a.usda", times | {"/still": [3]})
    run("convert", path, tmp_path / "b.usda", "--scale", "2", "--frames", "102:104", "--fps", "12")
    for mesh, own in {"/a": slice(1, 3), "/b": slice(1, 3), "/still": slice(1)}.items():
        made = dynmesh.read(tmp_path / "b.usda", prim=mesh)
        before = dynmesh.read(path, prim=mesh)[own]
        np.testing.assert_array_equal(made.vertices, 2 * before.vertices)
        assert (made.fps, made.start) == (12, 102)
    run("convert", path, tmp_path / "c.abc", "--retime", "48")
    assert len(dynmesh.read(tmp_path / "c.abc", prim="/b")) == 7
    assert len(dynmesh.read(tmp_path / "c.abc", prim="/still")) == 1
    later = stage_of(tmp_path / "later.usda", times | {"/late": [102, 103]})
    for option in ("fps", "retime"):
        reason = f"{option}: the meshes have different frames, those of /late and /a"
        assert (
            reason in run("convert", later, tmp_path / "d.abc", f"--{option}", "12", code=1).stderr
        )


def test_what_becomes_of_scenes_in_files_of_one_mesh(tmp_path: Path) -> None:
    path = stage_of(tmp_path / "a.usda", {"/a": [1, 2], "/b": [1, 2], "/still": [1]})
    several = run("convert", path, tmp_path / "b.npz", code=1).stderr
    assert "choose one with --prim: /a, /b" in several
    report = dynmesh.convert_file(path, tmp_path / "b.npz", source={"prim": "/b"})
    assert (report.meshes, report.remarks) == ((), ())
    alone = stage_of(tmp_path / "c.usda", {"/a": [1, 2], "/still": [1]})
    report = dynmesh.convert_file(alone, tmp_path / "d.npz")
    assert report.remarks == ("holds /a alone, without the meshes that do not move: /still",)
    one = run("convert", path, tmp_path / "e.usda", "--prim", "/a").stderr
    assert "2 frames of 16 vertices\n" in one
    assert dynmesh.read(tmp_path / "e.usda").name == "/a"
