"""Alembic: the positions of one mesh in an Ogawa archive, with a sample for each frame.

Of the scene, only the mesh itself is read and written: its positions, in its own space, its faces
and its texture coordinates. Alembic's faces wind clockwise; they are reversed when read and
written. The known mask is the geometry parameter `known` (uint8, 0 and 1), and `generation` and
`age` (int32) are parameters as well, each with one value per vertex. The description of the archive
states the up axis and the length of a unit.
"""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, of_library, require
from ..frame import Frame, Frames, Indices
from ..header import ATTRIBUTES, TEXTURE, Header, Origin, with_all_needed
from ..polygons import Polygons, as_polygons, reversal, split_polygons, turned
from ..stored import FileFrames
from .format import (
    OTHER_MESHES,
    STATED,
    Format,
    Gaps,
    check_same_faces,
    choose_mesh,
    extent_of,
    not_read,
    not_written,
    of_points,
)
from .output import bytes_of
from .text import comments_of, metadata_in
from .times import Timing, broadcast, frame_number, listed_times, spacing

_KINDS = {"b": "Uchar", "i": "Int32", "f": "Float"}

parameters_of = {name: _KINDS[row.dtype.kind] for name, row in ATTRIBUTES.items()}
"""The data of a vertex besides its position, and the kind of geometry parameter that holds it."""

errors_of_key = "standard_error_of"
"""Of the metadata of the parameter `standard_error`."""

_TRIED = "cannot be read as Alembic"


def meshes_in(path: Path) -> tuple[Any, dict[str, Any]]:
    """Opens an archive; returns it and its meshes by path, without copies by reference."""
    with path.open("rb") as file:  # gives the error message of the system
        if file.read(4) == b"\x89HDF":
            message = (
                "is an Alembic archive in HDF5; write it as Ogawa, as abcconvert -toOgawa does"
            )
            raise InputError(message)
    with of_library(_TRIED):
        archive = library("Abc").IArchive(str(path))
        return archive, {mesh.getFullName(): mesh for mesh in _meshes(archive.getTop())}


def moves(meshes: Mapping[str, Any]) -> dict[str, bool]:
    """Whether the positions of each mesh change."""
    positions = {name: mesh.getSchema().getPositionsProperty() for name, mesh in meshes.items()}
    return {name: not of_mesh.isConstant() for name, of_mesh in positions.items()}


def transforms_above(archive: Any, mesh: Any) -> Iterator[Any]:
    """Yields the schemas of the transforms above a mesh."""
    kind, parent = library("AbcGeom").IXform, archive.getTop()
    for name in mesh.getFullName().split("/")[1:-1]:
        child = parent.getChild(name)
        if kind.matches(child.getHeader()):
            yield kind(parent, name).getSchema()
        parent = child


def _to_scene(transforms: Iterable[Any], time: float) -> NDArray[np.float64]:
    """Returns what takes directions in the mesh to the scene at a time, in seconds."""
    result, at = np.eye(3), library("Abc").ISampleSelector(time)
    for one in transforms:  # from the top
        sample = one.getValue(at)
        matrix = np.array(sample.getMatrix()).reshape(4, 4)[:3, :3]
        result = matrix @ result if sample.getInheritsXforms() else matrix
    return result


def held_beside(archive: Any, meshes: Mapping[str, Any], mesh: Any) -> set[str]:
    """What an archive holds around a mesh that is not read, in words."""
    schema, held = mesh.getSchema(), set()
    if any(one.getNumOps() for one in transforms_above(archive, mesh)):
        held.add("transforms")
    if schema.getUVsParam().valid():
        held.add(TEXTURE)
    if hasattr(schema, "getNormalsParam") and schema.getNormalsParam().valid():
        held.add("normals")
    if len(schema.getFaceSetNames()):
        held.add("subsets")
    compound = schema.getArbGeomParams()
    names = {one.getName() for one in compound.propertyheaders} if compound.valid() else set()
    if hasattr(schema, "getSubdivisionSchemeProperty"):
        held.add("subdivision")
    if len(meshes) > 1:
        held.add("other meshes")
    if any(_others(archive.getTop())):
        held.add("other objects")
    return held | (names - {*parameters_of})


