"""A mesh in a copied Alembic scene, with new positions and what follows from them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._extras import require
from ..frames.frame import Frame
from ..frames.header import Header
from ..frames.times import frame_seconds
from ..sequence import Positions
from .alembic_archive import AlembicScene, faces_of, library_array, parameters
from .alembic_copy import SceneCopy
from .alembic_output import OutputArchive, metadata_of
from .derivatives import Motions, Normals, layout_of

_geometry, _others = ".geom", ".geom/.arbGeomParams"
_scopes = {"vtx": "vertex", "var": "varying", "uni": "uniform", "fvr": "faceVarying"}


class ReplacedMesh:
    """The mesh of a scene while its frames are written.

    Normals and velocities are computed from the new positions if the scene has them. Normals that
    cannot be computed, since the faces at a vertex have different ones, are left out: programs then
    compute their own.

    Attributes:
        sampling: the number of the time sampling of the frames.
        remarks: what was left out, one line each.
    """

    def __init__(
        self, scene: AlembicScene, header: Header, copy: SceneCopy, output: OutputArchive
    ) -> None:
        """Copies everything else of the mesh."""
        name = str(header.name)
        self.remarks: list[str] = []
        self._output = output
        mesh = scene.mesh(name)
        schema = mesh.getSchema()
        positions = schema.getPositionsProperty()
        self.sampling = copy.sampling(positions)
        replaced = ["P", ".selfBnds", ".velocities", "N"]
        without = [f"{_geometry}/{one}" for one in replaced]
        made = copy.copy_mesh(name, without=[*without, *(f"{_others}/{one}" for one in parameters)])
        self._parameters = made.get(_others)
        self._geometry = made[_geometry]
        self._points = self._array("P", positions)
        self._bounds = output.property(
            "OBox3dProperty", self._geometry, ".selfBnds", sampling=self.sampling
        )
        self._normals: Normals | None = None
        self._velocities: Any = None
        self._make_normals(mesh)
        velocities = schema.getVelocitiesProperty()
        if velocities.valid() and velocities.getNumSamples():
            if header.n_frames > 1:
                self._velocities = self._array(".velocities", velocities)
                self._motions = Motions(frame_seconds(header))
            else:
                self.remarks.append(f"{name}: velocities are left out: one frame has none")

    def _make_normals(self, mesh: Any) -> None:
        schema = mesh.getSchema()
        if not hasattr(schema, "getNormalsParam"):  # a subdivided mesh has none
            return
        normals = schema.getNormalsParam()
        if not (normals.valid() and normals.getNumSamples()):
            return
        scope = _scopes.get(normals.getMetaData().get("geoScope"), "constant")
        values = np.array(normals.getExpandedValue(0).getVals())
        first = np.array(schema.getPositionsProperty().getValue(0))
        faces = faces_of(mesh)
        how = layout_of(values, scope, faces, first, reversed_if_unknown=True)
        if how == "blocked":
            self.remarks.append(
                f"{mesh.getFullName()}: normals are left out: they cannot be computed from the "
                "positions"
            )
            return
        self._normals = Normals(faces, how)
        self._normal_values = self._array("N", normals.getValueProperty(), normals)

    def _array(self, name: str, values: Any, described_by: Any = None) -> Any:
        """Makes a property for such values, with the metadata of their property or another."""
        return self._output.property(
            "OArrayProperty",
            self._geometry,
            name,
            values.getDataType(),
            metadata=metadata_of(values if described_by is None else described_by),
            sampling=self.sampling,
        )

    def parameters(self) -> Any:
        """Returns the compound property for geometry parameters, which is made if necessary."""
        if self._parameters is None:
            self._parameters = self._output.property(
                "OCompoundProperty", self._geometry, ".arbGeomParams"
            )
        return self._parameters

    def append(self, frame: Frame) -> None:
        """Adds the positions of the next frame."""
        points = frame.points
        self._output.add(self._points, library_array("V3f", points))
        self._output.add(self._bounds, _box(points))
        observed = points
        if frame.known is not None:
            observed = np.where(frame.known[:, None], points, np.float32(np.nan))
        if self._normals is not None:
            normals = self._normals.of(observed)
            self._output.add(self._normal_values, library_array("V3f", normals))
        if self._velocities is not None:
            for what, _, values in self._motions.push(observed):
                if what == "velocities":  # in the order of the frames
                    self._output.add(self._velocities, library_array("V3f", values))


def _box(points: Positions) -> Any:
    """Returns the bounding box of the finite positions, or an empty one."""
    imath = require("imath", extra="alembic")
    finite: NDArray[Any] = points[np.isfinite(points).all(axis=1)]
    if len(finite) == 0:
        return imath.Box3d()
    return imath.Box3d(
        *(imath.V3d(*map(float, corner)) for corner in (finite.min(axis=0), finite.max(axis=0)))
    )
