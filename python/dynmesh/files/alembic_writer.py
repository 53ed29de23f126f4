"""Writes a mesh to an Alembic archive, below objects that have only a name."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..polygons import as_polygons
from .alembic_archive import (
    errors_of_key,
    library,
    library_array,
    parameters,
    translating,
    turned,
)
from .comments import comments_of
from .frame import Frame
from .header import Header
from .new_output import bytes_of
from .times import frame_seconds
from .writer import Writer

_ARRAYS = {"Uchar": "UnsignedChar", "Int32": "Int", "Float": "Float"}
"""The library's arrays, by the kind of geometry parameter."""


class AlembicWriter(Writer):
    """An archive that is being written; positions are rounded to float32."""

    keeps_float64 = False

    def _begin(self) -> None:
        self._archive: Any = None
        self._schema: Any = None
        self._parameters: dict[str, Any] = {}
        header, abc, geometry = self.header, library("Abc"), library("AbcGeom")
        # Not what the errors are of, which the parameter says.
        description = ", ".join(comments_of(replace(header, has_standard_error=False)))
        rate = () if header.fps is None else (header.fps,)
        path = str(self.folder / self.path.name)
        with Path(path).open("wb") as file:  # the library would end the process on a full disk
            os.posix_fallocate(file.fileno(), 0, bytes_of(header))
        with translating(OSError, "cannot be written"):
            self._archive = abc.CreateArchiveWithInfo(path, *rate, "dynmesh", description)
            parent = self._archive.getTop()
            *above, name = [part for part in (header.name or "").split("/") if part] or ["mesh"]
            for part in above:
                parent = geometry.OXform(parent, part)
            self._schema = geometry.OPolyMesh(parent, name).getSchema()
            sampling = int(self._archive.addTimeSampling(_times(header)))
            self._schema.setTimeSampling(sampling)
            for name in header.attributes:
                self._parameters[name] = self._parameter(name, sampling)

    def _parameter(self, name: str, sampling: int) -> Any:
        """Adds a geometry parameter with one value per vertex."""
        abc, geometry = library("Abc"), library("AbcGeom")
        metadata = library("AbcCoreAbstract").MetaData()
        if name == "standard_error":
            metadata.set(errors_of_key, self.header.standard_error_of)
        make = getattr(geometry, f"O{parameters[name]}GeomParam")
        compound, scope = self._schema.getArbGeomParams(), geometry.GeometryScope.kVertexScope
        # They refer to the values, which stay alive here.
        wrapped = abc.Argument(metadata), abc.Argument(sampling)
        return make(compound, name, False, scope, 1, *wrapped)

    def _append(self, frame: Frame) -> None:
        geometry = library("AbcGeom")
        arrays = [library_array("V3f", frame.points)]
        if self._frame == 0:
            faces = turned(as_polygons(self.header.faces, self.header.polygons))
            arrays += [library_array("Int", one) for one in (faces.corners, faces.sizes)]
        with translating(OSError, "cannot be written"):
            self._schema.set(geometry.OPolyMeshSchemaSample(*arrays))
            for name, parameter in self._parameters.items():
                sample = getattr(geometry, f"O{parameters[name]}GeomParamSample")
                array = library_array(_ARRAYS[parameters[name]], getattr(frame, name))
                parameter.set(sample(array, geometry.GeometryScope.kVertexScope))

    def _close(self) -> None:
        """Releases all objects, so that the library closes the archive."""
        self._parameters = {}
        self._archive = self._schema = None


def _times(header: Header) -> Any:
    """Returns the time sampling of the frames."""
    core, fps = library("AbcCoreAbstract"), header.fps or 1
    if header.times is None:
        return core.TimeSampling(1 / fps, header.start / fps)
    times = core.TimeVector()
    times[:] = frame_seconds(header).tolist()
    return core.TimeSampling(core.TimeSamplingType(core.AcyclicFlag.kAcyclic), times)
