"""Alembic: the positions of one PolyMesh in an Ogawa archive, with a sample for each frame.

Of the scene, only the mesh itself is read: its positions, in its own space, and its faces.
Alembic's faces wind clockwise; they are reversed when read and written. The known mask is the
geometry parameter `known` (uint8, 0 and 1), and `generation` and `age` (int32) are parameters as
well, each with one value per vertex. The description of the archive states the up axis and the
length of a unit.
"""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError
from .._extras import require
from ..polygons import Polygons, as_polygons, check_polygons, split_polygons
from .comments import comments_of, said_in
from .format import Format, Template, refuse_template
from .header import Frame, Header
from .reader import Reader
from .scenes import check_same_faces, choose_mesh
from .times import Timing, broadcast, frame_number, frame_seconds, spacing, uneven
from .writer import Writer

parameters = {"known": "Uchar", "generation": "Int32", "age": "Int32"}
"""The data of a vertex besides its position, and the kind of geometry parameter that holds it."""


class AlembicReader(Reader):
    """The frames of a mesh, which are the samples of its positions.

    Alembic stores the time of every sample; by default, samples are one second apart. If they are
    and the archive does not hold the rate of the program that wrote it, `fps` is None and the times
    are the numbers of the frames. If samples are not evenly spaced, frames are counted at that rate
    or, without it, at the median rate of the samples.
    """

    def __init__(self, path: Path, template: Template | None, prim: str | None) -> None:
        """Opens the archive and reads everything except the frames."""
        refuse_template(template)
        with path.open("rb") as file:  # gives the error message of the system
            if file.read(8) == b"\x89HDF\r\n\x1a\n":
                raise ValueError(
                    "is an Alembic archive of the old kind, in HDF5; convert it with Alembic's "
                    "program abcconvert: abcconvert -toOgawa OLD NEW"
                )
        with _translating(ValueError, "is damaged or not an Alembic archive"):
            self._archive = _alembic("Abc").IArchive(str(path))
            self._mesh = _mesh(self._archive, prim)
            self._positions = self._mesh.getSchema().getPositionsProperty()
            super().__init__(path, self._header())

    def _header(self) -> Header:
        n_frames = self._positions.getNumSamples()
        if n_frames == 0:
            raise ValueError("the mesh has no positions")
        faces, polygons = split_polygons(_turned(_faces(self._mesh)))
        self._parameters = _parameters(self._mesh.getSchema(), n_frames)
        info = _alembic("Abc").GetArchiveInfo(self._archive)
        return Header(
            faces=faces,
            n_frames=n_frames,
            n_vertices=len(self._positions.getValue(0)),
            dtype=np.dtype(np.float32),
            polygons=polygons,
            name=self._mesh.getFullName(),
            **said_in(info.get("userDescription", "").split(","))._asdict(),
            **_timing(self._archive, self._positions)._asdict(),
            has_known="known" in self._parameters,
            has_provenance="age" in self._parameters,
        )

    def _frames(self, numbers: range) -> Iterator[Frame]:
        for number in numbers:
            with _translating(ValueError, f"frame {number}: is damaged"):
                points = self._checked("positions", number, self._positions.getValue(number))
                values = {
                    name: self._checked(name, number, parameter.getExpandedValue(number).getVals())
                    for name, parameter in self._parameters.items()
                }
            if "known" in values:
                if (values["known"] > 1).any():
                    raise InputError("known must hold only 0 and 1", frame=number)
                values["known"] = values["known"].astype(np.bool_)
            yield Frame(points, **values)

    def _checked(self, name: str, number: int, values: Any) -> NDArray[Any]:
        if len(values) != self.n_vertices:
            raise InputError(
                f"{name} has {len(values)} values, "
                f"but the mesh has {self.n_vertices} vertices in its first frame",
                frame=number,
            )
        return np.array(values)

    def close(self) -> None:
        """Closes the archive."""
        self._archive = self._mesh = self._positions = None
        self._parameters = {}


