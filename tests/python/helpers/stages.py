"""A USD stage as of a production: several meshes, transforms, materials, copies by reference."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import sheet, turned

Gf, Kind, Sdf, Usd, UsdGeom, UsdShade, Vt = (
    pytest.importorskip(f"pxr.{name}")
    for name in ("Gf", "Kind", "Sdf", "Usd", "UsdGeom", "UsdShade", "Vt")
)

RATE = 24.0
TIMES = tuple(1001.0 + 2 * number for number in range(6))
"""The time codes of the frames, which are two codes apart."""

BODY, HAT, FLAG = "/World/Body", "/World/Rig/Hat", "/World/Flags/First/Cloth"
STONE = "/World/Stone"


def frames_of(seed: int) -> tuple[Any, Any]:
    """Returns the true positions (n, k, 3) of a moving sheet and a mask (n, k), frame 0 whole."""
    rest = sheet(5).vertices
    truth = np.stack([turned(rest, 0.1 * (seed + 1) * i) for i in range(len(TIMES))])
    known = np.random.default_rng(seed).random(truth.shape[:2]) < 0.6
    known[0] = True
    return truth.astype(np.float32), known


def production(path: Path) -> Path:
    """Writes the stage."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    stage.SetTimeCodesPerSecond(RATE)
    stage.SetFramesPerSecond(RATE)
    stage.SetStartTimeCode(TIMES[0])
    stage.SetEndTimeCode(TIMES[-1])
    world = UsdGeom.Xform.Define(stage, "/World")
    stage.SetDefaultPrim(world.GetPrim())
    Usd.ModelAPI(world).SetKind(Kind.Tokens.component)
    UsdGeom.ModelAPI.Apply(world.GetPrim()).SetExtentsHint(
        Vt.Vec3fArray([Gf.Vec3f(-9), Gf.Vec3f(9)])
    )
    move = world.AddTranslateOp()
    for time in TIMES:
        move.Set(Gf.Vec3d(time, 0, 0), time)
    UsdGeom.Xform.Define(stage, "/World/Rig").AddRotateZOp().Set(30.0)
    UsdGeom.Camera.Define(stage, "/World/Camera").CreateFocalLengthAttr(35.0)

    material = UsdShade.Material.Define(stage, "/World/Looks/Skin")
    shader = UsdShade.Shader.Define(stage, "/World/Looks/Skin/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(0.8, 0.5, 0.4))
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")

    def mesh(name: str, seed: int) -> Any:
        faces = sheet(5).faces
        made = UsdGeom.Mesh.Define(stage, name)
        made.CreateFaceVertexCountsAttr([3] * len(faces))
        made.CreateFaceVertexIndicesAttr(faces.ravel().tolist())
        made.CreateSubdivisionSchemeAttr("none")
        truth, _ = frames_of(seed)
        texture = UsdGeom.PrimvarsAPI(made).CreatePrimvar(
            "st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex"
        )
        texture.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(truth[0, :, :2])))
        UsdShade.MaterialBindingAPI.Apply(made.GetPrim()).Bind(material)
        made.CreateExtentAttr(Vt.Vec3fArray([Gf.Vec3f(-9), Gf.Vec3f(9)]))
        return made

    body = mesh(BODY, 0)
    truth, known = frames_of(0)
    normals, velocities = body.CreateNormalsAttr(), body.CreateVelocitiesAttr()
    body.SetNormalsInterpolation("vertex")
    for time, points, seen in zip(TIMES, truth, known, strict=True):
        holes = np.where(seen[:, None], points, np.float32(np.nan))
        body.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(holes), time)
        normals.Set(Vt.Vec3fArray([Gf.Vec3f(0, 0, 1)] * len(points)), time)
        velocities.Set(Vt.Vec3fArray(len(points)), time)

    for name, seed in ((HAT, 1), ("/World/Prototypes/Flag/Cloth", 2)):
        one = mesh(name, seed)
        one.GetSubdivisionSchemeAttr().Set("catmullClark")
        mask = UsdGeom.PrimvarsAPI(one).CreatePrimvar(
            "known", Sdf.ValueTypeNames.BoolArray, "vertex"
        )
        for time, points, seen in zip(TIMES, *frames_of(seed), strict=True):
            points[~seen] = 0
            one.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points), time)
            mask.Set(Vt.BoolArray.FromNumpy(seen), time)
    stage.GetPrimAtPath("/World/Prototypes").SetSpecifier(Sdf.SpecifierClass)
    for name in ("First", "Second"):
        flag = UsdGeom.Xform.Define(stage, f"/World/Flags/{name}")
        flag.GetPrim().GetReferences().AddInternalReference("/World/Prototypes/Flag")
        flag.GetPrim().SetInstanceable(True)
        flag.AddTranslateOp().Set(Gf.Vec3d(0, 5, 0))
    mesh(STONE, 3).CreatePointsAttr(Vt.Vec3fArray.FromNumpy(frames_of(3)[0][0]))
    stage.GetRootLayer().Save()
    return path


def stage_of(path: Path) -> Any:
    stage = Usd.Stage.Open(str(path))
    assert stage.GetCompositionErrors() == []
    return stage


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
