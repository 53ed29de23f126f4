"""Alembic: the positions of one mesh in an Ogawa archive, with a sample for each frame.

Of the scene, only the mesh itself is read and written: its positions, in its own space, and its
faces. Alembic's faces wind clockwise; they are reversed when read and written. The known mask is
the geometry parameter `known` (uint8, 0 and 1), and `generation` and `age` (int32) are parameters
as well, each with one value per vertex. The description of the archive states the up axis and the
length of a unit.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, locating
from ..attributes import ATTRIBUTES, as_mask, flags_of, with_all_needed
from ..polygons import split_polygons
from .alembic_archive import (
    AlembicScene,
    errors_of_key,
    faces_of,
    library,
    parameters,
    timing_of,
    translating,
    turned,
)
from .alembic_writer import AlembicWriter
from .comments import metadata_in
from .format import OTHER_MESHES, Format
from .frame import Frame
from .header import Header, MeshFile, errors_of
from .reader import Reader


class AlembicReader(Reader):
    """The frames of a mesh, which are the samples of its positions.

    Alembic stores the time of every sample; by default, samples are one second apart. If they are
    and the archive does not hold the rate of the program that wrote it, `fps` is None and the times
    are the numbers of the frames. If samples are not evenly spaced, frames are counted at that rate
    or, without it, at the median rate of the samples.
    """

    def __init__(self, path: Path, prim: str | None) -> None:
        """Opens the archive and reads everything except the frames."""
        self._scene: AlembicScene | None = AlembicScene(path)
        with translating(ValueError, "is damaged or not an Alembic archive"):
            self._mesh = self._scene.mesh(prim)
            self._positions = self._mesh.getSchema().getPositionsProperty()
            super().__init__(path, self._header(path, self._scene))

    def _header(self, path: Path, scene: AlembicScene) -> Header:
        archive = scene.archive
        n_frames = self._positions.getNumSamples()
        if n_frames == 0:
            raise ValueError("the mesh has no positions")
        faces, polygons = split_polygons(turned(faces_of(self._mesh)))
        self._parameters = _parameters(self._mesh.getSchema(), n_frames)
        bars = self._parameters.get("standard_error")
        errors = None if bars is None else bars.getMetaData().get(errors_of_key)
        info = library("Abc").GetArchiveInfo(archive)
        metadata = metadata_in(info.get("userDescription", "").split(","))
        return Header(
            faces=faces,
            n_frames=n_frames,
            n_vertices=len(self._positions.getValue(0)),
            dtype=np.dtype(np.float32),
            polygons=polygons,
            name=self._mesh.getFullName(),
            up_axis=metadata.up_axis,
            metres_per_unit=metadata.metres_per_unit,
            **timing_of(archive, self._positions)._asdict(),
            **flags_of(self._parameters),
            standard_error_of=errors_of(errors or None),
            mesh_file=MeshFile(path, ("transforms",)) if scene.is_moved(self._mesh) else None,
        )

    def _frames(self, numbers: range) -> Iterator[Frame]:
        for number in numbers:
            with translating(ValueError, f"frame {self.header.number(number)}: is damaged"):
                points = self._checked("positions", number, self._positions.getValue(number))
                values = {
                    name: self._checked(name, number, parameter.getExpandedValue(number).getVals())
                    for name, parameter in self._parameters.items()
                }
            for name, array in values.items():
                if ATTRIBUTES[name].dtype.kind == "b":
                    with locating(frame=self.header.number(number)):
                        values[name] = as_mask(array)
            yield Frame(points, **values)

    def _checked(self, name: str, number: int, values: Any) -> NDArray[Any]:
        if len(values) != self.n_vertices:
            raise InputError(
                f"{name} has {len(values)} values, "
                f"but the mesh has {self.n_vertices} vertices in its first frame; {OTHER_MESHES}",
                frame=self.header.number(number),
            )
        return np.array(values)

    def close(self) -> None:
        """Closes the archive."""
        self._scene = self._mesh = self._positions = None
        self._parameters = {}


def _parameters(schema: Any, n_frames: int) -> dict[str, Any]:
    """Returns the geometry parameters that exist; generation and age only together."""
    geometry = library("AbcGeom")
    compound = schema.getArbGeomParams()
    headers = {h.getName(): h for h in compound.propertyheaders} if compound.valid() else {}
    found = {}
    for name in with_all_needed(headers):
        parameter = getattr(geometry, f"I{parameters[name]}GeomParam")
        if not parameter.matches(headers[name]):
            kind = parameters[name].lower()
            raise InputError(f"must be a geometry parameter of type {kind}", argument=name)
        found[name] = parameter(compound, name)
        if found[name].getScope() != geometry.GeometryScope.kVertexScope:
            raise InputError("must have one value per vertex", argument=name)
        if found[name].getNumSamples() not in (1, n_frames):
            raise InputError(
                f"has {found[name].getNumSamples()} samples for {n_frames} frames", argument=name
            )
    return found


alembic = Format(
    "alembic",
    (".abc",),
    AlembicReader,
    AlembicWriter,
    frozenset({"prim"}),
    library=("alembic3d", "alembic"),
    meshes=lambda path: AlembicScene(path).moves,
)
