"""How far the points of depth images are from a mesh."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats, Positions
from ..scans import DepthScan
from ..topology import mean_edge_of, size_of, vertex_normals
from .background import without_planes

_EXAMINED = 10000
_POINTS = 500
"""So many points of a camera are searched for floor and walls; so many of the rest are compared."""

_SAMPLES = 5000
"""Of a surface; more take longer and change little."""

_JUMP = 6.0
"""Widths of a pixel on the surface, and medians of the differences of neighbours, beyond both of
which two neighbouring pixels see different things. A surface seen at 80 degrees stays below."""
_NEIGHBOURS = 2
"""A pixel with fewer neighbours is a stray one."""


class Surface:
    """A mesh whose vertices, or some of them, stand for the planes around them.

    Attributes:
        points: (n, 3) the vertices.
        faces: (m, 3) triangles.
        mean_edge: the mean length of the edges.
        size: the diagonal of the bounding box.
    """

    def __init__(self, faces: NDArray[np.integer[Any]], points: Positions) -> None:
        self.faces = faces
        self.points = points.astype(np.float64)
        self.mean_edge = mean_edge_of(self.points, faces)
        self.size = size_of(self.points)
        normals = vertex_normals(faces, self.points)
        used = np.flatnonzero(normals.any(axis=1))
        every = 1 + (len(used) - 1) // _SAMPLES
        self._samples, self._normals = self.points[used[::every]], normals[used[::every]]
        self._reach = self.mean_edge / 2 * np.sqrt(every)  # half of the way between two, about

    def distances(self, points: Floats) -> Floats:
        """Returns how far (n, 3) points are from the surface, about."""
        heights, _, aside = self.feet(points)
        return np.asarray(np.hypot(heights, np.maximum(aside - self._reach, 0)))

    def feet(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Returns the nearest planes of (n, 3) points.

        Returns:
            (n,) how high each point is above its plane, (n, 3) the normal of that, and (n,) how far
            aside the vertex is that stands for it.
        """
        middle = self._samples.mean(axis=0)
        ours, theirs = ((one - middle).astype(np.float32) for one in (points, self._samples))
        best = ((theirs**2).sum(axis=1) - 2 * ours @ theirs.T).argmin(axis=1)
        apart, normals = points - self._samples[best], self._normals[best]
        heights = (apart * normals).sum(axis=1)
        aside = np.sqrt(np.maximum((apart**2).sum(axis=1) - heights**2, 0))
        return heights, normals, aside


def without_jumps(scan: DepthScan) -> DepthScan:
    """Returns a scan without pixels at jumps of the depth, and without stray ones.

    At jumps, sensors measure points between what is before and what is behind.
    """
    images = []
    for depth, intrinsics in zip(scan.depth, scan.intrinsics, strict=True):
        padded = np.pad(depth, 1)
        beside = np.stack(
            [padded[1:-1, :-2], padded[1:-1, 2:], padded[:-2, 1:-1], padded[2:, 1:-1]]
        )
        both = (depth > 0) & (beside > 0)
        apart = np.where(both, np.abs(beside - depth), 0)
        usual = float(np.median(apart[both])) if both.any() else 0.0
        widths = depth / min(abs(intrinsics[0, 0]), abs(intrinsics[1, 1]))
        jumps = (apart > _JUMP * np.maximum(widths, usual)).any(axis=0)
        sound = ~jumps & (both.sum(axis=0) >= _NEIGHBOURS)
        images.append(np.where(sound, depth, 0).astype(depth.dtype))
    return scan._replace(depth=images)


def subject_of(cloud: Floats, surface: Surface) -> Floats:
    """Returns some of the points of a camera, without floor and walls."""
    some = cloud[:: 1 + len(cloud) // _EXAMINED]
    left = without_planes(some, thickness=surface.mean_edge, size=surface.size)
    return np.asarray(left[:: 1 + len(left) // _POINTS], np.float64)