def texture_of(mesh: Any, polygons: Polygons) -> NDArray[np.float32] | None:
    """Returns (c, 2) the texture coordinates of each corner of turned polygons.

    None if there are none that are the same at all times, for each corner or vertex, and fit.
    """
    parameter, scope = mesh.getSchema().getUVsParam(), library("AbcGeom").GeometryScope
    if not parameter.valid() or not parameter.isConstant():
        return None
    places = {
        scope.kFacevaryingScope: reversal(polygons.sizes),
        scope.kVertexScope: polygons.corners,
        scope.kVaryingScope: polygons.corners,
    }.get(parameter.getScope())
    values = np.array(parameter.getExpandedValue(0).getVals(), np.float32)
    fits = places is not None and len(values) > places.max(initial=-1)
    return values[places] if fits else None


def _meshes(parent: Any) -> Iterator[Any]:
    """Yields all meshes; copies by reference have the path of the mesh that they copy."""
    geometry = library("AbcGeom")
    for child in parent.children:
        for kind in (geometry.IPolyMesh, geometry.ISubD):
            if kind.matches(child.getHeader()):
                yield kind(parent, child.getName())
        yield from _meshes(child)


def _others(parent: Any) -> Iterator[Any]:
    """Yields what is neither a mesh nor a transform, such as a camera."""
    geometry = library("AbcGeom")
    kinds = (geometry.IXform, geometry.IPolyMesh, geometry.ISubD, geometry.IFaceSet)
    for child in parent.children:
        if not any(kind.matches(child.getHeader()) for kind in kinds):
            yield child
        yield from _others(child)


def faces_of(mesh: Any, samples: Sequence[int]) -> Polygons:
    """Returns the faces as they are, clockwise; they must be the same in all these samples."""
    schema = mesh.getSchema()
    properties = (schema.getFaceCountsProperty(), schema.getFaceIndicesProperty())

    def faces_at(number: int) -> Polygons:
        return Polygons(*(np.array(one.getValue(number), np.int32) for one in properties))

    first, *later = samples
    faces = faces_at(first)
    if not all(one.isConstant() for one in properties):
        for number in later:
            check_same_faces(faces, faces_at(number), f"frame {number}")
    return faces


def timing_of(archive: Any, positions: Any) -> Timing:
    """Returns the frames per second, if the archive states them, and the numbers of the frames."""
    sampling = positions.getTimeSampling()
    kind = sampling.getTimeSamplingType()
    times = [float(sampling.getSampleTime(n)) for n in range(positions.getNumSamples())]
    step = kind.getTimePerCycle() if kind.isUniform() else spacing(times)
    metadata = library("Abc").GetArchiveInfo(archive).get("dccFPS")  # has only six decimals
    rate = next((fps for fps in broadcast if round(fps, 6) == metadata), metadata or None)
    if len(times) > 1 and not kind.isUniform() and (rate or step is None or step > 1):
        return listed_times(times, rate)
    fps = 1 / step if step else rate
    if step == 1 and (times[0] == 0 or rate is None):
        fps = rate
    return Timing(fps, frame_number(times[0], fps))


def library(name: str) -> Any:
    """Returns a module of the library."""
    return getattr(require("alembic3d", extra="alembic"), name)


