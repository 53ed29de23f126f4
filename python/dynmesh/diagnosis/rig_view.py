"""What each camera of a rig sees in one scan."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files.scans import PointScan, ScanCamera, ScanReader
from ..files.scans.reader import DepthReader
from .planes import planes_of_room

_Floats = NDArray[np.float64]

_EXAMINED = 20_000
"""Points of a view that are kept."""


@dataclass(frozen=True, eq=False)
class View:
    """What one camera sees in a scan; of a point cloud, all its points.

    Attributes:
        camera: as it is meant; None for a point cloud.
        measured: number of pixels or points.
        rays: (n, 3) columns, rows and ones of some pixels, times their depths; or the points.
        image: (h, w) the depths, 0 where nothing was measured; without pixels for a point cloud.
    """

    camera: ScanCamera | None
    measured: int
    rays: _Floats
    image: NDArray[np.float32]

    @property
    def name(self) -> str:
        """Of the camera."""
        return "" if self.camera is None else self.camera.name

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the image."""
        return self.image.shape[1], self.image.shape[0]

    def of(self, kept: Any) -> "View":
        """Returns some of the points."""
        return replace(self, rays=self.rays[kept])

    def some(self, wanted: int) -> "View":
        """Returns about so many of the points, evenly by their numbers."""
        n = len(self.rays)
        return self if n <= wanted else self.of(np.linspace(0, n - 1, wanted).astype(np.int64))

    @property
    def local(self) -> _Floats:
        """(n, 3) the points in the axes of the camera, or of a point cloud."""
        if self.camera is None:
            return self.rays
        return np.asarray(self.rays @ np.linalg.inv(np.asarray(self.camera.intrinsics)).T)

    def cloud(self, camera: ScanCamera | None, focal: float = 1.0) -> _Floats:
        """Returns (n, 3) points, in the unit of the scans, seen by this camera instead.

        `focal` is what the focal length is multiplied by.
        """
        if camera is None or self.camera is None:
            return self.local
        scale = (camera.depth_scale or 1.0) / (self.camera.depth_scale or 1.0)
        local = replace(self, camera=camera).local * scale
        local[:, :2] /= focal
        return np.asarray(local @ camera.camera_to_world[:3, :3].T + camera.camera_to_world[:3, 3])

    def without_room(self, camera: ScanCamera | None, size: float, thickness: float) -> "View":
        """Returns the view without floor and walls, planes that are larger than this size.

        They are sought in the axes of the camera, where no mistake in a pose moves them, with the
        intrinsics of the one that is given.
        """
        points = self.local if camera is None else replace(self, camera=camera).local
        planes = planes_of_room(points, thickness=thickness, size=size)
        on_one = [np.zeros(len(points), np.bool_), *(plane.holds(points) for plane in planes)]
        return self.of(~np.logical_or.reduce(on_one))


def views_of(reader: ScanReader, number: int) -> list[View]:
    """Returns what each camera sees in a frame, counted from 0."""
    if isinstance(reader, DepthReader):
        return [_view(camera, depth) for camera, depth in reader.images(number)]
    (scan,) = reader.frames(number, number + 1)
    if not isinstance(scan, PointScan):
        return []
    points, nothing = scan.points.astype(np.float64), np.zeros((0, 0), np.float32)
    return [View(None, len(points), points, nothing).some(_EXAMINED)]


def _view(camera: ScanCamera, depth: NDArray[np.float32]) -> View:
    row, column = np.nonzero(depth > 0)
    rays = np.stack([column, row, np.ones_like(row)], axis=1) * depth[row, column, None]
    return View(camera, len(row), rays.astype(np.float64), depth).some(_EXAMINED)
