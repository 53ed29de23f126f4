"""Normals, velocities and accelerations, computed from the positions of the frames."""

from collections import deque
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..polygons import Polygons
from ..sequence import Positions

Vectors = NDArray[np.float64]


class Normals:
    """Unit normals of a mesh, computed for one frame after another.

    The corners of a face run counter-clockwise around its normal. At a vertex, each face is
    weighted with its angle there, so the result does not depend on how the surface is triangulated.
    A normal is 0 if no face defines it, and NaN if the position is.
    """

    def __init__(
        self, polygons: Polygons, how: str, shared: NDArray[np.integer[Any]] | None = None
    ) -> None:
        """Takes one of :data:`dynmesh._checks.normals_may_be`, except "blocked".

        Corners of which `shared` is the same number have the normal of that number, where the
        normals are of vertices; None means those of the same vertex.
        """
        *adjectives, self._interpolation = how.split()
        self._is_flat = "flat" in adjectives or self._interpolation == "uniform"
        self._sign = -1.0 if "reversed" in adjectives else 1.0
        sizes = polygons.sizes.astype(np.intp)
        self._corners = polygons.corners.astype(np.intp)
        self._shared = None if shared is None else shared.astype(np.intp)
        self._begins = np.cumsum(sizes) - sizes
        self._face = np.repeat(np.arange(len(sizes)), sizes)  # the face of each corner
        begin, size = self._begins[self._face], sizes[self._face]
        place = np.arange(len(self._corners)) - begin
        self._next = begin + (place + 1) % size
        self._previous = begin + (place - 1) % size

    @np.errstate(invalid="ignore", over="ignore")
    def of(self, points: Positions) -> NDArray[np.float32]:
        """Returns (k, 3), (faces, 3) or (corners, 3) for the positions (k, 3) of one frame.

        With `shared`, as many as its largest number and one more.
        """
        corners = points[self._corners].astype(np.float64)
        faces = self._of_faces(corners)
        if self._interpolation == "uniform":
            normals = faces
        elif self._is_flat:
            normals = faces[self._face]
        else:
            normals = self._of_vertices(points, corners, faces)
            if self._interpolation == "faceVarying":
                normals = normals[self._corners]
        return (self._sign * normals).astype(np.float32)

    def _of_faces(self, corners: Vectors) -> Vectors:
        arms = corners - corners[self._begins[self._face]]
        areas = np.cross(arms, arms[self._next])
        return _of_length_1(np.add.reduceat(areas, self._begins))

    def _of_vertices(self, points: Positions, corners: Vectors, faces: Vectors) -> Vectors:
        ahead, behind = corners[self._next] - corners, corners[self._previous] - corners
        sine = np.linalg.norm(np.cross(ahead, behind), axis=1)
        angles = np.arctan2(sine, np.einsum("cx,cx->c", ahead, behind))
        shares = np.nan_to_num(faces[self._face] * angles[:, None])
        if self._shared is not None:
            sums = [np.bincount(self._shared, shares[:, x]) for x in range(3)]
            return _of_length_1(np.stack(sums, axis=1))
        sums = [np.bincount(self._corners, shares[:, x], len(points)) for x in range(3)]
        normals = _of_length_1(np.stack(sums, axis=1))
        normals[~np.isfinite(points).all(axis=1)] = np.nan
        return normals


def _of_length_1(vectors: Vectors) -> Vectors:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(lengths == 0, 1, lengths))


def layout_of(
    normals: NDArray[Any],
    interpolation: str,
    polygons: Polygons,
    points: Positions,
    *,
    reversed_if_unknown: bool,
) -> str:
    """Determines how the normals of a frame follow from its positions; see :class:`Normals`.

    The result is "blocked" if they do not, since the normals of a vertex differ between faces or
    their number is wrong. Normals that point against the order of the corners are reversed; if no
    normal is finite, `reversed_if_unknown` decides.
    """
    counts = {
        "vertex": len(points),
        "varying": len(points),
        "uniform": len(polygons.sizes),
        "faceVarying": len(polygons.corners),
    }
    if normals.dtype.kind != "f" or normals.shape != (counts.get(interpolation), 3):
        return "blocked"
    how = interpolation
    if interpolation == "faceVarying":
        faces = np.repeat(np.arange(len(polygons.sizes)), polygons.sizes)
        if not _same_within(polygons.corners, normals):
            if not _same_within(faces, normals):
                return "blocked"
            how = "flat faceVarying"
    agreement = np.nansum(normals * Normals(polygons, how).of(points), axis=1)
    against = agreement.sum() < 0 if agreement.any() else reversed_if_unknown
    return f"reversed {how}" if against else how


def _same_within(groups: NDArray[np.integer[Any]], normals: NDArray[Any]) -> bool:
    """Whether all corners in a group have the same normal, up to rounding."""
    there = np.isfinite(normals).all(axis=1)
    _, first, group = np.unique(groups[there], return_index=True, return_inverse=True)
    normals = normals[there]
    return np.allclose(normals, normals[first][group], rtol=0, atol=0.01)


Motion = tuple[Literal["velocities", "accelerations"], int, NDArray[np.float32]]
"""Vectors and the number of their frame."""


class Motions:
    """Velocities and accelerations of consecutive frames.

    They are those of the parabola through a frame and its two neighbours. The first and the last
    frame have the mean velocity to their neighbour, and its acceleration. Therefore a single frame
    has no velocity, and two frames have no acceleration. At most two frames are stored.
    """

    def __init__(self, seconds: Vectors) -> None:
        """Takes the time of every frame."""
        self._seconds = seconds
        self._number = 0
        self._before: Vectors | None = None
        self._velocities: deque[Vectors] = deque(maxlen=2)  # from each frame to the next

    @np.errstate(invalid="ignore", over="ignore")
    def push(self, points: Positions) -> Iterator[Motion]:
        """Takes the positions of the next frame and yields what can be computed now."""
        now, last = self._number, len(self._seconds) - 1
        after = points.astype(np.float64)
        if self._before is not None:
            step = self._seconds[now] - self._seconds[now - 1]
            velocity = (after - self._before) / step
            self._velocities.append(velocity)
            if now == 1:
                yield "velocities", 0, velocity.astype(np.float32)
            else:
                yield from self._of_middle(now - 1)
            if now == last:
                yield "velocities", now, velocity.astype(np.float32)
        self._before = after
        self._number += 1

    def _of_middle(self, frame: int) -> Iterator[Motion]:
        before, after = self._velocities
        earlier, later = np.diff(self._seconds[frame - 1 : frame + 2])
        mean = (later * before + earlier * after) / (earlier + later)
        yield "velocities", frame, mean.astype(np.float32)
        change = ((after - before) * 2 / (earlier + later)).astype(np.float32)
        ends = {0: frame == 1, len(self._seconds) - 1: frame == len(self._seconds) - 2}
        for number in (frame, *(end for end, is_next in ends.items() if is_next)):
            yield "accelerations", number, change
