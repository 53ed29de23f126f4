"""Where a mesh is and how large: its unit, its upright axis, its distance from the origin."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..draw.heatmap import likely_up
from ..files import Header
from ..sequence import Mask, Positions
from .finding import Finding, Where
from .mesh import Mesh

_COARSE = 1e-3  # a rounding step, in mean edges

_PERSON = (0.5, 2.5)  # m, the longest side of the box around a person or a large animal
_MOSTLY_CLOSED = 0.02  # boundary edges per edge; a sheet has more


class Unit(NamedTuple):
    """A unit of length."""

    name: str
    metres: float


UNITS = (Unit("metres", 1.0), Unit("centimetres", 0.01), Unit("millimetres", 0.001))


class Placement:
    """Watches where the vertices are, frame by frame."""

    def __init__(self, header: Header, mesh: Mesh) -> None:
        """Begins with frame 0."""
        self._header = header
        self._mesh = mesh
        self._farthest = 0.0
        self._farthest_frame = 0
        self.watch(0, mesh.first, mesh.observed)

    @property
    def likely_up(self) -> str:
        """The axis that is up, as the file says, or else as it looks."""
        if not self._mesh.observed.any():
            return self._header.up_axis or "y"
        return likely_up(self._mesh.first[self._mesh.observed], self._header.up_axis)

    @property
    def likely_unit(self) -> Unit | None:
        """The unit in which it is as large as a person, if it can be one."""
        mesh = self._mesh
        if mesh.topology is None or not mesh.observed.any():
            return None
        if mesh.topology.boundary_edges > _MOSTLY_CLOSED * len(mesh.ends):
            return None  # a sheet
        extent = float(np.ptp(mesh.first[mesh.observed].astype(np.float64), axis=0).max())
        return next((u for u in UNITS if _PERSON[0] <= extent * u.metres <= _PERSON[1]), None)

    def watch(self, number: int, points: Positions, observed: Mask) -> None:
        """Takes the next frame."""
        farthest = float(np.abs(points[observed]).max(initial=0))
        if farthest > self._farthest:
            self._farthest, self._farthest_frame = farthest, number

    def findings(self) -> Iterator[Finding]:
        """Yields what is odd, when all frames have gone by."""
        if self._header.dtype == np.float32:
            step = float(np.spacing(np.float32(self._farthest))) / self._mesh.mean_edge
            if step > _COARSE:
                yield Finding(
                    "far_from_origin",
                    "warning",
                    1,
                    Where.of(frames=[self._farthest_frame]),
                    f"Coordinates reach {self._farthest:.4g}, where float32 goes in steps of "
                    f"{100 * step:.2g} % of a mean edge.",
                    "Positions are rounded that much, and motion between frames with them. Move "
                    "the mesh to the origin before it is written as float32, or write float64.",
                    step,
                )
        said, likely = self._header.metres_per_unit, self.likely_unit
        if said is None or likely is None:
            return
        extent = float(np.ptp(self._mesh.first[self._mesh.observed], axis=0).max())
        if not _PERSON[0] <= extent * said <= _PERSON[1]:
            yield Finding(
                "unlikely_unit",
                "note",
                1,
                Where(),
                f"The file says that a unit is {said:g} m, so that the mesh is "
                f"{extent * said:.3g} m long; a guess: if it is a person or an animal, the unit is "
                f"{likely.name}.",
                "Completion does not depend on the unit. What measures in metres, and whoever "
                "opens the result in a scene, does.",
                extent * said,
            )
