"""Problems of the components of a mesh and of the shape of its triangles."""

from collections.abc import Iterator

import numpy as np

from .finding import Finding, counted, listed
from .mesh import Mesh

_FLAT = 1e-4  # height over longest edge, hardly distinguishable from 0 in float32
_THIN = 0.01
_SMALL_PART = 0.01  # of the vertices


def examine(mesh: Mesh) -> Iterator[Finding]:
    """Yields the problems of the components and of the triangles."""
    if mesh.topology is None:
        yield _no_faces(mesh)
        return
    yield from _isolated(mesh)
    yield from _thin(mesh)
    yield from _components(mesh)


def _no_faces(mesh: Mesh) -> Finding:
    return Finding.at(
        "no_faces",
        f"There are no faces, only {counted(len(mesh.first), 'vertex')}.",
        "The sequence cannot be completed: motion propagates along edges. Give a mesh with faces "
        "if the file holds only positions.",
    )


def _isolated(mesh: Mesh) -> Iterator[Finding]:
    alone = np.ones(len(mesh.first), np.bool_)
    alone[mesh.ends] = False
    places = np.flatnonzero(alone)
    if not len(places):
        return
    yield Finding.at(
        "isolated_vertices",
        f"{counted(len(places), 'vertex')} without an edge: {listed('vertex', places)}.",
        "They have no neighbours. If they are missing, they follow the nearest part of the "
        "surface. Unless they are markers, remove them when the mesh is exported.",
        vertices=places,
    )


def _thin(mesh: Mesh) -> Iterator[Finding]:
    observed = mesh.observed[mesh.faces].all(axis=1)
    whole = np.flatnonzero(observed & ~mesh.degenerate)
    # In diagonals, since the fourth power of a length might overflow.
    corners = mesh.first[mesh.faces[whole]].astype(np.float64) / (mesh.diagonal or 1.0)
    sides = corners[:, [1, 2, 0]] - corners
    longest = (sides**2).sum(axis=2).max(axis=1, initial=0)
    doubled = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    height = np.divide(doubled, longest, out=np.zeros_like(doubled), where=longest > 0)
    flat, thin = whole[height <= _FLAT], whole[(height > _FLAT) & (height < _THIN)]
    advice = (
        "A very short edge couples its ends so strongly that other neighbours hardly matter, and "
        "noise flips such triangles. "
    )
    if len(flat):
        yield Finding.at(
            "flat_faces",
            f"{counted(len(flat), 'triangle')} without area, or nearly so, in the first frame: "
            f"{listed('face', flat)}.",
            advice + "Collapse their short edges, or remesh.",
            faces=flat,
            worst=float(height.min()),
        )
    if len(thin):
        worst = float(height[height > _FLAT].min())
        yield Finding.at(
            "needle_faces",
            f"{counted(len(thin), 'needle')}, triangles less than a hundredth as high as long, at "
            f"worst {worst:.2g}: {listed('face', thin)}.",
            advice + "A few do no harm.",
            faces=thin,
            worst=worst,
        )


def _components(mesh: Mesh) -> Iterator[Finding]:
    sizes = np.bincount(mesh.component)
    parts = np.sort(sizes[sizes > 1])[::-1]
    if len(parts) < 2:
        return
    small = (sizes < _SMALL_PART * len(mesh.first)) & (sizes > 1)
    places = np.flatnonzero(small[mesh.component])
    shown = ", ".join(map(str, parts[:4])) + (f", ... {parts[-1]}" if len(parts) > 4 else "")
    tail = f"; {small.sum()} have less than 1 % of the vertices" if small.any() else ""
    yield Finding.at(
        "several_components",
        f"{len(parts)} separate components, of {shown} vertices{tail}.",
        "A component that is not observed in a frame follows the motion of the nearest components. "
        "Merge components that belong together.",
        vertices=places,
        count=len(parts),
        worst=float(parts[-1]),
    )
