"""The figure of docs/how_it_works.md: four steps of method detail on a recorded horse.

The steps are computed here as the page describes them, with one blend for the whole mesh.
"""

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, to_rgb
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import splu, spsolve
from scipy.spatial.transform import Rotation

import dynmesh
from dynmesh.topology import mean_edge_of

from ..style import new_figure, save

Array = NDArray[np.float64]

_LAST, _SHOWN = 8, 10  # of frame 9, nothing arrives
_LEG = ((1, np.inf), (9, 27), (8, np.inf))  # what is hidden, in mean edges of frame 0
_KNOWN, _ESTIMATED, _ARROWS, _FAINT = "#d3d8e0", "#f0b070", "#1f4e79", "#9aa3ae"
_BLENDS = LinearSegmentedColormap.from_list("blends", ["#3b78c3", "#8d6cab", "#e07b39"])
_LIGHT = np.array([0.6, 0.5, 0.62])


def draw(data: Path, folder: Path) -> None:
    """Completes a leg whose middle is hidden, and draws each step."""
    horse = dynmesh.read(data / "horse_gallop.npz")
    faces = horse.faces
    frames = horse.vertices / mean_edge_of(horse.vertices[0], faces)
    known = np.zeros(frames.shape[1], bool)
    for axis, (low, high) in enumerate(_LEG):
        known |= (frames[0][:, axis] <= low) | (frames[0][:, axis] >= high)
    leg = _Steps(faces, frames[0], known)
    whole = frames[_LAST]
    remembered = np.einsum("vba,vb->va", leg.rotations(whole), leg.operator @ whole)  # turned back
    start = np.where(known[:, None], frames[_SHOWN], whole)
    increments = leg.increments(whole, start)
    start = leg.solved(start, np.einsum("vab,vb->va", increments, leg.operator @ whole))
    last, first, blend = leg.blended(start, remembered)
    arrows = leg.operator @ frames[0]
    shown = np.flatnonzero(~known)[::11]

    def error(frame: Array) -> str:
        distances = np.linalg.norm(frame - frames[_SHOWN], axis=1)
        return f"{distances[~known].mean():.1f}"

    with new_figure(8.5, 7.4) as figure:
        axes = figure.subplots(2, 2).ravel()
        given = known[faces].all(axis=1)
        colours = np.where(given[:, None], to_rgb(_KNOWN), to_rgb(_ESTIMATED))
        _surface(axes[0], faces, frames[0], np.broadcast_to(to_rgb(_KNOWN), (len(faces), 3)))
        _arrows(axes[0], frames[0], arrows, shown, _ARROWS)
        _surface(axes[1], faces, whole, np.broadcast_to(to_rgb("#eef0f3"), (len(faces), 3)))
        _surface(axes[1], faces, start, colours)
        _surface(axes[2], faces, start, colours)
        _arrows(axes[2], start, arrows, shown, _FAINT)
        turned = np.einsum("vab,vb->va", leg.rotations(start), arrows)
        _arrows(axes[2], start, turned, shown, _ARROWS)
        _surface(axes[3], faces[given], last, colours[given])
        hidden = faces[~given]
        for at in (0.0, 1.0, blend):
            colour = np.broadcast_to(_BLENDS(at)[:3], (len(hidden), 3))
            shade = colour if at == blend else (1 + colour) / 2
            _surface(axes[3], hidden, last + at * (first - last), shade)
        scale = axes[3].inset_axes((0.12, 0.1, 0.7, 0.025))
        bar = figure.colorbar(ScalarMappable(cmap=_BLENDS), scale, orientation="horizontal")
        labels = ["0: last\nshape", f"{blend:.2f}", "1: shape\nof frame 0"]
        bar.set_ticks([0, blend, 1], labels=labels, fontsize=8)
        errors = [error(last + at * (first - last)) for at in (0.0, blend, 1.0)]
        titles = (
            "1. Frame 0 and its\ndifferential coordinates",
            f"2. The last shape, rotated\nwith the anchors (error {error(start)})",
            "3. The vectors,\nrotated with the surface",
            "4. The solve, for three blends\n(error {}, {} and {})".format(*errors),
        )
        for axis, title in zip(axes, titles, strict=True):
            axis.set_title(title, fontsize=11)
            axis.set_xlim(1, 46)
            axis.set_ylim(1, 42)
            axis.set_aspect("equal")
            axis.set_axis_off()
        save(figure, folder / "how_it_works" / "steps.png", is_chart=False)


