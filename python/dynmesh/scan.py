"""A frame as scanners deliver it: loose points, or depth images. No vertex is named."""

from collections.abc import Callable
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats, Mask, Positions

_INSIDE_OUT = -0.2
"""The cosine between normals and the directions from the middle: about 0 for flat parts."""


class _Coloured:
    """A tuple of attributes that has colours beside them."""

    colours: Any
    _asdict: Callable[[], dict[str, Any]]

    def _replace(self, **changed: Any) -> Self:
        return type(self)(**{**self._asdict(), "colours": self.colours, **changed})


class _Points(NamedTuple):
    points: Positions
    normals: Positions | None
    viewpoints: Positions | None


class PointScan(_Coloured, _Points):
    """The points of a frame, in no order: ``points, normals, viewpoints = scan``.

    Attributes:
        points: (n, 3) positions; n may be 0, and differs from frame to frame.
        normals: (n, 3) unit normals of the surface on the side that was seen, or None.
        viewpoints: (c, 3) the positions of the cameras, or None if they are unknown.
        colours: (n, 3) the colours of the points, or None.
    """

    colours: Positions | None

    def __new__(
        cls,
        points: Positions,
        normals: Positions | None,
        viewpoints: Positions | None,
        colours: Positions | None = None,
    ) -> Self:
        """Takes the attributes in their order."""
        scan = super().__new__(cls, points, normals, viewpoints)
        scan.colours = colours
        return scan

    @property
    def cloud(self) -> Positions:
        """(n, 3) all points."""
        return self.points

    @property
    def clouds(self) -> list[Positions]:
        """The same, as if one camera had seen all points."""
        return [self.points]

    @property
    def depths(self) -> Floats:
        """(n,) how far each point is from the nearest camera; 0 if cameras are unknown."""
        if self.viewpoints is None or len(self.viewpoints) == 0:
            return np.zeros(len(self.points))
        away = (np.linalg.norm(self.points - place, axis=1) for place in self.viewpoints)
        return np.asarray(np.min(list(away), axis=0), np.float64)

    @property
    def has_points(self) -> bool:
        """Whether there is a point."""
        return len(self.points) > 0

    def scaled(self, factor: float) -> "PointScan":
        """Returns the scan in another unit of length."""
        viewpoints = None if self.viewpoints is None else _times(self.viewpoints, factor)
        return self._replace(points=_times(self.points, factor), viewpoints=viewpoints)

    def only(self, kept: Mask) -> "PointScan":
        """Returns the scan with the points of the cloud that (n,) `kept` names."""
        normals = None if self.normals is None else self.normals[kept]
        colours = None if self.colours is None else self.colours[kept]
        return PointScan(self.points[kept], normals, self.viewpoints, colours)


class _Images(NamedTuple):
    depth: list[NDArray[np.float32]]
    intrinsics: list[Floats]
    poses: list[Floats]


class DepthScan(_Coloured, _Images):
    """The depth images of a frame: ``depth, intrinsics, poses = scan``.

    There is one of each camera that delivered one.

    Attributes:
        depth: (h, w) float32 each: distances along the optical axis, 0 where nothing was measured.
        intrinsics: (3, 3) each: from camera coordinates to pixels; the centre of the first pixel is
            at (0, 0).
        poses: (4, 4) each: from camera coordinates, x right, y down, z ahead, to the world.
        colours: (h, w, 3) uint8 each: the colours of the same pixels; or None.
    """

    colours: list[NDArray[np.uint8]] | None

    def __new__(
        cls,
        depth: list[NDArray[np.float32]],
        intrinsics: list[Floats],
        poses: list[Floats],
        colours: list[NDArray[np.uint8]] | None = None,
    ) -> Self:
        """Takes the attributes in their order."""
        scan = super().__new__(cls, depth, intrinsics, poses)
        scan.colours = colours
        return scan

    @property
    def cloud(self) -> Positions:
        """(n, 3) the points of all images in the world, float64."""
        return np.concatenate([np.zeros((0, 3)), *self.clouds])

    @property
    def depths(self) -> Floats:
        """(n,) the depth of each point of the cloud."""
        return np.concatenate([np.zeros(0), *(depth[depth > 0] for depth in self.depth)])

    @property
    def has_points(self) -> bool:
        """Whether a pixel measured anything."""
        return any(bool(depth.any()) for depth in self.depth)

    @property
    def clouds(self) -> list[Floats]:
        """(n, 3) each: the points of each image."""
        clouds = []
        for depth, intrinsics, pose in zip(*self, strict=True):
            row, column = np.nonzero(depth > 0)
            pixels = np.stack([column, row, np.ones_like(row)], axis=1)
            local = pixels @ np.linalg.inv(intrinsics).T * depth[row, column][:, None]
            clouds.append(local @ pose[:3, :3].T + pose[:3, 3])
        return clouds

    def scaled(self, factor: float) -> "DepthScan":
        """Returns the scan in another unit of length."""
        to_unit = np.array([[1, 1, 1, factor]] * 3 + [[1, 1, 1, 1]])
        poses = [pose * to_unit for pose in self.poses]
        return self._replace(depth=[_times(depth, factor) for depth in self.depth], poses=poses)

    def only(self, kept: Mask) -> "DepthScan":
        """Returns the scan with the points of the cloud that (n,) `kept` names."""
        images, first = [], 0
        for depth in self.depth:
            row, column = np.nonzero(depth > 0)
            left = np.zeros_like(depth)
            own = kept[first : first + len(row)]
            left[row[own], column[own]] = depth[row[own], column[own]]
            images.append(left)
            first += len(row)
        return self._replace(depth=images)


Scan = PointScan | DepthScan


def parts_of(given: Any) -> tuple[Any, Any, Any]:
    """The points, normals and viewpoints of a PointScan, a pair of the first two, or points alone.

    None stands for what is not given.
    """
    is_pair = isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == 2
    parts = given if is_pair or isinstance(given, PointScan) else (given,)
    points, normals, viewpoints = (*parts, None, None)[:3]
    return points, normals, viewpoints


def inside_out(scan: Scan) -> str:
    """Says that normals point to the middle of the points, as those of no body do; else, empty."""
    if not isinstance(scan, PointScan) or scan.normals is None or not scan.has_points:
        return ""
    arms = scan.points - scan.points.mean(axis=0)
    outwards, most = (scan.normals * arms).sum(), np.linalg.norm(arms, axis=1).sum()
    message = "the normals of the scan point inwards; turn them, or leave them out"
    return message if outwards < _INSIDE_OUT * most else ""


def _times(values: NDArray[Any], factor: float) -> NDArray[Any]:
    return values if factor == 1 else (values * factor).astype(values.dtype)