class AlembicFrames(FileFrames):
    """The frames of a mesh, which are the samples of its positions.

    Alembic stores the time of every sample; by default, samples are one second apart. If they are
    and the archive does not hold the rate of the program that wrote it, `fps` is None and the times
    are the numbers of the frames. If samples are not evenly spaced, frames are counted at that rate
    or, without it, at the median rate of the samples.
    """

    def __init__(self, path: Path, prim: str | Iterable[str] | None, gaps: Gaps = "refuse") -> None:
        archive, meshes = meshes_in(path)
        with of_library(_TRIED):
            mesh = meshes[choose_mesh(moves(meshes), prim)]
            self._positions = mesh.getSchema().getPositionsProperty()
            header, origin = self._described(path, archive, meshes, mesh)
            empty = frozenset(range(header.n_frames)) - {*self._samples}
            lost = empty if gaps == "lost" else ()
            super().__init__(path, header, lost=lost, origin=origin)

    def _described(
        self, path: Path, archive: Any, meshes: Mapping[str, Any], mesh: Any
    ) -> tuple[Header, Origin | None]:
        n_frames = self._positions.getNumSamples()
        sizes = [self._positions.getDimension(number).numPoints() for number in range(n_frames)]
        self._samples = [number for number, size in enumerate(sizes) if size]
        if not self._samples:
            raise InputError("the mesh has no positions")
        as_stored = turned(faces_of(mesh, self._samples))
        faces, polygons = split_polygons(as_stored)
        self._parameters = _parameters(mesh.getSchema(), n_frames)
        bars = self._parameters.get("standard_error")
        errors = None if bars is None else bars.getMetaData().get(errors_of_key)
        info = library("Abc").GetArchiveInfo(archive)
        metadata = metadata_in(info.get("userDescription", "").split(","))
        transforms = [*transforms_above(archive, mesh)]
        is_still = all(one.isConstant() for one in transforms)
        times = map(self._positions.getTimeSampling().getSampleTime, range(n_frames))
        up_axis, metres_per_unit, unknown = of_points(
            metadata.up_axis,
            metadata.metres_per_unit,
            (_to_scene(transforms, time) for time in ([0.0] if is_still else times)),
        )
        header = Header(
            faces=faces,
            n_frames=n_frames,
            n_vertices=sizes[self._samples[0]],
            dtype=np.dtype(np.float32),
            polygons=polygons,
            name=mesh.getFullName(),
            up_axis=up_axis,
            metres_per_unit=metres_per_unit,
            **timing_of(archive, self._positions)._asdict(),
            attributes=self._parameters,
            standard_error_of=errors or "position",
        )
        return header, Origin.of(
            path,
            header,
            held_beside(archive, meshes, mesh),
            name=mesh.getFullName(),
            remarks=not_read(() if is_still else ("transforms",), unknown),
            texture=texture_of(mesh, as_stored),
        )

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        for number in numbers:
            if number in self.lost:
                yield self._lost_frame()
                continue
            with of_library(f"frame {self.header.number(number)}: {_TRIED}"):
                points = self._checked("positions", number, self._positions.getValue(number))
                values = {
                    name: self._checked(name, number, parameter.getExpandedValue(number).getVals())
                    for name, parameter in self._parameters.items()
                }
            yield Frame(points, **values)

    def _checked(self, name: str, number: int, values: Any) -> NDArray[Any]:
        if number not in self._samples:
            message = "the sample is empty; with `gaps` lost, nothing was observed in such frames"
            raise InputError(message, frame=self.header.number(number))
        if len(values) != self.n_vertices:
            raise InputError(
                f"{name} has {len(values)} values, "
                f"but the mesh has {self.n_vertices} vertices in its first frame; {OTHER_MESHES}",
                frame=self.header.number(number),
            )
        return np.array(values)

    def _close(self) -> None:
        self._positions = None
        self._parameters = {}


def _parameters(schema: Any, n_frames: int) -> dict[str, Any]:
    """Returns the geometry parameters that exist; generation and age only together."""
    geometry = library("AbcGeom")
    compound = schema.getArbGeomParams()
    headers = {h.getName(): h for h in compound.propertyheaders} if compound.valid() else {}
    result = {}
    for name in with_all_needed(headers):
        parameter = getattr(geometry, f"I{parameters_of[name]}GeomParam")
        if not parameter.matches(headers[name]):
            kind = parameters_of[name].lower()
            raise InputError(f"must be a geometry parameter of type {kind}", argument=name)
        result[name] = parameter(compound, name)
        if result[name].getScope() != geometry.GeometryScope.kVertexScope:
            raise InputError("must have one value per vertex", argument=name)
        if result[name].getNumSamples() not in (1, n_frames):
            raise InputError(
                f"has {result[name].getNumSamples()} samples for {n_frames} frames", argument=name
            )
    return result


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
    frozenset({"prim", "gaps"}),
    library=("alembic3d", "alembic"),
    meshes=lambda path: moves(meshes_in(path)[1]),
)