class _Steps:
    """Method detail, in lengths of mean edges of frame 0, as docs/how_it_works.md describes it."""

    def __init__(self, faces: NDArray[Any], first: Array, known: Any) -> None:
        """Makes the operator of frame 0, and factors it for what is unknown."""
        igl, triangles = import_module("igl"), faces.astype(np.int64)
        areas = igl.massmatrix(first, triangles, igl.MASSMATRIX_TYPE_BARYCENTRIC).diagonal()
        stiffness = sparse.csr_array(-igl.cotmatrix(first, triangles))
        self.operator = sparse.csr_array(sparse.diags_array(areas**-0.5) @ stiffness)
        self._unknown = np.flatnonzero(~known)
        normal = sparse.csc_array(self.operator.T @ self.operator)
        self._factor = splu(normal[:, self._unknown][self._unknown].tocsc())
        self._first, beside = first, dynmesh.topology.adjacency(faces, len(first))
        self._edges, self._known = beside.nonzero(), known
        self._ring = sparse.csr_array(beside + sparse.eye_array(len(first)))
        self._cluster = _clusters(self._ring)
        i, j = (self._cluster[end] for end in self._edges)
        self._beside: Any = sparse.csr_array((i != j, (i, j)), dtype=bool).astype(float)
        self._beside.eliminate_zeros()

    def solved(self, start: Array, target: Array) -> Array:
        """Brings the unknown vertices as near to these differential coordinates as possible."""
        found = start.copy()
        rest = self.operator.T @ (target - self.operator @ start)
        found[self._unknown] += self._factor.solve(rest[self._unknown])
        return found

    def increments(self, last: Array, frame: Array) -> Array:
        """The rotations around each vertex from the last frame, from the anchors of this one."""
        first, _ = Rotation.align_vectors(
            *(one[self._known] - one[self._known].mean(axis=0) for one in (frame, last))
        )
        arms, cluster, weights = self._arms()
        p, q = arms @ last, arms @ frame
        y, weights = first.apply(p), weights / np.maximum((p**2).sum(axis=1), 1e-4)
        squares = (y**2).sum(axis=1)[:, None, None] * np.eye(3) - y[:, :, None] * y[:, None, :]
        at = (cluster, np.arange(len(cluster)))
        sums = sparse.csr_array((weights, at), shape=(self._beside.shape[0], len(cluster)))
        blocks = sparse.block_diag(list((sums @ squares.reshape(-1, 9)).reshape(-1, 3, 3)))
        couplings = sparse.diags_array(self._beside.sum(axis=1)) - self._beside
        matrix: Any = sparse.kron(couplings, 0.05 * np.eye(3)) + blocks
        omega = spsolve(matrix.tocsc(), (sums @ np.cross(y, q)).ravel()).reshape(-1, 3)
        turns = (Rotation.from_rotvec(omega) * first).as_matrix()[self._cluster]
        return _nearest_rotations(self._ring @ turns.reshape(-1, 9))

    def _arms(self) -> tuple[Any, NDArray[Any], Array]:
        """The arms and pairs as differences of vertices, their clusters and their weights."""
        anchors = np.flatnonzero(self._known)
        own = self._cluster[anchors]
        count = np.bincount(own, minlength=self._beside.shape[0])
        shape = (len(count), len(self._known))
        mean = sparse.csr_array((1 / count[own], (own, anchors)), shape=shape)
        c, d, path = self._pairs(count > 0)
        pairs, weights = mean[d] - mean[c], 0.5 / (1 + (path / 10) ** 2)
        arms = sparse.eye_array(len(self._known)).tocsr()[anchors] - mean[own]
        return (
            sparse.vstack([arms, pairs, pairs]),
            np.concatenate([own, c, d]),
            np.concatenate([np.ones(len(own)), weights, weights]),
        )

    def _pairs(self, has_anchors: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], Array]:
        """The clusters with anchors whose regions touch, and the lengths of the paths."""
        size = np.bincount(self._cluster)[:, None]
        centres = np.stack([np.bincount(self._cluster, x) for x in self._first.T], axis=1) / size
        i, j = self._beside.nonzero()
        steps = np.linalg.norm(centres[i] - centres[j], axis=1)
        graph = sparse.csr_array((steps, (i, j)), shape=self._beside.shape)
        away, _, region = dijkstra(
            graph, indices=np.flatnonzero(has_anchors), min_only=True, return_predecessors=True
        )
        found: dict[tuple[int, int], float] = {}
        for a, b, path in zip(region[i], region[j], away[i] + steps + away[j], strict=True):
            if a < b:
                found[a, b] = min(path, found.get((a, b), np.inf))
        c, d = np.array(list(found)).T
        return c, d, np.array(list(found.values()))

    def rotations(self, frame: Array) -> Array:
        """The rotations of the surface around each vertex from frame 0 to a frame."""
        i, j = self._edges
        before, after = self._first[j] - self._first[i], frame[j] - frame[i]
        sums = np.zeros((len(frame), 9))
        outer = np.einsum("na,nb->nab", after, before) / (before**2).sum(axis=1)[:, None, None]
        np.add.at(sums, i, outer.reshape(-1, 9))
        for _ in range(3):
            sums = np.asarray(self._ring @ sums)
        return _nearest_rotations(sums)

    def blended(self, start: Array, remembered: Array) -> tuple[Array, Array, float]:
        """The frames of blend 0 and 1, and the blend that the anchors support."""
        change = self.operator @ self._first - remembered

        def ends(frame: Array) -> list[Array]:
            turn = self.rotations(frame)
            target, towards = (np.einsum("vab,vb->va", turn, one) for one in (remembered, change))
            last, step = self.solved(frame, target), self.solved(np.zeros_like(frame), towards)
            return [last, step, self.operator @ last - target, self.operator @ step - towards]

        last, step, residual, of_step = ends(start)
        blend = float(-(of_step * residual).sum() / (of_step**2).sum())
        last, step, _, _ = ends(last + blend * step)
        return last, last + step, blend


