"""Alembic: the positions of one mesh in an Ogawa archive, with a sample for each frame.

Of the scene, only the mesh itself is read and written: its positions, in its own space, its faces
and its texture coordinates. Alembic's faces wind clockwise; they are reversed when read and
written. The known mask is the geometry parameter `known` (uint8, 0 and 1), and `generation` and
`age` (int32) are parameters as well, each with one value per vertex. The description of the archive
states the up axis and the length of a unit.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import of_library
from .._extras import require
from ..frame import Frame, Frames
from ..header import TEXTURE, Header
from ..polygons import as_polygons, reversal, turned
from .alembic_archive import (
    AlembicFrames,
    errors_of_key,
    library,
    meshes_in,
    moves,
    parameters_of,
)
from .comments import comments_of
from .format import (
    STATED,
    Format,
    not_written,
)
from .output import bytes_of
from .own_space import extent_of


def library_array(kind: str, values: NDArray[Any]) -> Any:
    """Returns a copy as an array of the library, which calls its type "V3f", "Int" and so on."""
    array = getattr(require("imath", extra="alembic"), f"{kind}Array")(len(values))
    np.asarray(array)[:] = values
    return array


_ARRAYS = {"Uchar": "UnsignedChar", "Int32": "Int", "Float": "Float"}
"""The library's arrays, by the kind of geometry parameter."""


def write_alembic(path: Path, header: Header, frames: Frames) -> list[str]:
    """Writes an archive; positions are rounded to float32."""
    with path.open("wb") as file:  # the library would end the process on a full disk
        if hasattr(os, "posix_fallocate"):  # not on macOS and Windows
            os.posix_fallocate(file.fileno(), 0, bytes_of(header))
    with of_library("cannot be written", OSError):
        archive, schema, parameters = _begin(path, header)
    try:
        for number, frame in enumerate(frames):
            with of_library("cannot be written", OSError):
                _append(schema, parameters, frames, number, frame)
    finally:  # the library closes the archive when all objects are released
        parameters.clear()
        del archive, schema
    return not_written(frames, () if frames.texture is None else (TEXTURE,))


def _begin(path: Path, header: Header) -> tuple[Any, Any, dict[str, Any]]:
    """Creates an archive, the schema of its mesh, and the parameters of its vertices."""
    abc, geometry = library("Abc"), library("AbcGeom")
    # Not what the errors are of, which the parameter says.
    description = ", ".join(comments_of(header, errors=False))
    rate = () if header.fps is None else (header.fps,)
    archive = abc.CreateArchiveWithInfo(str(path), *rate, "dynmesh", description)
    parent = archive.getTop()
    *above, name = [part for part in (header.name or "").split("/") if part] or ["mesh"]
    for part in above:
        parent = geometry.OXform(parent, part)
    schema = geometry.OPolyMesh(parent, name).getSchema()
    sampling = int(archive.addTimeSampling(_times(header)))
    schema.setTimeSampling(sampling)
    return (
        archive,
        schema,
        {name: _parameter(schema, header, name, sampling) for name in header.attributes},
    )


def _parameter(schema: Any, header: Header, name: str, sampling: int) -> Any:
    """Adds a geometry parameter with one value per vertex."""
    abc, geometry = library("Abc"), library("AbcGeom")
    metadata = library("AbcCoreAbstract").MetaData()
    if name == "standard_error":
        metadata.set(errors_of_key, header.standard_error_of)
    make = getattr(geometry, f"O{parameters_of[name]}GeomParam")
    compound, scope = schema.getArbGeomParams(), geometry.GeometryScope.kVertexScope
    # They refer to the values, which stay alive here.
    wrapped = abc.Argument(metadata), abc.Argument(sampling)
    return make(compound, name, False, scope, 1, *wrapped)


def _append(
    schema: Any, parameters: dict[str, Any], frames: Frames, number: int, frame: Frame
) -> None:
    header, geometry = frames.header, library("AbcGeom")
    arrays = [library_array("V3f", frame.points)]
    if number == 0:
        faces = as_polygons(header.faces, header.polygons)
        places, faces = reversal(faces.sizes), turned(faces)
        arrays += [library_array("Int", one) for one in (faces.corners, faces.sizes)]
    sample = geometry.OPolyMeshSchemaSample(*arrays)
    imath = require("imath", extra="alembic")
    low, high = (imath.V3d(*corner) for corner in extent_of(frame).tolist())
    sample.setSelfBounds(imath.Box3d(low, high))  # which would count unknown points, too
    if number == 0 and frames.texture is not None:
        texture = library_array("V2f", frames.texture[places])
        scope = geometry.GeometryScope.kFacevaryingScope
        sample.setUVs(geometry.OV2fGeomParamSample(texture, scope))
    schema.set(sample)
    for name, parameter in parameters.items():
        kind = getattr(geometry, f"O{parameters_of[name]}GeomParamSample")
        array = library_array(_ARRAYS[parameters_of[name]], getattr(frame, name))
        parameter.set(kind(array, geometry.GeometryScope.kVertexScope))


def _times(header: Header) -> Any:
    """Returns the time sampling of the frames."""
    core, fps = library("AbcCoreAbstract"), header.fps or 1
    if header.times is None:
        return core.TimeSampling(1 / fps, header.start / fps)
    times = core.TimeVector()
    times[:] = (header.numbers / fps).tolist()
    return core.TimeSampling(core.TimeSamplingType(core.AcyclicFlag.kAcyclic), times)


alembic = Format(
    "alembic",
    (".abc",),
    AlembicFrames,
    write_alembic,
    frozenset({"known", "provenance", "texture", *STATED}) - {"subdivision"},
    frozenset({"prim"}),
    library=("alembic3d", "alembic"),
    meshes=lambda path: moves(meshes_in(path)[1]),
)
