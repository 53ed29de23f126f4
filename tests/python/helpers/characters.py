"""A stage with a character of several meshes, which have holes after a capture."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array

Gf, Sdf, Usd, UsdGeom, UsdShade, Vt = (
    pytest.importorskip(f"pxr.{name}") for name in ("Gf", "Sdf", "Usd", "UsdGeom", "UsdShade", "Vt")
)

FIRST, LAST, RATE = 1001, 1060, 24.0
BODY, COAT, EYE = "/Char/Geo/Body", "/Char/Geo/Coat", "/Char/Geo/Head/Eye"
MESHES = {BODY: (14, 0), COAT: (10, 1), EYE: (8, 2)}
"""The sides of the grids, and seeds."""
STAND = "/Char/Geo/Stand"
"""It does not move, and nothing of it is missing."""


def _grid(n: int) -> tuple[Array, Array]:
    """A sheet of quadrilaterals with (n * n) vertices: corners and positions, in centimetres."""
    v = np.arange(n * n).reshape(n, n)
    quads = np.stack([v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:]], axis=-1).reshape(-1, 4)
    x, z = np.meshgrid(np.linspace(1, 41, n), np.linspace(0, 160, n), indexing="ij")
    return quads, np.stack([x.ravel(), np.zeros(n * n), z.ravel()], axis=1)


def truth_of(name: str, n_frames: int = LAST - FIRST + 1) -> Array:
    """(n, k, 3) the true positions of a mesh, in its own space."""
    n, seed = MESHES[name]
    _, rest = _grid(n)
    time = np.arange(n_frames)[:, None] / RATE
    swing = 8 * np.sin(2 * time + rest[:, 2] / 80 + seed)
    frames = np.repeat(rest[None], n_frames, axis=0)
    frames[..., 1] += swing
    frames[..., 0] += 0.5 * swing + 12 * time
    return frames.astype(np.float32)


def known_of(name: str, n_frames: int = LAST - FIRST + 1) -> Array:
    """(n, k) which of them were captured."""
    rng = np.random.default_rng(MESHES[name][1])
    rest = truth_of(name, 1)[0]
    hole = np.linalg.norm(rest - rest[rng.integers(len(rest))], axis=1) < 35
    known = rng.random((n_frames, len(rest))) < 0.8
    known[:, hole] = False
    known[0] = True
    return known


def character(path: Path, n_frames: int = LAST - FIRST + 1) -> Path:
    """Writes the stage: z up, centimetres, from frame 1001 on.

    The eye is below transforms that move, the others below one that stands still, which an exporter
    has sampled in every frame. The body has NaN in its holes, the coat zeros and an integer mask,
    and the eye a mask of another name.
    """
    times = [float(FIRST + number) for number in range(n_frames)]
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    stage.SetTimeCodesPerSecond(RATE)
    stage.SetFramesPerSecond(RATE)
    stage.SetStartTimeCode(times[0])
    stage.SetEndTimeCode(times[-1])
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/Char").GetPrim())
    still = UsdGeom.Xform.Define(stage, "/Char/Geo").AddTransformOp()
    nod = UsdGeom.Xform.Define(stage, "/Char/Geo/Head").AddTransformOp()
    for number, time in enumerate(times):
        still.Set(Gf.Matrix4d().SetTranslate(Gf.Vec3d(5, 0, 0)), time)
        turn = Gf.Rotation(Gf.Vec3d(0, 0, 1), 2.0 * number)
        nod.Set(Gf.Matrix4d().SetTransform(turn, Gf.Vec3d(0, 0, 170)), time)
    skin = UsdShade.Material.Define(stage, "/Char/Looks/Skin")
    for name in MESHES:
        _add_mesh(stage, name, times, skin)
    stand = UsdGeom.Mesh.Define(stage, STAND)
    quads, rest = _grid(3)
    stand.CreateFaceVertexCountsAttr([4] * len(quads))
    stand.CreateFaceVertexIndicesAttr(quads.ravel().tolist())
    stand.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(rest.astype(np.float32)))
    UsdGeom.Camera.Define(stage, "/Cam")
    stage.GetRootLayer().Save()
    return path


def _add_mesh(stage: Any, name: str, times: list[float], skin: Any) -> None:
    quads, rest = _grid(MESHES[name][0])
    truth, known = truth_of(name, len(times)), known_of(name, len(times))
    made = UsdGeom.Mesh.Define(stage, name)
    made.CreateFaceVertexCountsAttr([4] * len(quads))
    made.CreateFaceVertexIndicesAttr(quads.ravel().tolist())
    made.CreateSubdivisionSchemeAttr("catmullClark")
    api = UsdGeom.PrimvarsAPI(made)
    places = np.ascontiguousarray(rest[quads.ravel()][:, [0, 2]] / 160, np.float32)
    texture = api.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    texture.Set(Vt.Vec2fArray.FromNumpy(places))
    UsdGeom.Subset.CreateGeomSubset(made, "upper", "face", Vt.IntArray([0, 1, 2]), "materialBind")
    UsdShade.MaterialBindingAPI.Apply(made.GetPrim()).Bind(skin)
    velocities = np.gradient(truth.astype(float), axis=0) * RATE
    mask = {
        COAT: ("known", Sdf.ValueTypeNames.IntArray, Vt.IntArray, np.int32),
        EYE: ("tracked", Sdf.ValueTypeNames.UCharArray, Vt.UCharArray, np.uint8),
    }.get(name)
    one = None if mask is None else api.CreatePrimvar(mask[0], mask[1], "vertex")
    for number, time in enumerate(times):
        points, seen = truth[number].copy(), known[number]
        points[~seen] = np.nan if mask is None else 0
        made.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points), time)
        made.CreateVelocitiesAttr().Set(
            Vt.Vec3fArray.FromNumpy(np.float32(np.where(seen[:, None], velocities[number], 0))),
            time,
        )
        if mask is not None and one is not None:
            one.Set(mask[2].FromNumpy(seen.astype(mask[3])), time)
