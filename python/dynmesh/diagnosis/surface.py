"""Problems of the connectivity of the faces."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..sequence import Mask
from .connection import connected
from .finding import Finding, Indices, counted, listed
from .mesh import Mesh

_SMALL_HOLE = 20  # edges


def examine(mesh: Mesh) -> Iterator[Finding]:
    """Yields the problems of the surface."""
    edges = FaceEdges.of(mesh)
    yield from _coincident(mesh, edges)
    yield from _repeated_corners(mesh)
    yield from _duplicates(mesh)
    yield from _non_manifold(mesh, edges)
    yield from _flipped(mesh, edges)
    yield from _small_holes(mesh, edges)


@dataclass(frozen=True, eq=False)
class FaceEdges:
    """The sides of all faces except degenerate and duplicate ones, grouped by edge.

    Attributes:
        face: (s,) of each side.
        ends: (s, 2), ascending.
        forward: (s,) bool, whether the face goes from the first end to the second.
        starts: (e,), where the sides of each edge begin.
        counts: (e,), how many sides each edge has.
    """

    face: Indices
    ends: Indices
    forward: Mask
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
        return cls(np.repeat(kept, 3)[order], ends, (begin < end)[order], starts, counts)

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


def _duplicates(mesh: Mesh) -> Iterator[Finding]:
    places = np.flatnonzero(mesh.duplicate)
    if len(places):
        yield Finding.at(
            "duplicate_faces",
            f"{counted(len(places), 'triangle')} with the same three vertices as an earlier one: "
            f"{listed('face', places)}.",
            "They do not affect completion, but flicker when they are drawn. Delete them.",
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


def _flipped(mesh: Mesh, edges: FaceEdges) -> Iterator[Finding]:
    pairs = edges.starts[edges.counts == 2]
    one, other = edges.face[pairs], edges.face[pairs + 1]
    agree = edges.forward[pairs] != edges.forward[pairs + 1]
    if agree.all():
        return
    # Each face is a node twice, in both orientations; consistent orientations are connected.
    m = len(mesh.faces)
    across = np.where(agree, 0, m)
    label = connected(
        2 * m,
        np.concatenate([one, one + m]),
        np.concatenate([other + across, other + m - across]),
    )
    as_is, over = label[:m], label[m:]
    surface = np.minimum(as_is, over)
    kept, turned = as_is < over, over < as_is
    n_kept, n_turned = (np.bincount(surface[side], minlength=m)[surface] for side in (kept, turned))
    lesser = np.where(n_kept < n_turned, kept, turned)
    places = np.flatnonzero(lesser)
    n_edges = int((~agree).sum())
    one_sided = np.flatnonzero(as_is == over)
    if len(places):
        yield Finding.at(
            "flipped_faces",
            f"{counted(len(places), 'triangle')} oriented against the larger part of their "
            f"surface, along {counted(n_edges, 'edge')}: {listed('face', places)}.",
            "Completion is not affected, but normals and everything computed from them are. Make "
            "the orientation consistent (recalculate normals).",
            faces=places,
        )
    if len(one_sided):
        yield Finding.at(
            "one_sided_surface",
            f"{counted(len(one_sided), 'triangle')} in a surface that cannot be oriented, such as "
            f"a Moebius strip: {listed('face', one_sided)}.",
            "Completion is not affected, but normals cannot be consistent. Look for edges "
            "that are connected the wrong way round.",
            faces=one_sided,
        )


def _small_holes(mesh: Mesh, edges: FaceEdges) -> Iterator[Finding]:
    rim = edges.ends[edges.starts[edges.counts == 1]]
    if not len(rim):
        return
    loop = connected(len(mesh.first), rim[:, 0], rim[:, 1])[rim[:, 0]]
    loops, which, lengths = np.unique(loop, return_inverse=True, return_counts=True)
    part = np.bincount(mesh.component)[mesh.component[loops]]
    # The second condition excludes small patches, whose boundary is short as well.
    small = (lengths <= _SMALL_HOLE) & (part > 2 * lengths**2)
    ends_meeting = np.bincount(rim.reshape(-1))
    touched = np.isin(rim, mesh.faces[_touching(mesh)])  # at sheets that touch in a single point
    astray = (ends_meeting[rim] != 2).any(axis=1)  # the boundary of a fin, which is not a loop
    small &= ~np.isin(loops, loop[astray | touched.any(axis=1)])
    if not small.any():
        return
    places = np.unique(rim[small[which.reshape(-1)]])
    worst = int(lengths[small].max())
    yield Finding.at(
        "small_holes",
        f"{counted(int(small.sum()), 'small hole')} in the surface, of at most {worst} edges: "
        f"{listed('vertex', places)}.",
        "Motion does not propagate across a hole, but a small one hardly matters. dynmesh adds no "
        "faces: fill the hole first if it should not be there.",
        vertices=places,
        count=int(small.sum()),
        worst=worst,
    )
