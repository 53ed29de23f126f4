"""Problems of the faces of a mesh, and of vertices at one position."""

from collections.abc import Iterator

import numpy as np

from .._report import counted
from .finding import Finding, listed
from .mesh import Mesh

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
    for kind, (code, what, advice) in _REFUSED.items():
        places = [face.index for face in mesh.topology.refused_faces if face.kind == kind]
        if places:
            told = f"{counted(len(places), 'triangle')} {what}: {listed('face', places)}."
            yield Finding.at(code, told, advice, faces=places)


def _coincident(mesh: Mesh) -> Iterator[Finding]:
    there = np.flatnonzero(mesh.observed)
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
