"""Position of a mesh: its up axis, and its distance from the origin."""

from collections.abc import Iterator

import numpy as np

from ..draw.heatmap import likely_up
from ..files import Header
from ..sequence import Mask, Positions
from .finding import Finding
from .mesh import Mesh

_COARSE = 1e-3  # a rounding step, in mean edges


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
