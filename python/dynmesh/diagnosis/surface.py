"""Problems of the connectivity of the faces."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..sequence import Mask
from .finding import Finding, Indices, counted, listed
from .mesh import Mesh


def examine(mesh: Mesh) -> Iterator[Finding]:
    """Yields the problems of the surface."""
    edges = FaceEdges.of(mesh)
    yield from _coincident(mesh, edges)
    yield from _repeated_corners(mesh)
    yield from _non_manifold(mesh, edges)


@dataclass(frozen=True, eq=False)
class FaceEdges:
    """The sides of all faces except degenerate and duplicate ones, grouped by edge.

    Attributes:
        face: (s,) of each side.
        ends: (s, 2), ascending.
        starts: (e,), where the sides of each edge begin.
        counts: (e,), how many sides each edge has.
    """

    face: Indices
    ends: Indices
    starts: Indices
    counts: Indices

    @classmethod
    def of(cls, mesh: Mesh) -> "FaceEdges":
        """Collects and sorts the sides."""
        kept = np.flatnonzero(~mesh.degenerate & ~mesh.duplicate)
        corners = mesh.faces[kept].astype(np.int64)
        begin, end = corners.reshape(-1), corners[:, [1, 2, 0]].reshape(-1)
        ends = np.stack([np.minimum(begin, end), np.maximum(begin, end)], axis=1)
        order = np.lexsort(ends.T[::-1])
        ends = ends[order]
        new = np.diff(ends, axis=0, prepend=-1).any(axis=1)
        starts = np.flatnonzero(new)
        counts = np.diff(starts, append=len(ends))
        return cls(np.repeat(kept, 3)[order], ends, starts, counts)

    def sides_of(self, edges: Mask) -> Mask:
        """Returns which sides belong to these edges."""
        return np.repeat(edges, self.counts)


def _coincident(mesh: Mesh, edges: FaceEdges) -> Iterator[Finding]:
    there = np.flatnonzero(mesh.observed)
    points = mesh.first[there]
    order = np.lexsort(points.T)
    same = (points[order[1:]] == points[order[:-1]]).all(axis=1)
    together = np.zeros(len(there), np.bool_)
    together[1:] |= same
    together[:-1] |= same
    places = np.sort(there[order[together]])
    if not len(places):
        return
    rim = np.unique(edges.ends[edges.sides_of(edges.counts == 1)])
    torn = int(np.isin(places, rim).sum())
    yield Finding.at(
        "coincident_vertices",
        f"{counted(len(places), 'vertex')} at exactly the position of another vertex in the first "
        "frame, "
        f"{torn} of them on a boundary of the surface: {listed('vertex', places)}.",
        "The surface is probably cut there, for example along texture seams. The two sides are "
        "completed separately and may open. Merge them first (merge by distance).",
        vertices=places,
    )


def _repeated_corners(mesh: Mesh) -> Iterator[Finding]:
    places = np.flatnonzero(mesh.degenerate)
    if len(places):
        yield Finding.at(
            "degenerate_faces",
            f"{counted(len(places), 'triangle')} with a repeated vertex: {listed('face', places)}.",
            "They are ignored, but their edges still count. Delete them.",
            faces=places,
        )


def _non_manifold(mesh: Mesh, edges: FaceEdges) -> Iterator[Finding]:
    crowded = edges.counts > 2
    advice = (
        "Motion propagates across them and pulls together sheets that may only touch, and method "
        "detail has no well-defined shape there. Separate the sheets, or delete the inner faces."
    )
    if crowded.any():
        sides = edges.sides_of(crowded)
        first = [f"{a}-{b}" for a, b in edges.ends[edges.starts[crowded]][:3].tolist()]
        worst = int(edges.counts.max())
        n_edges = int(crowded.sum())
        more = ", ..." if n_edges > len(first) else ""
        yield Finding.at(
            "non_manifold_edges",
            f"{counted(n_edges, 'edge')} with more than two triangles, at most {worst}: "
            f"{', '.join(first)}{more}.",
            advice,
            vertices=np.unique(edges.ends[sides]),
            faces=np.unique(edges.face[sides]),
            count=n_edges,
            worst=worst,
        )
    touching = _touching(mesh)
    if touching:
        yield Finding.at(
            "non_manifold_vertices",
            f"{counted(len(touching), 'triangle')} at vertices where sheets touch in a single "
            f"point: {listed('face', touching)}.",
            advice,
            faces=touching,
        )


def _touching(mesh: Mesh) -> list[int]:
    """Returns the faces that were refused because sheets touch in one of their vertices."""
    refused = [] if mesh.topology is None else mesh.topology.refused_faces
    return [face.index for face in refused if face.kind == "non_manifold_vertex"]