def _clusters(ring: Any) -> NDArray[Any]:
    """Numbers disjoint rings; the vertices that are left join a neighbour."""
    cluster, n = np.full(ring.shape[0], -1), 0
    cells = np.split(ring.indices, ring.indptr[1:-1])
    for cell in cells:
        if (cluster[cell] == -1).all():
            cluster[cell], n = n, n + 1
    joined = [cluster[cell].max() for cell in cells]
    return np.where(cluster == -1, joined, cluster)


def _nearest_rotations(sums: Array) -> Array:
    """The rotations nearest to matrices, one a row."""
    left, _, right = np.linalg.svd(sums.reshape(-1, 3, 3))
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    return np.asarray(left @ right)


def _surface(axis: Axes, faces: NDArray[Any], points: Array, colours: NDArray[Any]) -> None:
    """Draws what of a surface looks to the side, the nearest triangles last."""
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    order = np.argsort(corners[:, :, 0].mean(axis=1))
    order = order[(normals[order, 0] > 0) & (corners[order][:, :, 0] > 0).all(axis=1)]
    light = 0.55 + 0.45 * np.clip(normals[order] @ _LIGHT, 0, 1)
    shaded = np.asarray(colours)[order] * light[:, None] ** 0.6
    flat = corners[order][:, :, [2, 1]]
    axis.add_collection(PolyCollection(flat, facecolors=shaded, edgecolors=shaded, linewidths=0.2))


def _arrows(axis: Axes, points: Array, vectors: Array, shown: NDArray[Any], colour: str) -> None:
    """Draws vectors on a surface, turned around: they point inwards where it bulges."""
    at, to = points[shown], -5 * vectors[shown]
    axis.quiver(
        *(at[:, 2], at[:, 1], to[:, 2], to[:, 1]),
        color=colour,
        angles="xy",
        scale_units="xy",
        scale=1,
        width=0.006,
        zorder=3,
    )