def _mesh(archive: Any, prim: str | None) -> Any:
    meshes = {mesh.getFullName(): mesh for mesh in _meshes(archive.getTop())}
    moving = {
        path: not mesh.getSchema().getPositionsProperty().isConstant()
        for path, mesh in meshes.items()
    }
    return meshes[choose_mesh(moving, prim)]


def _meshes(parent: Any) -> Iterator[Any]:
    kind = _alembic("AbcGeom").IPolyMesh
    for child in parent.children:
        if kind.matches(child.getHeader()):
            yield kind(parent, child.getName())
        yield from _meshes(child)


def _faces(mesh: Any) -> Polygons:
    schema = mesh.getSchema()
    properties = (schema.getFaceCountsProperty(), schema.getFaceIndicesProperty())
    faces = _faces_at(properties, 0)
    if not all(one.isConstant() for one in properties):
        for number in range(1, schema.getNumSamples()):
            time = schema.getTimeSampling().getSampleTime(number)
            check_same_faces(faces, _faces_at(properties, number), time)
    return faces


def _faces_at(properties: tuple[Any, Any], number: int) -> Polygons:
    return Polygons(*(np.array(one.getValue(number), np.int32) for one in properties))


def _turned(polygons: Polygons) -> Polygons:
    """Returns the polygons with the corners in reverse order."""
    check_polygons(polygons)
    ends = np.cumsum(polygons.sizes)
    last = np.repeat(2 * ends - polygons.sizes - 1, polygons.sizes)
    return Polygons(polygons.sizes, polygons.corners[last - np.arange(len(last))])


def _timing(archive: Any, positions: Any) -> Timing:
    """Returns the frames per second, if the archive states them, and the numbers of the frames."""
    sampling = positions.getTimeSampling()
    kind = sampling.getTimeSamplingType()
    times = [sampling.getSampleTime(i) for i in range(positions.getNumSamples())]
    step = kind.getTimePerCycle() if kind.isUniform() else spacing(times)
    said = _alembic("Abc").GetArchiveInfo(archive).get("dccFPS")  # has only six decimals
    rate = next((fps for fps in broadcast if round(fps, 6) == said), said or None)
    if step is None and len(times) > 1:
        return uneven(times, rate)
    fps = 1 / step if step else rate
    if step == 1 and (times[0] == 0 or rate is None):
        fps = rate
    return Timing(fps, frame_number(times[0], fps))


def _parameters(schema: Any, n_frames: int) -> dict[str, Any]:
    """Returns the geometry parameters that exist; generation and age only together."""
    geometry = _alembic("AbcGeom")
    compound = schema.getArbGeomParams()
    headers = {h.getName(): h for h in compound.propertyheaders} if compound.valid() else {}
    found = {}
    for name, kind in parameters.items():
        if name not in headers or (name != "known" and not {"generation", "age"} <= set(headers)):
            continue
        parameter = getattr(geometry, f"I{kind}GeomParam")
        if not parameter.matches(headers[name]):
            raise InputError(f"must be a geometry parameter of type {kind.lower()}", argument=name)
        found[name] = parameter(compound, name)
        if found[name].getScope() != geometry.GeometryScope.kVertexScope:
            raise InputError("must have one value per vertex", argument=name)
        if found[name].getNumSamples() not in (1, n_frames):
            raise InputError(
                f"has {found[name].getNumSamples()} samples for {n_frames} frames", argument=name
            )
    return found


