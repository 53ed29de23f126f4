"""An Alembic archive as of a production: several meshes, transforms, and everything else."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import sheet
from stages import frames_of

alembic3d: Any = pytest.importorskip("alembic3d")
imath: Any = pytest.importorskip("imath")

FPS, START = 24.0, 1001
BODY, HAT, STONE = "/rig/body", "/hat", "/stone"
N_FRAMES = 6


def plain(value: Any) -> Any:
    """Returns a value of the library as numbers and texts that can be compared."""
    if "Array" not in type(value).__name__:
        return repr(value)
    if "tring" in type(value).__name__:
        return list(value)
    try:
        return np.array(value).tolist()
    except (TypeError, ValueError):
        return [repr(item) for item in value]


def content(path: Path) -> dict[str, Any]:
    """Everything that an archive holds, by the path of the object or the property."""
    abc = alembic3d.Abc
    archive = abc.IArchive(str(path))
    found: dict[str, Any] = {}

    def properties(compound: Any, inside: str) -> None:
        for header in compound.propertyheaders:
            name = f"{inside}/{header.getName()}"
            found[name] = [header.getMetaData().serialize()]
            if header.isCompound():
                properties(abc.ICompoundProperty(compound, header.getName()), name)
                continue
            kind = abc.IScalarProperty if header.isScalar() else abc.IArrayProperty
            one, kinds = kind(compound, header.getName()), header.getDataType()
            numbers = range(one.getNumSamples())
            found[name] += [str(kinds.getPod()), kinds.getExtent()]
            found[name].append([one.getTimeSampling().getSampleTime(n) for n in numbers])
            found[name].append([plain(one.getValue(n)) for n in numbers])

    def objects(one: Any) -> None:
        found[one.getFullName()] = (one.getMetaData().serialize(), one.instanceSourcePath())
        properties(one.getProperties(), f"{one.getFullName()}:")
        for number in range(one.getNumChildren()):
            objects(one.getChild(number))

    objects(archive.getTop())
    del found["/"]  # states when and by which program the archive was written
    return found


class Production:
    """Writes the archive."""

    def __init__(
        self,
        path: Path,
        *,
        normals: str = "kVertexScope",
        holes: bool = True,
        indexed: bool = False,
        first_frames_lack: str = "",
        n_others: int = 0,
    ) -> None:
        """Writes it at once.

        Args:
            path: of the archive.
            normals: the scope of the normals of the body.
            holes: whether meshes lack vertices after frame 0.
            indexed: whether they have indices.
            first_frames_lack: a mesh that lacks a vertex in frame 0 as well.
            n_others: number of further objects that move.
        """
        self._indexed = indexed
        self._broken = first_frames_lack
        self._holes = holes
        abc, core, self._geom = alembic3d.Abc, alembic3d.AbcCoreAbstract, alembic3d.AbcGeom
        geom = self._geom
        said = core.MetaData()
        said.set("FramesPerTimeUnit", f"{FPS:f}")
        argument = abc.Argument(said)
        archive = abc.CreateArchiveWithInfo(str(path), FPS, "Maker", "up_axis y", argument)
        self._times = archive.addTimeSampling(core.TimeSampling(1 / FPS, START / FPS))
        top = archive.getTop()
        rig = geom.OXform(top, "rig")
        self._move(rig)
        bounds = abc.OBox3dProperty(top.getProperties(), ".childBnds")
        bounds.setValue(imath.Box3d(imath.V3d(-9), imath.V3d(9)))
        body = self._mesh(rig, "body", 0, getattr(geom.GeometryScope, normals), velocities=True)
        schema = body.getSchema()
        colours = geom.OC3fGeomParam(
            schema.getArbGeomParams(), "Cd", True, geom.GeometryScope.kVertexScope, 1
        )
        palette = imath.C3fArray(2)
        colours.set(
            geom.OC3fGeomParamSample(
                palette, imath.UnsignedIntArray(25), geom.GeometryScope.kVertexScope
            )
        )
        names = imath.StringArray(2)
        names[0], names[1] = "left", "rechts ü"
        texts = geom.OStringGeomParam(
            schema.getArbGeomParams(), "names", False, geom.GeometryScope.kConstantScope, 1
        )
        texts.set(geom.OStringGeomParamSample(names, geom.GeometryScope.kConstantScope))
        abc.OStringProperty(schema.getUserProperties(), "asset").setValue("hero")
        skin = schema.createFaceSet("skin").getSchema()
        skin.set(geom.OFaceSetSchemaSample(self._integers([0, 1, 2])))
        geom.CreateVisibilityProperty(body, self._times).setValue(1)
        self._mesh(top, "hat", 1)
        self._mesh(top, "stone", 2, still=True)
        camera = geom.OCamera(top, "camera").getSchema()
        camera.set(geom.CameraSample())
        material = alembic3d.AbcMaterial.OMaterial(top, "paint").getSchema()
        material.setShader("prman", "surface", "plastic")
        shine = material.getShaderParameters("prman", "surface")
        abc.OFloatProperty(shine, "roughness").setValue(0.4)
        for number in range(n_others):
            self._move(geom.OXform(top, f"other{number}"))
        geom.OXform(top, "copies").addChildInstance(rig, "rig2")

    def _move(self, xform: Any) -> None:
        move = xform.getSchema()
        move.setTimeSampling(self._times)
        for number in range(N_FRAMES):
            sample = self._geom.XformSample()
            sample.setTranslation(imath.V3d(number, 2, 0))
            sample.setRotation(imath.V3d(0, 1, 0), 5.0 * number)
            sample.setScale(imath.V3d(1, 2, 1))
            move.set(sample)

    def _integers(self, values: Any) -> Any:
        return imath.IntArrayFromBuffer(np.ascontiguousarray(values, np.int32))

    def _vectors(self, values: Any) -> Any:
        return imath.V3fArrayFromBuffer(np.ascontiguousarray(values, np.float32))

    def _mesh(
        self,
        parent: Any,
        name: str,
        seed: int,
        normals: Any = None,
        *,
        velocities: bool = False,
        still: bool = False,
    ) -> Any:
        geom = self._geom
        faces = sheet(5).faces
        mesh = geom.OPolyMesh(parent, name)
        schema = mesh.getSchema()
        schema.setTimeSampling(self._times)
        truth, known = frames_of(seed)
        corners, sizes = self._integers(faces[:, ::-1].ravel()), self._integers([3] * len(faces))
        for points, seen in zip(truth[: 1 if still else None], known, strict=False):
            holes = np.where(seen[:, None], points, np.float32(np.nan)) if self._holes else points
            if parent.getFullName().rstrip("/") + "/" + name == self._broken:
                holes[3] = np.nan
            texture = imath.V2fArray(4)
            sample = geom.OPolyMeshSchemaSample(
                self._vectors(holes),
                corners,
                sizes,
                geom.OV2fGeomParamSample(
                    texture,
                    imath.UnsignedIntArray(3 * len(faces)),
                    geom.GeometryScope.kFacevaryingScope,
                ),
            )
            if normals is not None:
                of_corners = normals == geom.GeometryScope.kFacevaryingScope
                number = 3 * len(faces) if of_corners else len(points)
                up = np.tile(np.array([0, 0, 1], np.float32), (number, 1))
                if of_corners:  # an edge
                    up[::5] = (1, 0, 0)
                given = [self._vectors(up)]
                if self._indexed:
                    given = [self._vectors(up[:1]), imath.UnsignedIntArray(number)]
                sample.setNormals(geom.ON3fGeomParamSample(*given, normals))
            if velocities:
                sample.setVelocities(self._vectors(np.ones_like(points)))
            schema.set(sample)
        return mesh
