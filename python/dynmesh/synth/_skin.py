"""Closed skins around flesh, posed by bones.

The connectivity is the surface of cells of a cubic lattice. The shape is the smooth union of
tapered capsules, onto which that surface is projected while it is relaxed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Capsule = tuple[ArrayLike, ArrayLike, tuple[float, float]]
"""Both ends, and the radii there."""

_RELAXATIONS = 20


@dataclass(frozen=True, eq=False)
class Skin:
    """A surface at rest.

    `vertices` (k, 3), `faces` (m, 3) oriented outward, and `weights` (k, b), a column for each
    bone, rows summing to one. The arrays are read-only.
    """

    vertices: Floats
    faces: NDArray[np.int32]
    weights: Floats

    def __post_init__(self) -> None:
        for array in (self.vertices, self.faces, self.weights):
            array.flags.writeable = False

    def posed(self, motions: Floats) -> NDArray[np.float32]:
        """Return the vertices (n, k, 3) after motions of the bones, dual quaternions (n, b, 8).

        These are blended as Kavan et al. (2007) do.
        """
        points = np.ascontiguousarray(self.vertices.T)
        weights = np.ascontiguousarray(self.weights.T)
        frames = np.empty((len(motions), *self.vertices.shape), dtype=np.float32)
        for frame, dual_quaternions in zip(frames, motions, strict=True):
            blend = dual_quaternions.T @ weights
            blend /= np.linalg.norm(blend[:4], axis=0)
            w, v, dual_w, dual_v = blend[0], blend[1:4], blend[4], blend[5:]
            turned = np.cross(v, np.cross(v, points, axis=0) + w * points + dual_v, axis=0)
            frame[:] = (points + 2.0 * (turned + w * dual_v - dual_w * v)).T
        return frames


class Flesh:
    """The smooth union of tapered capsules: the zero level of a soft minimum of their distances."""

    def __init__(self, capsules: Sequence[Capsule], blend: float) -> None:
        starts, ends, radii = zip(*capsules, strict=True)
        self._starts, self._radii, self._blend = np.array(starts), np.array(radii), blend
        self._spans = np.array(ends) - self._starts

    def nearest(self, points: Floats) -> Integers:
        """Return the index of the capsule nearest to each of `points` (k, 3)."""
        return np.asarray(np.argmin(self._distances(points)[0], axis=1))

    def project(self, points: Floats) -> Floats:
        """Return `points` (k, 3) moved by one Newton step towards the surface."""
        distances, lengths, along = self._distances(points)
        nearest = distances.min(axis=1, keepdims=True)
        shares = np.exp((nearest - distances) / self._blend)
        total = shares.sum(axis=1, keepdims=True)
        level = nearest - self._blend * np.log(total)
        pull = shares / (total * lengths)
        axis_points = pull @ self._starts + (pull * along) @ self._spans
        gradient = points * pull.sum(axis=1, keepdims=True) - axis_points
        return np.asarray(points - level * gradient / np.sum(gradient**2, axis=1, keepdims=True))

    def _distances(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Return (k, c) distances to the capsules and their axes, and places in 0..1 on these."""
        squared_span = np.sum(self._spans**2, axis=1)
        projected = points @ self._spans.T - np.sum(self._starts * self._spans, axis=1)
        along = np.clip(projected / squared_span, 0.0, 1.0)
        to_start = (
            np.sum(points**2, axis=1, keepdims=True)
            - 2.0 * points @ self._starts.T
            + np.sum(self._starts**2, axis=1)
        )
        squared = to_start + along * (along * squared_span - 2.0 * projected)
        lengths = np.sqrt(np.maximum(squared, 1e-12))
        growth = self._radii[:, 1] - self._radii[:, 0]
        return lengths - self._radii[:, 0] - along * growth, lengths, along


def wrapped(
    flesh: Flesh, owners: Sequence[int], boxes: ArrayLike, cell: float, diffusions: int
) -> Skin:
    """Return the surface of boxes of lattice cells, drawn onto flesh.

    Args:
        flesh: what the skin is drawn onto.
        owners: the bone of each capsule of the flesh.
        boxes: (b, 3, 2) where filled boxes begin and end along each axis, in cells.
        cell: the size of a cell.
        diffusions: how often weights are averaged over neighbours; joints bend that much softer.
    """
    corners, squares = _lattice_surface(np.array(boxes))
    neighbours = _neighbour_table(squares)
    vertices = corners.astype(np.float64) * cell
    for _ in range(_RELAXATIONS):
        vertices = flesh.project(_averaged(vertices, neighbours))
    weights = np.eye(max(owners) + 1)[np.array(owners)[flesh.nearest(vertices)]]
    for _ in range(diffusions):
        weights = _averaged(weights, neighbours)
    triangles = np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]])
    return Skin(vertices, triangles.astype(np.int32), weights)


def _lattice_surface(boxes: Integers) -> tuple[Integers, Integers]:
    """Return the corners (k, 3), in cells, and the squares (q, 4), outward, of filled `boxes`."""
    low, high = boxes[:, :, 0].min(axis=0) - 1, boxes[:, :, 1].max(axis=0) + 1
    filled = np.zeros(high - low, dtype=np.int8)
    for box in boxes - low[:, None]:
        filled[tuple(slice(*extent) for extent in box)] = 1
    unit = np.eye(3, dtype=np.int64)
    squares = []
    for axis in range(3):
        a, b = unit[(axis + 1) % 3], unit[(axis + 2) % 3]
        outward_up = np.array([0 * a, a, a + b, b])
        for step, ring in ((-1, outward_up), (1, outward_up[::-1])):
            cells = np.argwhere(np.diff(filled, axis=axis) == step) + unit[axis]
            squares.append(cells[:, None] + ring)
    corners, index = np.unique(np.concatenate(squares).reshape(-1, 3), axis=0, return_inverse=True)
    return corners + low, index.reshape(-1, 4)


