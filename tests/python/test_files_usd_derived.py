"""Attributes of a USD mesh that follow from its points, such as normals and velocities."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command
from meshes import Array, turned

import dynmesh
from dynmesh.polygons import Polygons, split_polygons

Sdf, Usd, UsdGeom, Vt = (
    pytest.importorskip(f"pxr.{name}") for name in ("Sdf", "Usd", "UsdGeom", "Vt")
)

N_FRAMES, RATE = 5, 25
TIMES = np.arange(N_FRAMES) + 1001.0
stages: list[Any] = []  # a mesh does not keep its stage alive
VELOCITY, ACCELERATION = np.array([3.0, -2, 1]), np.array([40.0, 0, -60])


def box() -> tuple[Array, Array]:
    """The corners of a cube and its squares, counter-clockwise as seen from outside."""
    corners = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], np.float64)
    squares = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corners, np.array(squares)


def moved(points: Array) -> Array:
    """Positions of all frames of an accelerated throw."""
    seconds = (np.arange(N_FRAMES) / RATE)[:, None, None]
    return points + VELOCITY * seconds + ACCELERATION * seconds**2 / 2


def unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def normals_of(layout: str) -> Array:
    """The normals of the box in this layout."""
    corners, squares = box()
    flat, smooth = unit(corners[squares].mean(axis=1)), unit(corners)
    return {
        "vertex": smooth,
        "varying": smooth,
        "uniform": flat,
        "faceVarying": smooth[squares.ravel()],
        "flat faceVarying": np.repeat(flat, 4, axis=0),
    }[layout]


def original(
    path: Path,
    values: Array | None,
    interpolation: str,
    *,
    name: str = "normals",
    indices: Array | None = None,
    orientation: str = "rightHanded",
    holes: bool = True,
) -> Path:
    """A moving box with missing values in all its attributes after the first frame."""
    corners, squares = box()
    stage = Usd.Stage.CreateNew(str(path))
    stage.SetTimeCodesPerSecond(RATE)
    mesh = UsdGeom.Mesh.Define(stage, "/World/Box")
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateOrientationAttr(orientation)
    mesh.CreateFaceVertexCountsAttr([4] * 6)
    mesh.CreateFaceVertexIndicesAttr(squares.ravel().tolist())
    normals = None
    if name == "normals":
        normals = mesh.CreateNormalsAttr()
        mesh.SetNormalsInterpolation(interpolation)
    else:
        primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
            name.removeprefix("primvars:"), Sdf.ValueTypeNames.Normal3fArray, interpolation
        )
        normals = primvar.GetAttr()
        if indices is not None:
            primvar.SetIndices(Vt.IntArray(indices.tolist()))
    velocities = mesh.CreateVelocitiesAttr()
    accelerations = mesh.CreateAccelerationsAttr()
    for frame, (time, points) in enumerate(zip(TIMES.tolist(), moved(corners), strict=True)):
        lost = np.zeros((8, 1), np.bool_)
        lost[[frame, frame + 3]] = holes and frame > 0
        set_to(mesh.CreatePointsAttr(), np.where(lost, np.nan, points), time)
        if values is not None:
            of_faces = lost[squares].any(axis=1)
            gone = {8: lost, 6: of_faces, 24: np.repeat(of_faces, 4, axis=0)}.get(
                len(values), False
            )
            set_to(normals, np.where(gone, np.nan, values), time)
        velocity = VELOCITY + ACCELERATION * frame / RATE
        set_to(velocities, np.where(lost, np.nan, velocity), time)
        set_to(accelerations, np.where(lost, np.nan, ACCELERATION), time)
    stage.Save()
    return path


def set_to(attribute: Any, values: Array, time: float) -> None:
    attribute.Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, np.float32)), time)


def layered(over: Path, under: Path) -> Any:
    """Returns the mesh composed from one file as a stronger layer over the other."""
    path = under.with_name("both.usda")
    rate = f"timeCodesPerSecond = {RATE}"
    path.write_text(f"#usda 1.0\n(subLayers = [@{over.name}@, @{under.name}@]\n{rate})\n")
    return mesh_of(path, "/World/Box")


def mesh_of(path: Path, name: str) -> Any:
    stages.append(Usd.Stage.Open(str(path)))
    stages[-1].Reload()  # the file may have been replaced
    return UsdGeom.Mesh(stages[-1].GetPrimAtPath(name))


def samples(attribute: Any) -> Array:
    np.testing.assert_array_equal(attribute.GetTimeSamples(), TIMES)
    return np.array([attribute.Get(time) for time in TIMES.tolist()])


LAYOUTS = ("vertex", "varying", "uniform", "faceVarying", "flat faceVarying")


@pytest.mark.parametrize("indexed", [False, True])
def test_normals_may_be_a_primvar(tmp_path: Path, indexed: bool) -> None:
    values, indices = normals_of("faceVarying"), None
    if indexed:
        values, indices = normals_of("vertex"), box()[1].ravel()
    name = "primvars:normals"
    source = original(tmp_path / "a.usda", values, "faceVarying", name=name, indices=indices)
    dynmesh.complete_file(source, tmp_path / "b.usdc")
    mesh = layered(tmp_path / "b.usdc", source)
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    assert (primvar.GetInterpolation(), primvar.IsIndexed()) == ("faceVarying", False)
    expected = [normals_of("faceVarying")] * N_FRAMES
    np.testing.assert_allclose(samples(primvar.GetAttr()), expected, atol=1e-5)
    assert not mesh.GetNormalsAttr().HasAuthoredValue()


@pytest.mark.parametrize("fps", [None, 50.0])
def test_velocities_are_those_of_the_completed_points(tmp_path: Path, fps: float | None) -> None:
    source = original(tmp_path / "a.usda", None, "vertex")
    dynmesh.complete_file(source, tmp_path / "b.usdc", fps=fps)
    mesh = layered(tmp_path / "b.usdc", source)
    if fps:  # the result without the original
        mesh = mesh_of(tmp_path / "b.usdc", "/World/Box")
    speed = 1 if fps is None else fps / RATE
    seconds = np.arange(N_FRAMES) / RATE
    seconds[[0, -1]] = 0.5 / RATE, (N_FRAMES - 1.5) / RATE  # one-sided differences
    expected = speed * (VELOCITY + ACCELERATION * seconds[:, None])
    velocities = samples(mesh.GetVelocitiesAttr())
    np.testing.assert_allclose(velocities, np.repeat(expected[:, None], 8, 1), atol=1e-3)
    accelerations = samples(mesh.GetAccelerationsAttr())
    np.testing.assert_allclose(
        accelerations, np.broadcast_to(speed**2 * ACCELERATION, (N_FRAMES, 8, 3)), atol=0.02
    )
    assert not mesh.GetNormalsAttr().HasAuthoredValue()


def test_velocities_of_frames_that_are_not_evenly_spaced(tmp_path: Path) -> None:
    times = np.array([1.0, 2, 4, 5, 9])
    seconds = (times / 10)[:, None, None]
    vertices = box()[0] + ACCELERATION * seconds**2 / 2
    derived = {"velocities": "vertex", "accelerations": "vertex"}
    faces = np.array([[0, 1, 2]])
    sequence = dynmesh.Sequence(vertices, faces, fps=10, times=times, derived=derived)
    dynmesh.write(tmp_path / "a.usda", sequence)
    mesh = mesh_of(tmp_path / "a.usda", "/mesh")
    for i, time in list(enumerate(times.tolist()))[1:-1]:
        velocity = np.array(mesh.GetVelocitiesAttr().Get(time))
        np.testing.assert_allclose(velocity[0], ACCELERATION * seconds[i, 0, 0], atol=1e-3)
        acceleration = np.array(mesh.GetAccelerationsAttr().Get(time))
        np.testing.assert_allclose(acceleration[0], ACCELERATION, rtol=1e-3)


HARD = normals_of("flat faceVarying")
HARD[:8] = normals_of("faceVarying")[:8]  # two smooth sides of six


@pytest.mark.parametrize("name", ["normals", "primvars:normals"])
@pytest.mark.parametrize(
    ("values", "interpolation"),
    [(HARD, "faceVarying"), (HARD[:1], "constant"), (HARD, "vertex")],
    ids=["hard edges", "constant", "too many"],
)
def test_attributes_that_cannot_be_computed_are_blocked(
    tmp_path: Path,
    name: str,
    values: Array,
    interpolation: str,
) -> None:
    indices = np.arange(len(values)) if name == "primvars:normals" else None
    source, target = tmp_path / "a.usda", tmp_path / "b.usdc"
    original(source, values, interpolation, name=name, indices=indices)
    table = tmp_path / "jobs.csv"
    table.write_text(f"input,output\n{source},{target}\n")
    for command in (("complete", source, target), ("convert", source, target), ("batch", table)):
        told = dynmesh_command(*command, "--overwrite").stderr
        assert f"{target}: {name} are blocked" in told
        assert "velocities" not in told
        mesh = layered(target, source)
        assert not mesh.GetPrim().GetAttribute(name).HasValue()
        assert not UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals").HasValue()


def test_one_frame_has_no_velocity_and_two_no_acceleration(tmp_path: Path) -> None:
    source, target = tmp_path / "a.npz", tmp_path / "b.usdc"
    derived = {"velocities": "vertex", "accelerations": "vertex"}
    for n_frames, blocked in (
        (1, {"velocities", "accelerations"}),
        (2, {"accelerations"}),
        (3, ()),
    ):
        vertices = moved(box()[0])[:n_frames]
        sequence = dynmesh.Sequence(vertices, np.array([[0, 1, 2]]), fps=RATE, derived=derived)
        dynmesh.write(source, sequence)
        told = dynmesh_command("convert", source, target, "--overwrite").stderr
        mesh = mesh_of(target, "/mesh").GetPrim()
        for name in derived:
            assert (f"{name} are blocked" in told) == (name in blocked)
            assert mesh.GetAttribute(name).GetNumTimeSamples() == (
                0 if name in blocked else n_frames
            )


def test_holes_have_neither_normals_nor_velocities(tmp_path: Path) -> None:
    source = original(tmp_path / "a.usda", normals_of("vertex"), "vertex")
    dynmesh.write(tmp_path / "b.usdc", dynmesh.read(source))
    mesh = layered(tmp_path / "b.usdc", source)
    points, normals = samples(mesh.GetPointsAttr()), samples(mesh.GetNormalsAttr())
    lost = np.isnan(points)
    assert lost.any()
    np.testing.assert_array_equal(np.isnan(normals), lost)
    squares = box()[1]
    for holes, lengths in zip(lost[..., 0], np.linalg.norm(normals, axis=2), strict=True):
        told = np.unique(
            squares[~holes[squares].any(axis=1)]
        )  # from faces without missing vertices
        np.testing.assert_allclose(lengths[told], 1, rtol=1e-5)
    assert np.isnan(samples(mesh.GetVelocitiesAttr())[lost]).all()

    # masked vertices also count as missing
    source = original(tmp_path / "c.usda", normals_of("vertex"), "vertex", holes=False)
    known = np.array(np.isfinite(points).all(axis=-1))
    dynmesh.write(tmp_path / "d.usdc", replace(dynmesh.read(source), known=known))
    mesh = layered(tmp_path / "d.usdc", source)
    np.testing.assert_array_equal(np.isnan(samples(mesh.GetNormalsAttr())), lost)
    assert np.isnan(samples(mesh.GetVelocitiesAttr())[lost]).all()


@pytest.mark.parametrize("layout", LAYOUTS)
def test_normals_turn_with_the_points(tmp_path: Path, layout: str) -> None:
    corners, squares = box()
    angles = np.linspace(0, 2, N_FRAMES)
    faces, polygons = split_polygons(Polygons(np.full(6, 4), squares.ravel()))
    sequence = dynmesh.Sequence(
        np.stack([turned(corners, angle) for angle in angles]),
        faces,
        fps=RATE,
        polygons=polygons,
        start=1001,
        derived={"normals": layout},
    )
    dynmesh.write(tmp_path / "a.usdc", sequence)
    mesh = mesh_of(tmp_path / "a.usdc", "/mesh")
    assert mesh.GetNormalsInterpolation() == layout.split()[-1]
    normals = samples(mesh.GetNormalsAttr())
    for angle, found in zip(angles, normals, strict=True):
        np.testing.assert_allclose(found, turned(normals_of(layout), angle), atol=1e-6)


@pytest.mark.parametrize("suffix", [".npz", ".h5", ".usdc"])
def test_derived_attributes_survive_other_formats(tmp_path: Path, suffix: str) -> None:
    source = original(tmp_path / "a.usda", -normals_of("flat faceVarying"), "faceVarying")
    expected = {
        "normals": "reversed flat faceVarying",
        "velocities": "vertex",
        "accelerations": "vertex",
    }
    assert dynmesh.read(source).derived == expected
    through = tmp_path / f"through{suffix}"
    dynmesh.write(through, dynmesh.read(source))
    assert dynmesh.read(through).derived == expected
    dynmesh.complete_file(through, tmp_path / "b.usdc")
    mesh = layered(tmp_path / "b.usdc", source)
    expected_normals = [-normals_of("flat faceVarying")] * N_FRAMES
    np.testing.assert_allclose(samples(mesh.GetNormalsAttr()), expected_normals, atol=1e-5)


def test_normals_that_are_damaged_do_not_keep_the_points_from_being_read(tmp_path: Path) -> None:
    far, name = np.full(24, 99), "primvars:normals"
    values = normals_of("vertex")
    source = original(tmp_path / "a.usda", values, "faceVarying", name=name, indices=far)
    assert (dynmesh.read(source).derived or {})["primvars:normals"] == "blocked"
    source = original(tmp_path / "b.usda", np.full((8, 3), np.nan), "vertex")
    assert (dynmesh.read(source).derived or {})["normals"] == "vertex"
    source = original(
        tmp_path / "c.usda", np.full((8, 3), np.nan), "vertex", orientation="leftHanded"
    )
    assert (dynmesh.read(source).derived or {})["normals"] == "reversed vertex"
