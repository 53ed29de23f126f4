"""The unit and the up axis of points under transforms, in USD and Alembic."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from commands import dynmesh_command as run
from layers import layer, mesh, points_at
from stages import stage_of

import dynmesh

Usd: Any = pytest.importorskip("pxr.Usd")
UsdGeom: Any = pytest.importorskip("pxr.UsdGeom")
alembic: Any = pytest.importorskip("alembic3d")
imath: Any = pytest.importorskip("imath")

X, Y, Z = "xyz"


def ops(*each: tuple[str, str]) -> str:
    """Lines of a prim with these transforms, such as ("scale", "= (1, 1, 1)"), in their order."""
    kinds = {"scale": "float3", "translate": "double3", "transform": "matrix4d"}
    names = [f"xformOp:{name}" for name, _ in each]
    lines = [f"{kinds.get(name, 'double')} xformOp:{name}{value}" for name, value in each if value]
    order = ", ".join(f'"{name}"' for name in names).replace('"xformOp:!', '"!')
    return "\n".join([*lines, f"uniform token[] xformOpOrder = [{order}]"])


HALF = " = ((0.5, 0, 0, 0), (0, 0, 0.5, 0), (0, -0.5, 0, 0), (7, 8, 9, 1))"
"""A scale by a half and a turn by which what was y is z."""

STAGES: dict[str, tuple[tuple[str, str], str, str, Any, Any]] = {
    "nothing": (("Z", "1"), "", "", Z, 1),
    "scale": (("Z", "1"), ops(("scale", " = (0.01, 0.01, 0.01)")), "", Z, 0.01),
    "scale of the mesh": (("Y", "0.01"), "", ops(("scale", " = (100, 100, 100)")), Y, 1),
    "quarter turn": (("Y", "1"), ops(("rotateX", " = -90")), "", Z, 1),
    "quarter turn to the side": (("Z", "0.01"), ops(("rotateY", " = -90")), "", X, 0.01),
    "uneven": (("Z", "1"), ops(("scale", " = (1, 1, 1.1)")), "", None, None),
    "mirror": (("Z", "0.01"), ops(("scale", " = (-10, 10, 10)")), "", Z, 0.1),
    "matrix": (("Z", "1"), ops(("transform", HALF)), "", Y, 0.5),
    "matrices": (("Z", "1"), ops(("transform", HALF)), ops(("transform", HALF)), None, 0.25),
    "reset": (
        ("Z", "1"), ops(("scale", " = (3, 3, 3)")),
        ops(("!resetXformStack!", ""), ("rotateZ", " = 9")), Z, 1
    ),
    "moves": (
        ("Z", "1"), ops(("translate", ".timeSamples = {1: (0, 0, 0), 2: (1, 0, 0)}")), "", Z, 1
    ),
    "still in samples": (
        ("Z", "1"), ops(("translate", ".timeSamples = {1: (1, 0, 0), 2: (1, 0, 0)}")), "", Z, 1
    ),
    "turns": (("Y", "0.1"), ops(("rotateY", ".timeSamples = {1: 0, 2: 60}")), "", Y, 0.1),
    "falls": (("Y", "0.1"), ops(("rotateX", ".timeSamples = {1: 0, 2: 60}")), "", None, 0.1),
    "grows": (
        ("Y", "1"), ops(("scale", ".timeSamples = {1: (1, 1, 1), 2: (2, 2, 2)}")), "", Y, None
    ),
    "unit alone": (("", "0.001"), ops(("scale", " = (10, 10, 10)")), "", None, 0.01),
    "nothing stated": (("", ""), ops(("scale", " = (1, 2, 3)")), "", None, None),
}  # fmt: skip
"""What a stage states, transforms above and of the mesh, and the axis and unit of its points."""


def staged(path: Path, name: str) -> Path:
    (up, metres), above, own, *_ = STAGES[name]
    about = f'upAxis = "{up}"\n' * bool(up) + f"metersPerUnit = {metres}\n" * bool(metres)
    body = mesh(points_at(t1=1, t2=2), own)
    return layer(path, f'def Xform "Shot" {{\n{above}\n{body}}}', about=about)


@pytest.mark.parametrize("name", STAGES)
def test_the_unit_and_the_axis_are_those_of_the_points(tmp_path: Path, name: str) -> None:
    """What is not known is said; the stage stays as it is under a layer."""
    path = staged(tmp_path / "a.usda", name)
    (up, metres), *_, axis, unit = STAGES[name]
    with dynmesh.open(path) as frames:
        header, first, remarks = frames.header, frames[0].points, frames.remarks
    assert header.up_axis == axis
    assert header.metres_per_unit == (None if unit is None else pytest.approx(unit, rel=1e-12))
    told = " ".join(remarks)
    assert ("up axis" in told) == (bool(up) and axis is None)
    assert ("unit of length" in told) == (bool(metres) and unit is None)
    assert ("moved by transforms" in told) == (name in ("moves", "turns", "falls", "grows"))
    assert told in run("info", path).stdout.replace("\n", " ")
    to_file.complete(path, tmp_path / "over.usda")
    before, after = stage_of(path), stage_of(tmp_path / "over.usda")
    for of in (UsdGeom.GetStageUpAxis, UsdGeom.GetStageMetersPerUnit):
        assert of(before) == of(after)
    prims = [stage.GetPrimAtPath("/Shot/Body") for stage in (before, after)]
    assert len({str(UsdGeom.Xformable(p).ComputeLocalToWorldTransform(2)) for p in prims}) == 1
    was, points = (np.array(prim.GetAttribute("points").Get(2)) for prim in prims)
    np.testing.assert_array_equal(points, was)
    changes: Any = {"to_up": "z"} if axis == X else {}  # which USD does not have
    to_file.convert(path, tmp_path / "alone.usda", **changes)
    alone = stage_of(tmp_path / "alone.usda")
    assert alone.HasAuthoredMetadata("upAxis") == (axis is not None)
    assert alone.HasAuthoredMetadata("metersPerUnit") == (unit is not None)
    if None not in (axis, unit):
        made = dynmesh.read(dynmesh.convert(tmp_path / "alone.usda", to_unit="m", to_up="z"))
        cache = UsdGeom.XformCache(Usd.TimeCode(1))
        matrix = np.array(cache.GetLocalToWorldTransform(prims[0]))
        scene = (first @ matrix[:3, :3] + matrix[3, :3]) * float(metres)
        height = np.ptp(scene[:, "XYZ".index(up)])
        assert np.ptp(made.vertices[0][:, 2]) == pytest.approx(height, rel=1e-5, abs=1e-9)
        assert np.linalg.norm(np.ptp(made.vertices[0], axis=0)) > 0


def archive_of(path: Path, about: str, *matrices: Any, inherits: bool = True) -> Path:
    """An archive with a triangle under transforms, each of one matrix or one for each frame."""
    abc, geometry = alembic.Abc, alembic.AbcGeom
    archive = abc.CreateArchiveWithInfo(str(path), 24.0, "another program", about)
    sampling = archive.addTimeSampling(alembic.AbcCoreAbstract.TimeSampling(1 / 24, 0.0))
    parent = archive.getTop()
    for number, matrix in enumerate(matrices):
        parent = geometry.OXform(parent, f"x{number}", int(sampling))
        for one in matrix if isinstance(matrix, list) else [matrix]:
            sample = geometry.XformSample()
            sample.setMatrix(imath.M44d(*np.asarray(one, np.float64).ravel().tolist()))
            sample.setInheritsXforms(inherits)
            parent.getSchema().set(sample)
    schema = geometry.OPolyMesh(parent, "Body").getSchema()
    schema.setTimeSampling(int(sampling))
    for z in (0.0, 1.0):
        points = imath.V3fArray(3)
        points[1], points[2] = imath.V3f(1, 0, z), imath.V3f(0, 1, 0)
        corners, counts = imath.IntArray(3), imath.IntArray(1)
        for corner in range(3):
            corners[corner] = corner
        counts[0] = 3
        schema.set(geometry.OPolyMeshSchemaSample(points, corners, counts))
    return path


def scaled(by: float) -> Any:
    return np.diag([by, by, by, 1])


LYING = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""What is y in the mesh is z above it."""


