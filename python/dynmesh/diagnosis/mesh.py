"""The mesh of a sequence, prepared for the diagnosis, and the problems of its surface."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Mask, Positions
from .._report import counted
from ..completer import Completer
from ..metrics import bounding_box_diagonal
from ..topology import cells
from .finding import Finding, listed


class Mesh:
    """A mesh and what the diagnosis derives from it.

    Attributes:
        first: (k, 3), frame 0; zero for vertices that have no position.
        present: (k,) bool, in frame 0.
        ends: (e, 2) int64, the vertices of each edge.
        lengths: (e,), of the edges in frame 0; NaN if an end has none.
        mean_edge: of frame 0; 1 if there is no edge.
        diagonal: of the bounding box of frame 0.
        topology: the report of the topology; None if there are no faces.
    """

    def __init__(self, faces: NDArray[np.integer[Any]], points: Positions, present: Mask) -> None:
        self.present = present
        self.first = np.where(present[:, None], points, 0).astype(points.dtype)
        offsets, neighbours = cells(faces, len(points))
        own = np.repeat(np.arange(len(points)), np.diff(offsets))
        ends = np.stack([own, neighbours], axis=1)[own < neighbours].astype(np.int64)
        between = np.diff(self.first[ends].astype(np.float64), axis=1)[:, 0]
        lengths = np.linalg.norm(between, axis=1)
        lengths[~present[ends].all(axis=1)] = np.nan
        self.ends, self.lengths = ends, lengths
        self.mean_edge = (float(np.nanmean(lengths)) if np.isfinite(lengths).any() else 0.0) or 1.0
        self.diagonal = bounding_box_diagonal(self.first[present]) if present.any() else 0.0
        self.topology = Completer(faces, self.first).topology if len(faces) else None


_TOUCHING = (
    "Motion propagates across them and pulls together sheets that may only touch, and method "
    "detail has no well-defined shape there. Separate the sheets, or delete the inner faces."
)
_REFUSED = {
    "degenerate": (
        "degenerate_faces",
        "with a repeated vertex",
        "They are ignored, but their edges still count. Delete them.",
    ),
    "non_manifold_edge": ("non_manifold_edges", "at edges with two others", _TOUCHING),
    "non_manifold_vertex": (
        "non_manifold_vertices",
        "at vertices where sheets touch in a single point",
        _TOUCHING,
    ),
}
"""By the kind of a face that a half-edge mesh cannot represent."""


def examine(mesh: Mesh) -> Iterator[Finding]:
    """Yields the problems of the surface."""
    yield from _coincident(mesh)
    if mesh.topology is None:
        yield Finding.at(
            "no_faces",
            f"There are no faces, only {counted(len(mesh.first), 'vertex')}.",
            "The sequence cannot be completed: motion propagates along edges. Give a mesh with "
            "faces if the file holds only positions.",
        )
        return
    if mesh.topology.isolated_vertices == 1 and mesh.ends.min(initial=len(mesh.first)) == 1:
        yield Finding.at(
            "first_vertex_unused",
            "Vertex 0 is in no face, and all others are.",
            "The faces may count vertices from 1, and then refer to the wrong ones: subtract 1.",
            vertices=np.array([0]),
        )
    for kind, (code, what, advice) in _REFUSED.items():
        places = [face.index for face in mesh.topology.refused_faces if face.kind == kind]
        if places:
            message = f"{counted(len(places), 'triangle')} {what}: {listed('face', places)}."
            yield Finding.at(code, message, advice, faces=places)


def _coincident(mesh: Mesh) -> Iterator[Finding]:
    there = np.flatnonzero(mesh.present)
    _, group, sizes = np.unique(mesh.first[there], axis=0, return_inverse=True, return_counts=True)
    places = there[sizes[group.reshape(-1)] > 1]
    if len(places):
        yield Finding.at(
            "coincident_vertices",
            f"{counted(len(places), 'vertex')} at exactly the position of another vertex in the "
            f"first frame: {listed('vertex', places)}.",
            "The surface is probably cut there, for example along texture seams. The two sides are "
            "completed separately and may open. Merge them first (merge by distance).",
            vertices=places,
        )
