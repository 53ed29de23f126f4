"""Writes a mesh to an Alembic archive, alone or in the scene that it comes from."""

from dataclasses import replace
from typing import Any, cast

from ..frames.frame import Frame
from ..frames.header import Header
from ..frames.scenes import Origin
from ..frames.times import frame_seconds
from ..polygons import as_polygons
from .alembic_archive import (
    AlembicScene,
    errors_of_key,
    library,
    library_array,
    parameters,
    timing_of,
    translating,
    turned,
)
from .alembic_copy import SceneCopy
from .alembic_output import OutputArchive, metadata_of
from .alembic_replaced import ReplacedMesh
from .comments import comments_of, metadata_in
from .writer import Writer

_ARRAYS = {"Uchar": "UnsignedChar", "Int32": "Int", "Float": "Float"}
"""The library's arrays, by the kind of geometry parameter."""


class AlembicWriter(Writer):
    """An archive that is being written; positions are rounded to float32.

    With an origin, the archive has its scene, in which only the written mesh changes. If the
    header has other frames per second than the mesh in the scene, all times of the scene change
    alike.

    An unfinished archive cannot be continued, since its index is written at its end.
    """

    keeps_float64 = False
    keeps_scene_of = "alembic"

    def _begin(self, kept: int) -> None:  # noqa: ARG002 (always 0, as it is not resumable)
        self._output: OutputArchive | None = None
        self._copy: SceneCopy | None = None
        self._mesh: _NewMesh | ReplacedMesh | None = None
        self._parameters: dict[str, Any] = {}
        if self.origin is None:
            # Not what the parameters say: the description stays when other meshes replace this one.
            described = replace(self.header, has_standard_error=False)
            metadata = ", ".join(comments_of(described))
            self._output = OutputArchive(self.folder / self.path.name, self.header.fps, metadata)
        else:
            self._begin_scene(self.origin)
        self._begin_mesh()

    def _begin_scene(self, origin: Origin) -> None:
        scene = cast(AlembicScene, origin.scene)
        fps, archive = self.header.fps, scene.archive
        positions = scene.mesh(self.header.name).getSchema().getPositionsProperty()
        pace = (timing_of(archive, positions).fps or 1) / (fps or 1)
        info = library("Abc").GetArchiveInfo(archive)
        metadata = metadata_of(archive.getTop())
        if pace != 1 and metadata.get("FramesPerTimeUnit"):
            metadata.set("FramesPerTimeUnit", f"{fps or 1:f}")
        self._output = OutputArchive(
            self.folder / self.path.name,
            info.get("dccFPS") if pace == 1 else fps,
            _described(info.get("userDescription", ""), self.header),
            metadata,
        )
        self._copy = SceneCopy(scene, (origin.mesh,), self._output, pace)

    def _begin_mesh(self) -> None:
        header, output = self.header, self._output
        assert output is not None
        self._mesh, self._parameters = None, {}
        mesh: _NewMesh | ReplacedMesh
        if self._copy is None:
            mesh = _NewMesh(header, output)
        else:
            scene = self._copy.scene
            with translating(ValueError, f"{scene.path}: is damaged"):
                mesh = ReplacedMesh(scene, header, self._copy, output)
            self.remarks += mesh.remarks
        for name in header.attributes:
            metadata = library("AbcCoreAbstract").MetaData()
            if name == "standard_error":
                metadata.set(errors_of_key, header.standard_error_of)
            self._parameters[name] = output.property(
                f"O{parameters[name]}GeomParam",
                mesh.parameters(),
                name,
                False,
                library("AbcGeom").GeometryScope.kVertexScope,
                1,
                metadata=metadata,
                sampling=mesh.sampling,
            )
        self._mesh = mesh

    def _append(self, frame: Frame) -> None:
        output, geometry = self._output, library("AbcGeom")
        assert output is not None
        assert self._mesh is not None
        self._mesh.append(frame)
        for name, parameter in self._parameters.items():
            values = getattr(frame, name)
            sample = getattr(geometry, f"O{parameters[name]}GeomParamSample")
            array = library_array(_ARRAYS[parameters[name]], values)
            scope = geometry.GeometryScope.kVertexScope
            output.set(parameter, sample(array, scope), 4 * len(values))
        if self._copy is not None:
            self._copy.copy_share((self._frame + 1) / self.header.n_frames)

    def _finish(self) -> None:
        assert self._output is not None
        if self._copy is not None:
            self._copy.copy_rest()
            if self._copy.dropped:
                self.remarks.append(
                    "not copied, since the library cannot write such values: "
                    + ", ".join(self._copy.dropped)
                )
        self._release()
        self._output.finish()

    def _close(self) -> None:
        self._release()
        if self._output is not None:
            self._output.abandon()

    def _release(self) -> None:
        """Releases all objects, so that the library can close the archive."""
        if self._copy is not None:
            self._copy.close()
        self._copy = self._mesh = None
        self._parameters = {}


class _NewMesh:
    """A mesh below objects that have only a name."""

    def __init__(self, header: Header, output: OutputArchive) -> None:
        """Creates the mesh and the objects above it."""
        self._faces = turned(as_polygons(header.faces, header.polygons))
        self._output = output
        self._is_first = True
        parent = output.top
        *above, name = [part for part in (header.name or "").split("/") if part] or ["mesh"]
        for part in above:
            parent = output.make("OXform", parent, part)
        self._schema = output.make("OPolyMesh", parent, name).getSchema()
        self.sampling = output.sampling(_times(header))
        self._schema.setTimeSampling(self.sampling)

    def parameters(self) -> Any:
        """Returns the compound property for geometry parameters."""
        return self._schema.getArbGeomParams()

    def append(self, frame: Frame) -> None:
        """Adds the positions of the next frame."""
        arrays = [library_array("V3f", frame.points)]
        size = 12 * len(frame.points)
        if self._is_first:
            faces = (self._faces.corners, self._faces.sizes)
            arrays += [library_array("Int", one) for one in faces]
            size += 4 * sum(map(len, faces))
            self._is_first = False
        sample = library("AbcGeom").OPolyMeshSchemaSample(*arrays)
        self._output.set(self._schema, sample, size)


def _described(description: str, header: Header) -> str:
    """The description of an archive, with what the header says of axis and unit beyond it."""
    told = metadata_in(description.split(","))
    lines = comments_of(replace(header, has_standard_error=False))
    more = [line for line in lines if getattr(told, line.split()[0]) is None]
    return ", ".join([*([description] if description else []), *more])


def _times(header: Header) -> Any:
    """Returns the time sampling of the frames."""
    core, fps = library("AbcCoreAbstract"), header.fps or 1
    if header.times is None:
        return core.TimeSampling(1 / fps, header.start / fps)
    times = core.TimeVector()
    times[:] = frame_seconds(header).tolist()
    return core.TimeSampling(core.TimeSamplingType(core.AcyclicFlag.kAcyclic), times)