@pytest.mark.parametrize(
    ("matrices", "inherits", "axis", "unit"),
    [
        ([], True, Z, 0.01),
        ([scaled(0.1)], True, Z, 0.001),
        ([scaled(4), scaled(25), LYING], True, Y, 1),
        ([scaled(4), scaled(25)], False, Z, 0.25),
        ([[np.eye(4), scaled(1)]], True, Z, 0.01),
        ([[np.eye(4), scaled(2)]], True, Z, None),
        ([[np.eye(4), LYING]], True, None, 0.01),
        ([np.diag([1, 2, 1, 1])], True, None, None),
    ],
)
def test_the_same_holds_in_alembic(
    tmp_path: Path, matrices: Any, inherits: bool, axis: Any, unit: Any
) -> None:
    about = "up_axis z, metres_per_unit 0.01"
    path = archive_of(tmp_path / "a.abc", about, *matrices, inherits=inherits)
    with dynmesh.open(path) as frames:
        assert (frames.header.up_axis, frames.header.metres_per_unit) == (axis, unit)
        told = " ".join(frames.remarks)
    assert ("up axis" in told, "unit of length" in told) == (axis is None, unit is None)
    moves = any(isinstance(one, list) and (one[0] != one[1]).any() for one in matrices)
    assert ("moved by transforms" in told) == moves
    plain = archive_of(tmp_path / "b.abc", "", *matrices, inherits=inherits)
    with dynmesh.open(plain) as frames:
        assert (frames.header.up_axis, frames.header.metres_per_unit) == (None, None)
        assert not any("unknown" in remark for remark in frames.remarks)