def _neighbour_table(squares: Integers) -> Integers:
    """Return each vertex's neighbours (k, valence), short rows filled up with the vertex itself."""
    source = squares.ravel()
    order = np.argsort(source, kind="stable")
    valence = np.bincount(source)
    rank = np.arange(len(source)) - np.repeat(np.cumsum(valence) - valence, valence)
    table = np.repeat(np.arange(len(valence))[:, None], valence.max(), axis=1)
    table[source[order], rank] = np.roll(squares, -1, axis=1).ravel()[order]
    return table


def _averaged(values: Floats, neighbours: Integers) -> Floats:
    """Return each vertex's mean over its row of `neighbours`: one step of diffusion."""
    return np.asarray(np.mean([values[column] for column in neighbours.T], axis=0))


def rigid_motions(
    rotations: Sequence[Floats], shifts: Sequence[Floats], parents: Sequence[int | None]
) -> Floats:
    """Return dual quaternions (n, b, 8), each on its parent's side of the hypersphere.

    Args:
        rotations: (n, 3, 3) of each bone.
        shifts: (n, 3) of each bone: where the origin goes.
        parents: the number of the bone that carries it, of a lower number.
    """
    motions: list[Floats] = []
    for rotation, shift, parent in zip(rotations, shifts, parents, strict=True):
        q = _quaternions(rotation)
        if parent is not None:
            q[np.sum(q * motions[parent][:, :4], axis=1) < 0.0] *= -1.0
        w, v = q[:, :1], q[:, 1:]
        dual_w = -np.sum(shift * v, axis=1, keepdims=True)
        dual_v = w * shift + np.cross(shift, v)
        motions.append(np.concatenate([q, 0.5 * dual_w, 0.5 * dual_v], axis=1))
    return np.stack(motions, axis=1)


def _quaternions(rotations: Floats) -> Floats:
    """Return unit quaternions (n, 4), scalar first, of `rotations` (n, 3, 3)."""
    trace = np.trace(rotations, axis1=1, axis2=2)
    outer = np.empty((len(rotations), 4, 4))  # four times the quaternion's outer square
    outer[:, 0, 0] = 1.0 + trace
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        outer[:, i + 1, i + 1] = 1.0 - trace + 2.0 * rotations[:, i, i]
        outer[:, 0, i + 1] = outer[:, i + 1, 0] = rotations[:, k, j] - rotations[:, j, k]
        outer[:, i + 1, j + 1] = outer[:, j + 1, i + 1] = rotations[:, i, j] + rotations[:, j, i]
    longest = np.argmax(np.diagonal(outer, axis1=1, axis2=2), axis=1)
    rows = outer[np.arange(len(outer)), longest]
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


Keys = tuple[tuple[float, ...], ...]
"""Times, each with the values at that time."""


def track(times: Floats, keys: Keys) -> Floats:
    """Return (values, n) smooth paths through `keys`, held constant before and after.

    Piecewise cubic, monotone between keys (Fritsch and Butland 1984): constant values stay
    constant.
    """
    table = np.array(keys)
    knots, values = table[:, 0], table[:, 1:].T
    widths = np.diff(knots)
    secants = np.diff(values) / widths
    before, after = secants[:, :-1], secants[:, 1:]
    turning = before * after <= 0.0
    slopes = np.zeros_like(values)
    slopes[:, 1:-1] = 2.0 * before * after / np.where(turning, np.inf, before + after)
    i = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(widths) - 1)
    u = np.clip((times - knots[i]) / widths[i], 0.0, 1.0)
    eased = values[:, i] + np.diff(values)[:, i] * u * u * (3.0 - 2.0 * u)
    bulge = slopes[:, i] * (1.0 - u) - slopes[:, i + 1] * u
    return np.asarray(eased + widths[i] * u * (1.0 - u) * bulge)


def turn(axis: int, degrees: Floats) -> Floats:
    """Return rotations (n, 3, 3) about a coordinate axis."""
    angle = np.radians(degrees)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrices = np.zeros((len(angle), 3, 3))
    matrices[:, axis, axis] = 1.0
    matrices[:, i, i] = matrices[:, j, j] = np.cos(angle)
    matrices[:, j, i] = np.sin(angle)
    matrices[:, i, j] = -np.sin(angle)
    return matrices


def chained(joints: ArrayLike, parents: Sequence[int | None], turns: Sequence[Floats]) -> Floats:
    """Return the motions of bones (n, b, 8), dual quaternions, each turned in that of its parent.

    Args:
        joints: (b, 3) where each bone is joined to its parent at rest.
        parents: the number of each bone's parent, a lower one.
        turns: (n, 3, 3) of each bone.
    """
    rotations: list[Floats] = []
    shifts: list[Floats] = []
    for joint, parent, turned in zip(np.asarray(joints, float), parents, turns, strict=True):
        before = np.eye(3) if parent is None else rotations[parent]
        origin = np.zeros(3) if parent is None else shifts[parent]
        rotations.append(before @ turned)
        shifts.append(origin + (before - rotations[-1]) @ joint)
    return rigid_motions(rotations, shifts, parents)
