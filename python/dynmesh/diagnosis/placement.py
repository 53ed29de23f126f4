"""Position and size of a mesh: its unit, its up axis, its distance from the origin."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..draw.heatmap import likely_up
from ..files import Header
from ..sequence import Mask, Positions
from .finding import Finding
from .mesh import Mesh

_COARSE = 1e-3  # a rounding step, in mean edges

_PERSON = (0.5, 2.5)  # metres, longest side of the box around a person or a large animal
_MOSTLY_CLOSED = 0.02  # boundary edges per edge; a sheet has more


class Unit(NamedTuple):
    """A unit of length."""

    name: str
    metres: float


UNITS = (Unit("metres", 1.0), Unit("centimetres", 0.01), Unit("millimetres", 0.001))


class Placement:
    """Measures where the vertices are, frame by frame."""

    def __init__(self, header: Header, mesh: Mesh) -> None:
        """Starts with frame 0."""
        self._header = header
        self._mesh = mesh
        self._farthest = 0.0
        self._farthest_frame = 0
        self.watch(0, mesh.first, mesh.observed)

    @property
    def likely_up(self) -> str:
        """The up axis, as the file states it, or else a guess."""
        if not self._mesh.observed.any():
            return self._header.up_axis or "y"
        return likely_up(self._mesh.first[self._mesh.observed], self._header.up_axis)

    @property
    def likely_unit(self) -> Unit | None:
        """The unit in which the mesh is as large as a person, if there is one."""
        mesh = self._mesh
        if mesh.topology is None or not mesh.observed.any():
            return None
        if mesh.topology.boundary_edges > _MOSTLY_CLOSED * len(mesh.ends):
            return None  # an open sheet is not a person
        extent = float(np.ptp(mesh.first[mesh.observed].astype(np.float64), axis=0).max())
        return next((u for u in UNITS if _PERSON[0] <= extent * u.metres <= _PERSON[1]), None)

    def watch(self, number: int, points: Positions, observed: Mask) -> None:
        """Takes the next frame into account."""
        farthest = float(np.abs(points[observed]).max(initial=0))
        if farthest > self._farthest:
            self._farthest, self._farthest_frame = farthest, number

    def findings(self) -> Iterator[Finding]:
        """Yields the problems found in all frames."""
        if self._header.dtype == np.float32:
            step = float(np.spacing(np.float32(self._farthest))) / self._mesh.mean_edge
            if step > _COARSE:
                yield Finding.at(
                    "far_from_origin",
                    f"Coordinates reach {self._farthest:.4g}, where float32 has a resolution of "
                    f"{100 * step:.2g} % of a mean edge.",
                    "Positions and the motion between frames are rounded by that much. Move the "
                    "mesh to the origin before it is written as float32, or write float64.",
                    frames=[self._farthest_frame],
                    worst=step,
                )
        said, likely = self._header.metres_per_unit, self.likely_unit
        if said is None or likely is None:
            return
        extent = float(np.ptp(self._mesh.first[self._mesh.observed], axis=0).max())
        if not _PERSON[0] <= extent * said <= _PERSON[1]:
            yield Finding.at(
                "unlikely_unit",
                f"According to the file a unit is {said:g} m, so the mesh is {extent * said:.3g} m "
                "long. If this is a person or an animal, the unit is probably "
                f"{likely.name}.",
                "Completion does not depend on the unit, but measurements in metres and scenes "
                "that contain the result do.",
                worst=extent * said,
            )