class AlembicWriter(Writer):
    """An archive with one mesh that is being written; positions are rounded to float32.

    An unfinished archive cannot be continued, since its index is written at its end.
    """

    keeps_float64 = False

    def _begin(self, kept: int) -> None:  # noqa: ARG002 (always 0, as it is not resumable)
        header = self.header
        self._archive = None
        self._file = (self.folder / self.path.name).open("w+b")
        self._reserve(header.faces.nbytes)
        with _translating(OSError, "cannot be written"):
            self._create()

    def _create(self) -> None:
        abc, core, geometry = _alembic("Abc"), _alembic("AbcCoreAbstract"), _alembic("AbcGeom")
        header = self.header
        rate = () if header.fps is None else (header.fps,)
        description = ", ".join(comments_of(header))
        self._archive = abc.CreateArchiveWithInfo(self._file.name, *rate, "dynmesh", description)
        sampling = self._archive.addTimeSampling(self._times(core))
        *parents, name = [part for part in (header.name or "").split("/") if part] or ["mesh"]
        parent = self._archive.getTop()
        for above in parents:
            parent = geometry.OXform(parent, above)
        self._schema = geometry.OPolyMesh(parent, name).getSchema()
        self._schema.setTimeSampling(sampling)
        self._parameters = {}
        names = ["known"] * header.has_known + ["generation", "age"] * header.has_provenance
        for name in names:
            parameter = getattr(geometry, f"O{parameters[name]}GeomParam")(
                self._schema.getArbGeomParams(), name, False, geometry.GeometryScope.kVertexScope, 1
            )
            parameter.setTimeSampling(sampling)
            self._parameters[name] = parameter

    def _times(self, core: Any) -> Any:
        fps = self.header.fps or 1
        if self.header.times is None:
            return core.TimeSampling(1 / fps, self.header.start / fps)
        times = core.TimeVector()
        times[:] = frame_seconds(self.header).tolist()
        return core.TimeSampling(core.TimeSamplingType(core.AcyclicFlag.kAcyclic), times)

    def _append(self, frame: Frame) -> None:
        imath, geometry = require("imath", extra="alembic"), _alembic("AbcGeom")
        arrays = [imath.V3fArrayFromBuffer(frame.points)]
        if self._frame == 0:
            polygons = _turned(as_polygons(self.header.faces, self.header.polygons))
            arrays += [_integers(polygons.corners), _integers(polygons.sizes)]
        self._reserve(21 * len(frame.points))
        with _translating(OSError, "cannot be written"):
            self._schema.set(geometry.OPolyMeshSchemaSample(*arrays))
            for name, parameter in self._parameters.items():
                values = getattr(frame, name)
                sample = getattr(geometry, f"O{parameters[name]}GeomParamSample")
                array = _bytes(values) if name == "known" else _integers(values)
                parameter.set(sample(array, geometry.GeometryScope.kVertexScope))

    def _reserve(self, size: int) -> None:
        """Raises OSError if the disk has no room for this many bytes and the end of the archive.

        If the system refuses a write while Alembic closes an archive, the process ends.
        """
        file = self._file.fileno()
        end = os.fstat(file).st_size
        try:
            os.posix_fallocate(file, end, size + (1 << 16) + 512 * self.header.n_frames)
        finally:
            os.ftruncate(file, end)

    def _finish(self) -> None:
        self._reserve(0)
        self._release()
        self._file.close()

    def _close(self) -> None:
        if self._archive is not None:
            os.ftruncate(self._file.fileno(), 0)  # frees the space for what Alembic writes now
            self._release()
        self._file.close()

    def _release(self) -> None:
        """Releases all objects, which makes Alembic close the archive."""
        self._archive = self._schema = None
        self._parameters = {}


def _integers(values: NDArray[Any]) -> Any:
    array = require("imath", extra="alembic").IntArrayFromBuffer
    return array(np.ascontiguousarray(values, np.int32))


def _bytes(values: NDArray[Any]) -> Any:
    array = require("imath", extra="alembic").UnsignedCharArray(len(values))
    np.asarray(array)[:] = values
    return array


def _alembic(name: str) -> Any:
    return getattr(require("alembic3d", extra="alembic"), name)


@contextlib.contextmanager
def _translating(kind: type[Exception], what: str) -> Iterator[None]:
    """Raises the library's errors as errors of another kind."""
    try:
        yield
    except RuntimeError as error:
        raise kind(f"{what}: {str(error).splitlines()[-1]}") from error


alembic = Format(
    "alembic",
    (".abc",),
    "a mesh in an Alembic archive",
    AlembicReader,
    AlembicWriter,
    frozenset({"prim"}),
    library=("alembic3d", "alembic"),
)
