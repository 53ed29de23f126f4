"""What recorders write in place of missing positions, masks and frames."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from every_format import FORMATS, KEPT, place
from sequences import assert_refused, sea

import dynmesh

h5py, trimesh = pytest.importorskip("h5py"), pytest.importorskip("trimesh")
Sdf, Usd, UsdGeom, Vt = (
    pytest.importorskip(f"pxr.{name}") for name in ("Sdf", "Usd", "UsdGeom", "Vt")
)

N, K = 4, 36
WHOLE = sea(N, 6)
SEEN = np.random.default_rng(1).random((N, K)) < 0.7
SEEN[0] = True
CONFIDENCE = np.where(SEEN, 200, 90).astype(np.uint8)
CONFIDENCE[:, 0] = SEEN[:, 0]  # 0 and 1, as in a mask


@pytest.mark.parametrize("sentinel", [-999, 1e10, 0, "zero"])
@pytest.mark.parametrize("format", FORMATS)
def test_a_number_stands_for_missing_positions(
    tmp_path: Path, format: str, sentinel: float | str
) -> None:
    if format == "pc2":
        dynmesh.write(tmp_path / "body.obj", WHOLE[:1])
    vertices = WHOLE.vertices.copy()
    vertices[~SEEN] = 0 if sentinel == "zero" else sentinel
    vertices[:, 1, 0] = 0 if sentinel == "zero" else sentinel  # one coordinate alone
    path = place(tmp_path, format)
    dynmesh.write(path, replace(WHOLE, vertices=vertices))
    read = dynmesh.read(path, missing=sentinel)
    expected = SEEN.copy()
    expected[:, 1] = SEEN[:, 1]
    np.testing.assert_array_equal(read.known, expected)


def with_confidences(folder: Path, format: str, known: np.ndarray) -> Path:
    """A file as other programs write it, with values of `known` that are no mask."""
    path = place(folder, format)
    arrays = {"vertices": WHOLE.vertices, "faces": WHOLE.faces, "known": known}
    if format == "npz":
        np.savez(path, **arrays)
    elif format == "npy":
        for name, array in arrays.items():
            np.save(path if name == "vertices" else path.with_suffix(f".{name}.npy"), array)
    elif format == "hdf5":
        with h5py.File(path, "w") as file:
            file.update(arrays)
    elif format == "ply":
        for number, (points, values) in enumerate(zip(WHOLE.vertices, known, strict=True)):
            mesh = trimesh.Trimesh(points, WHOLE.faces, process=False)
            mesh.vertex_attributes["known"] = values
            mesh.export(folder / (path.name % number))
    elif format == "usd":
        dynmesh.write(path, WHOLE)
        kind = {"u": "UCharArray", "f": "FloatArray", "i": "IntArray"}[known.dtype.kind]
        mask(path, "known", kind, known)
    return path


def mask(path: Path, name: str, kind: str, known: np.ndarray) -> None:
    """Adds a primvar to the mesh of a stage."""
    stage = Usd.Stage.Open(str(path))
    api = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/mesh"))
    one = api.CreatePrimvar(name, getattr(Sdf.ValueTypeNames, kind), "vertex")
    for time, values in enumerate(known):
        one.Set(getattr(Vt, kind).FromNumpy(np.ascontiguousarray(values)), time)
    stage.GetRootLayer().Save()


@pytest.mark.parametrize("format", [name for name in FORMATS if "known" in KEPT[name]][:-1])
def test_confidences_become_masks_by_the_least_that_counts(tmp_path: Path, format: str) -> None:
    expected = SEEN & (np.arange(K) > 0)
    values: Any
    for least, values in ((128, CONFIDENCE), (0.5, (CONFIDENCE / 255).astype(np.float32))):
        (folder := tmp_path / f"{least}").mkdir()
        path = with_confidences(folder, format, values)
        np.testing.assert_array_equal(dynmesh.read(path, least_confidence=least).known, expected)
        told = run("complete", path, folder / "made.npz", code=1).stderr
        assert "--least-confidence is the least that counts as known" in told
    for values in (255 * SEEN.astype(np.uint8), SEEN.astype(np.int32)):  # an image, and a mask
        (folder := tmp_path / f"{values.dtype}").mkdir()
        path = with_confidences(folder, format, values)
        np.testing.assert_array_equal(dynmesh.read(path).known, SEEN)


def test_masks_in_files_of_their_own_may_be_confidences(tmp_path: Path) -> None:
    dynmesh.write(tmp_path / "a.npz", WHOLE)
    np.save(tmp_path / "mask.npy", CONFIDENCE)
    np.savez(tmp_path / "mask.npz", known=CONFIDENCE / 255)
    for name, least in (("mask.npy", 128), ("mask.npz", 0.5)):
        assert_refused(
            tmp_path / name,
            "`least_confidence`",
            lambda _, name=name: dynmesh.read(tmp_path / "a.npz", known=tmp_path / name),
        )
        made = dynmesh.read(tmp_path / "a.npz", known=tmp_path / name, least_confidence=least)
        np.testing.assert_array_equal(made.known, SEEN & (np.arange(K) > 0))


@pytest.mark.parametrize("axis", [(), (None,)], ids=["k", "1, k"])
@pytest.mark.parametrize("given", ["", "f%d.npz", "*.npz", "f##.npz"])
def test_one_archive_a_frame(tmp_path: Path, given: str, axis: Any) -> None:
    """In the order of the numbers in their names."""
    for number in range(N):
        name = f"f{number + 9:02d}.npz" if "##" in given else f"f{number + 9}.npz"
        arrays = {"vertices": WHOLE.vertices[number][axis], "known": SEEN[number][axis]}
        np.savez(tmp_path / name, faces=WHOLE.faces, up_axis="z", **arrays)
    read = dynmesh.read(tmp_path / given)
    np.testing.assert_array_equal(read.vertices, WHOLE.vertices)
    np.testing.assert_array_equal(read.known, SEEN)
    assert (read.start, read.up_axis) == (9, "z")
    run("complete", tmp_path / given, tmp_path / "made.h5")
    (tmp_path / "f10.npz").rename(tmp_path / "aside")
    if "##" not in given:
        lost: Any = dynmesh.read(tmp_path / given, gaps="lost")
        np.testing.assert_array_equal(lost.known.any(axis=1), [True, False, True, True])
        assert_refused(tmp_path / given, "f10.npz is missing", lambda path: dynmesh.open(path))


def test_archives_of_whole_sequences_and_results_beside_frames_are_no_frames(
    tmp_path: Path,
) -> None:
    for number in range(2):
        dynmesh.write(tmp_path / f"take{number}.npz", WHOLE)
    for given in ("", "take%d.npz"):
        told = rf"take0.npz: holds {N} frames, .*name one"
        with pytest.raises(ValueError, match=told):
            dynmesh.open(tmp_path / given)
    assert dynmesh.open(tmp_path / "take1*.npz").n_frames == N
    dynmesh.write(tmp_path / "f_%d.ply", WHOLE)
    assert dynmesh.open(tmp_path).n_frames == N


def shot(path: Path) -> Any:
    """A stage of which some frames show nothing: empty, blocked, invisible, without a mask."""
    dynmesh.write(path, sea(6, 6, start=1001, name="/world/body"))
    stage = Usd.Stage.Open(str(path))
    UsdGeom.Xform.Define(stage, "/world")
    return stage, UsdGeom.Mesh(stage.GetPrimAtPath("/world/body"))


LOST = {
    "empty": "points is empty",
    "blocked": "points is blocked",
    "invisible": "the mesh is invisible",
    "mask": "primvars:known has no sample",
}


@pytest.mark.parametrize("how", LOST)
def test_frames_of_a_stage_that_show_nothing(tmp_path: Path, how: str) -> None:
    path = tmp_path / "a.usda"
    stage, body = shot(path)
    if how == "empty":
        body.GetPointsAttr().Set(Vt.Vec3fArray(), 1003)
    elif how == "blocked":
        body.GetPointsAttr().Set(Sdf.ValueBlock(), 1003)
    elif how == "invisible":
        above = UsdGeom.Imageable(stage.GetPrimAtPath("/world")).CreateVisibilityAttr()
        for time, seen in ((1001, "inherited"), (1003, "invisible"), (1004, "inherited")):
            above.Set(seen, time)
    else:
        held = UsdGeom.PrimvarsAPI(body).CreatePrimvar(
            "known", Sdf.ValueTypeNames.BoolArray, "vertex"
        )
        for time in (1001, 1002, 1004, 1005, 1006):
            held.Set(Vt.BoolArray.FromNumpy(np.arange(36) != time - 1001), time)
    stage.GetRootLayer().Save()
    assert_refused(path, f"time 1003: {LOST[how]}; with `gaps` lost")
    assert "with --gaps lost" in run("info", path, code=1).stderr
    read = dynmesh.read(path, gaps="lost")
    present = np.array([frame.observed.any() for frame in read])
    np.testing.assert_array_equal(present, [True, True, False, True, True, True])
    run("complete", path, tmp_path / "made.usdc", "--gaps", "lost")
    made = Usd.Stage.Open(str(tmp_path / "made.usdc"))
    points = UsdGeom.Mesh(made.GetPrimAtPath("/world/body")).GetPointsAttr()
    assert points.GetTimeSamples() == [*range(1001, 1007)]
    assert all(np.isfinite(points.Get(time)).all() for time in points.GetTimeSamples())
    assert len(points.Get(1003)) == 36


def test_a_mesh_that_is_never_visible_is_read(tmp_path: Path) -> None:
    stage, body = shot(tmp_path / "a.usda")
    for time in (1001, 1004):
        body.CreateVisibilityAttr().Set("invisible", time)
    stage.GetRootLayer().Save()
    assert dynmesh.read(tmp_path / "a.usda").n_frames == 6


@pytest.mark.parametrize("kind", ["BoolArray", "UCharArray", "IntArray", "Int64Array", "UIntArray"])
def test_a_mask_may_be_a_primvar_of_any_name_and_integer_type(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "a.usda"
    dynmesh.write(path, WHOLE)
    dtype: dict[str, Any] = {"Bool": bool, "UChar": "u1", "Int": "i4", "Int64": "i8", "UInt": "u4"}
    for name in ("known", "tracked"):
        mask(path, name, kind, (SEEN ^ (name == "known")).astype(dtype[kind.removesuffix("Array")]))
    np.testing.assert_array_equal(dynmesh.read(path).known, ~SEEN)
    np.testing.assert_array_equal(dynmesh.read(path, known="primvars:tracked").known, SEEN)
    refused = run("info", path, "--mask", "primvars:seen", code=2).stderr
    assert "has no primvar 'seen', only known, tracked" in refused
