"""Access to Alembic archives: their meshes, the values of properties, and the library's arrays."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._extras import require
from ..attributes import ATTRIBUTES
from ..polygons import Polygons, check_polygons
from .scenes import check_same_faces, choose_mesh
from .times import Timing, broadcast, frame_number, spacing, uneven

_KINDS = {"b": "Uchar", "i": "Int32", "f": "Float"}

parameters = {name: _KINDS[row.dtype.kind] for name, row in ATTRIBUTES.items()}
"""The data of a vertex besides its position, and the kind of geometry parameter that holds it."""

errors_of_key = "standard_error_of"
"""Of the metadata of the parameter `standard_error`."""


class AlembicScene:
    """An archive and its meshes. Copies by reference (instances) of a mesh are not among them.

    Attributes:
        archive: the archive.
        moves: the paths of the meshes, and whether the positions of each change.
    """

    def __init__(self, path: Path) -> None:
        """Opens the archive."""
        path.open("rb").close()  # gives the error message of the system
        with translating(ValueError, "is damaged or not an Alembic archive"):
            self.archive = library("Abc").IArchive(str(path))
            self._meshes = {mesh.getFullName(): mesh for mesh in _meshes(self.archive.getTop())}
            self.moves: dict[str, bool] = {
                name: not mesh.getSchema().getPositionsProperty().isConstant()
                for name, mesh in self._meshes.items()
            }

    def mesh(self, prim: str | None) -> Any:
        """Returns the mesh at this path, or see :func:`choose_mesh`."""
        return self._meshes[choose_mesh(self.moves, prim)]

    def is_moved(self, mesh: Any) -> bool:
        """Whether transforms, which are ignored, put a mesh elsewhere than its points are."""
        kind, parent = library("AbcGeom").IXform, self.archive.getTop()
        for name in mesh.getFullName().split("/")[1:-1]:
            child = parent.getChild(name)
            is_transform = kind.matches(child.getHeader())
            if is_transform and kind(parent, name).getSchema().getNumOps():
                return True
            parent = child
        return False


def _meshes(parent: Any) -> Iterator[Any]:
    """Yields all meshes; copies by reference have the path of the mesh that they copy."""
    geometry = library("AbcGeom")
    for child in parent.children:
        for kind in (geometry.IPolyMesh, geometry.ISubD):
            if kind.matches(child.getHeader()):
                yield kind(parent, child.getName())
        yield from _meshes(child)


def faces_of(mesh: Any) -> Polygons:
    """Returns the faces as they are, clockwise; they must be the same at all times."""
    schema = mesh.getSchema()
    properties = (schema.getFaceCountsProperty(), schema.getFaceIndicesProperty())

    def faces_at(number: int) -> Polygons:
        return Polygons(*(np.array(one.getValue(number), np.int32) for one in properties))

    faces = faces_at(0)
    if not all(one.isConstant() for one in properties):
        for number in range(1, schema.getNumSamples()):
            check_same_faces(faces, faces_at(number), f"frame {number}")
    return faces


def turned(polygons: Polygons) -> Polygons:
    """Returns the polygons with the corners in reverse order."""
    check_polygons(polygons)
    ends = np.cumsum(polygons.sizes)
    last = np.repeat(2 * ends - polygons.sizes - 1, polygons.sizes)
    return Polygons(polygons.sizes, polygons.corners[last - np.arange(len(last))])


def timing_of(archive: Any, positions: Any) -> Timing:
    """Returns the frames per second, if the archive states them, and the numbers of the frames."""
    sampling = positions.getTimeSampling()
    kind = sampling.getTimeSamplingType()
    times = _sample_times(positions)
    step = kind.getTimePerCycle() if kind.isUniform() else spacing(times)
    metadata = library("Abc").GetArchiveInfo(archive).get("dccFPS")  # has only six decimals
    rate = next((fps for fps in broadcast if round(fps, 6) == metadata), metadata or None)
    if step is None and len(times) > 1:
        return uneven(times, rate)
    fps = 1 / step if step else rate
    if step == 1 and (times[0] == 0 or rate is None):
        fps = rate
    return Timing(fps, frame_number(times[0], fps))


def _sample_times(positions: Any) -> list[float]:
    sampling = positions.getTimeSampling()
    return [float(sampling.getSampleTime(number)) for number in range(positions.getNumSamples())]


def library_array(kind: str, values: NDArray[Any]) -> Any:
    """Returns a copy as an array of the library, which calls its type "V3f", "Int" and so on."""
    array = getattr(require("imath", extra="alembic"), f"{kind}Array")(len(values))
    np.asarray(array)[:] = values
    return array


def library(name: str) -> Any:
    """Returns a module of the library."""
    return getattr(require("alembic3d", extra="alembic"), name)


@contextlib.contextmanager
def translating(kind: type[Exception], what: str) -> Iterator[None]:
    """Raises the library's errors as errors of another kind."""
    try:
        yield
    except RuntimeError as error:
        raise kind(f"{what}: {str(error).splitlines()[-1]}") from error
