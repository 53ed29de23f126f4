"""How far the scans of cameras agree with one another and with a template.

Cameras that see one subject must agree: where one sees a surface, no other may see through it. A
template tells what they cannot. If a single camera has another pose, a template may have that pose
as well, so only one that lies where the points are tells anything of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats, Positions
from ..alignment import find_alignment
from ..scans import DepthScan
from ..topology import mean_edge_of, size_of_surface, vertex_normals
from ..tracking.background import without_planes

_EXAMINED = 10000
_POINTS = 500
"""So many points of a camera are searched for floor and walls; so many are compared."""

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
        size: the diagonal of its bounding box.
    """

    def __init__(self, faces: NDArray[np.integer[Any]], points: Positions) -> None:
        self.faces = faces
        self.points = points.astype(np.float64)
        self.mean_edge = mean_edge_of(self.points, faces)
        self.size = size_of_surface(faces, self.points)
        normals = vertex_normals(faces, self.points)
        used = np.flatnonzero(normals.any(axis=1))
        every = 1 + (len(used) - 1) // _SAMPLES
        self._samples, self._normals = self.points[used[::every]], normals[used[::every]]
        self._reach = self.mean_edge / 2 * np.sqrt(every)  # half of the way between two, about

    def distances(self, points: Floats) -> Floats:
        """Returns how far (n, 3) points are from the surface, about: from the nearest planes."""
        middle = self._samples.mean(axis=0)
        ours, theirs = ((one - middle).astype(np.float32) for one in (points, self._samples))
        best = ((theirs**2).sum(axis=1) - 2 * ours @ theirs.T).argmin(axis=1)
        apart = points - self._samples[best]
        heights = (apart * self._normals[best]).sum(axis=1)
        aside = np.sqrt(np.maximum((apart**2).sum(axis=1) - heights**2, 0))
        return np.asarray(np.hypot(heights, np.maximum(aside - self._reach, 0)))


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


_NEAR = 0.02
"""What cameras measure may differ by this share of what each of them sees."""

_FAR, _FAR_EDGES = 0.01, 0.5
"""A point is far from the template beyond this share of its diagonal and of its mean edge."""
_COVERED = 0.3
"""If the points of no camera extend over this share of the template, all of them count as far:
with a depth that is far too small, they fall on one place, which may lie on the surface."""
_FEWEST = 60

_FIT = 0.12
"""Cameras fit if each has at most this share of points that others contradict, and of far ones: of
right ones, 10 % were with outliers or a room, and of one turned by 4 degrees about its axis, 14."""
_LESS = 0.5
"""A reading is better if it leaves at most this share of the wrong points: a part of a room may be
left."""


@dataclass(frozen=True)
class Fit:
    """How far scans agree with one another and with a template.

    Attributes:
        cameras: the names of those of the first scan.
        apart: of the points of each camera, the share that another one contradicts, in whose image
            they are: it sees through them, or nothing there. Empty of a single camera.
        far: of each camera, the share of its points in the first scan that are far from the
            template, moved rigidly if there are several cameras; of a single camera that moves, in
            all scans. Empty without one.
    """

    cameras: tuple[str, ...]
    apart: tuple[float, ...] = ()
    far: tuple[float, ...] = ()

    @property
    def wrong(self) -> float:
        """By what readings are compared: the mean shares of what is wrong, added."""
        return sum(float(np.mean(shares)) for shares in (self.apart, self.far) if shares)

    @property
    def is_good(self) -> bool:
        """Whether there is anything to compare with, and cameras see the same as that."""
        return max((*self.apart, *self.far), default=1.0) <= _FIT

    def is_better_than(self, other: "Fit") -> bool:
        """Whether cameras agree, or a single one fits, and clearly less is wrong."""
        return max(self.apart or self.far) <= _FIT and self.wrong <= _LESS * other.wrong

    @property
    def each(self) -> list[str]:
        """The cameras with the shares of their points."""
        every = {"contradict another camera": self.apart, "are far from the template": self.far}
        return [
            f"camera {name}"
            + "".join(f", {of[n]:.1%} of its points {what}" for what, of in every.items() if of)
            for n, name in enumerate(self.cameras)
        ]


