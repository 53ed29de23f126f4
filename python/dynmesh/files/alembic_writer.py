"""Writes a mesh to an Alembic archive, below objects that have only a name."""

from dataclasses import replace
from typing import Any

from ..polygons import as_polygons
from .alembic_archive import errors_of_key, library, library_array, parameters, turned
from .alembic_output import OutputArchive
from .comments import comments_of
from .frame import Frame
from .header import Header
from .times import frame_seconds
from .writer import Writer

_ARRAYS = {"Uchar": "UnsignedChar", "Int32": "Int", "Float": "Float"}
"""The library's arrays, by the kind of geometry parameter."""


class AlembicWriter(Writer):
    """An archive that is being written; positions are rounded to float32."""

    keeps_float64 = False

    def _begin(self) -> None:
        self._output: OutputArchive | None = None
        self._schema: Any = None
        self._parameters: dict[str, Any] = {}
        header, geometry = self.header, library("AbcGeom")
        # Not what the errors are of, which the parameter says.
        description = ", ".join(comments_of(replace(header, has_standard_error=False)))
        output = OutputArchive(self.folder / self.path.name, header.fps, description)
        self._output = output
        parent = output.top
        *above, name = [part for part in (header.name or "").split("/") if part] or ["mesh"]
        for part in above:
            parent = output.make("OXform", parent, part)
        self._schema = output.make("OPolyMesh", parent, name).getSchema()
        sampling = output.sampling(_times(header))
        self._schema.setTimeSampling(sampling)
        for name in header.attributes:
            metadata = library("AbcCoreAbstract").MetaData()
            if name == "standard_error":
                metadata.set(errors_of_key, header.standard_error_of)
            self._parameters[name] = output.parameter(
                f"O{parameters[name]}GeomParam",
                self._schema.getArbGeomParams(),
                name,
                geometry.GeometryScope.kVertexScope,
                metadata,
                sampling,
            )

    def _append(self, frame: Frame) -> None:
        output, geometry = self._output, library("AbcGeom")
        assert output is not None
        arrays = [library_array("V3f", frame.points)]
        size = 12 * len(frame.points)
        if self._frame == 0:
            faces = turned(as_polygons(self.header.faces, self.header.polygons))
            arrays += [library_array("Int", one) for one in (faces.corners, faces.sizes)]
            size += 4 * (len(faces.corners) + len(faces.sizes))
        output.set(self._schema, geometry.OPolyMeshSchemaSample(*arrays), size)
        for name, parameter in self._parameters.items():
            values = getattr(frame, name)
            sample = getattr(geometry, f"O{parameters[name]}GeomParamSample")
            array = library_array(_ARRAYS[parameters[name]], values)
            scope = geometry.GeometryScope.kVertexScope
            output.set(parameter, sample(array, scope), 4 * len(values))

    def _finish(self) -> None:
        assert self._output is not None
        self._release()
        self._output.finish()

    def _close(self) -> None:
        self._release()
        if self._output is not None:
            self._output.abandon()

    def _release(self) -> None:
        """Releases all objects, so that the library can close the archive."""
        self._schema = None
        self._parameters = {}


def _times(header: Header) -> Any:
    """Returns the time sampling of the frames."""
    core, fps = library("AbcCoreAbstract"), header.fps or 1
    if header.times is None:
        return core.TimeSampling(1 / fps, header.start / fps)
    times = core.TimeVector()
    times[:] = frame_seconds(header).tolist()
    return core.TimeSampling(core.TimeSamplingType(core.AcyclicFlag.kAcyclic), times)
