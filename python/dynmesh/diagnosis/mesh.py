"""The mesh of a sequence, prepared for the diagnosis."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..completer import Completer
from ..draw.heatmap import likely_up
from ..metrics import bounding_box_diagonal
from ..sequence import Mask, Positions
from ..topology import TopologyReport, cells
from .finding import Indices

Faces = NDArray[np.integer[Any]]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh and what the diagnosis derives from it.

    Attributes:
        faces: (m, 3) integers.
        first: (k, 3), frame 0; zero for vertices that were not observed.
        observed: (k,) bool, in frame 0.
        ends: (e, 2) int64, the vertices of each edge.
        lengths: (e,), of the edges in frame 0; NaN if an end was not observed.
        mean_edge: of frame 0; 1 if there is no edge.
        diagonal: of the bounding box of frame 0.
        topology: the report of the topology; None if there are no faces.
    """

    faces: Faces
    first: Positions
    observed: Mask
    ends: Indices
    lengths: NDArray[np.float64]
    mean_edge: float
    diagonal: float
    topology: TopologyReport | None

    def likely_up(self, stated: str | None) -> str:
        """The up axis as it is stated, or else a guess."""
        if not self.observed.any():
            return stated or "y"
        return likely_up(self.first[self.observed], stated)

    @classmethod
    def of(cls, faces: Faces, points: Positions, observed: Mask) -> "Mesh":
        """Builds the mesh from frame 0, whose points are ignored where they were not observed."""
        first = np.where(observed[:, None], points, 0).astype(points.dtype)
        offsets, neighbours = cells(faces, len(first))
        own = np.repeat(np.arange(len(first)), np.diff(offsets))
        ends = np.stack([own, neighbours], axis=1)[own < neighbours].astype(np.int64)
        lengths = np.linalg.norm(np.diff(first[ends].astype(np.float64), axis=1)[:, 0], axis=1)
        lengths[~observed[ends].all(axis=1)] = np.nan
        mean_edge = float(np.nanmean(lengths)) if np.isfinite(lengths).any() else 0.0
        return cls(
            faces,
            first,
            observed,
            ends,
            lengths,
            mean_edge or 1.0,
            bounding_box_diagonal(first[observed]) if observed.any() else 0.0,
            Completer(faces, first).topology if len(faces) else None,
        )