def _far_from(surface: Surface, scan: DepthScan, *, moves: bool) -> tuple[float, ...]:
    """The share of far points of each camera; with `moves`, after the rigid motion of tracking."""
    clouds = []
    for cloud in scan.clouds:
        some = cloud[:: 1 + len(cloud) // _EXAMINED]
        left = without_planes(some, thickness=surface.mean_edge, size=surface.size)
        clouds.append(np.asarray(left[:: 1 + len(left) // _POINTS], np.float64))
    points = np.concatenate(clouds)
    extents = [np.linalg.norm(np.ptp(cloud, axis=0)) for cloud in clouds if len(cloud)]
    if len(points) < _FEWEST or max(extents) < _COVERED * surface.size:
        return (1.0,) * len(clouds)
    most = max(_FAR * surface.size, _FAR_EDGES * surface.mean_edge)
    far = surface.distances(points) > most
    if moves:
        result = find_alignment(surface.faces, surface.points, points)
        moved = surface.distances((points - result.shift) @ result.rotation) > most
        far = min(far, moved, key=np.mean)
    each = np.split(far, np.cumsum([len(cloud) for cloud in clouds])[:-1])
    return tuple(float(np.mean(own)) if len(own) else 0.0 for own in each)


def _seen_by_others(scan: DepthScan) -> NDArray[np.int64]:
    """Counts how often points of each camera are in others' images, and contradicted, (c, 2)."""
    counts = np.zeros((len(scan.depth), 2), np.int64)
    nearest = []  # the least depth around each pixel; infinite where nothing is measured
    for depth in scan.depth:
        padded = np.pad(np.where(depth > 0, depth, np.inf), 2, constant_values=np.inf)
        nearest.append(np.lib.stride_tricks.sliding_window_view(padded, (5, 5)).min(axis=(2, 3)))
    for one, cloud in enumerate(scan.clouds):
        some = cloud[:: 1 + len(cloud) // _POINTS]
        if not len(some):
            continue
        near = _NEAR * float(np.linalg.norm(np.ptp(np.quantile(some, (0.05, 0.95), 0), axis=0)))
        for other, depth in enumerate(nearest):
            if other == one:
                continue
            pose = scan.poses[other]
            local = (some - pose[:3, 3]) @ np.linalg.inv(pose[:3, :3]).T
            local = local[local[:, 2] > 0]
            pixels = local @ np.asarray(scan.intrinsics[other]).T
            column, row = np.rint(pixels[:, :2] / pixels[:, 2:]).T
            inside = (row >= 0) & (row < depth.shape[0]) & (column >= 0) & (column < depth.shape[1])
            there = depth[row[inside].astype(int), column[inside].astype(int)]
            counts[one] += len(there), np.count_nonzero(local[inside, 2] < there - near)
    return counts


def fit_of(
    scans: Sequence[DepthScan], cameras: Sequence[str], surface: Surface | None, *, moves: bool
) -> Fit:
    """Compares scans, in the unit of the template, with one another and with the template.

    `moves` tells whether cameras do.
    """
    fit, is_single = Fit(tuple(cameras)), len(cameras) == 1
    scans = [without_jumps(scan) for scan in scans]
    if not is_single:
        counts = [_seen_by_others(scan) for scan in scans if len(scan.depth) == len(cameras)]
        seen, against = np.sum(counts, axis=0).T
        apart = np.where(seen > 0, against / np.maximum(seen, 1), 1.0)
        fit = replace(fit, apart=tuple(apart.tolist()))
    if surface is not None:
        compared = scans if is_single and moves else scans[:1]
        each = [_far_from(surface, scan, moves=not is_single) for scan in compared]
        fit = replace(fit, far=tuple(np.mean(each, axis=0).tolist()))
    return fit
