r"""What a lens does to images: the distortion of Brown (1966) and Conrady, rational as in OpenCV.

With $x$, $y$ the coordinates of a point over its depth and $r^2 = x^2 + y^2$, it appears at

$$x' = x g + 2 p_1 x y + p_2 (r^2 + 2 x^2), \quad y' = y g + p_1 (r^2 + 2 y^2) + 2 p_2 x y, \quad
g = \frac{1 + k_1 r^2 + k_2 r^4 + k_3 r^6}{1 + k_4 r^2 + k_5 r^4 + k_6 r^6}$$
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]

COUNTS = (4, 5, 8)
"""Numbers of coefficients: k1 k2 p1 p2, then k3, then k4 k5 k6."""

WIDEST = 4.0
"""Distances from the optical axis over depths, up to which images are looked at: 152 degrees."""

_MOST_STRETCHED = 4.0
"""How many times as far from the axis an undistorted point may be."""

_DIRECTIONS = 256
_STEPS = 512
"""At which a distortion is followed from the centre of the image outwards."""


@dataclass(frozen=True, eq=False)
class Lens:
    """A distortion, and how it is undone for images of one size.

    Attributes:
        intrinsics: (3, 3) of the distorted images.
        coefficients: k1 k2 p1 p2 [k3 [k4 k5 k6]], as OpenCV orders them.
        size: width and height of the images.
        radius: up to which distance over depth it is valid.
    """

    intrinsics: _Floats
    coefficients: tuple[float, ...]
    size: tuple[int, int]
    radius: float = WIDEST

    def __post_init__(self) -> None:
        """Follows the distortion to the borders of the image.

        Raises:
            ValueError: it folds over before, or the optical axis does not meet the image.
        """
        centre = self.intrinsics[:2, 2]
        if not ((centre > 0) & (centre < np.array(self.size) - 1)).all():
            raise ValueError(
                f"cx, cy = {centre[0]:g}, {centre[1]:g} is not within the image of "
                f"{self.size[0]} x {self.size[1]} pixels, as needed to undo it"
            )
        if np.isnan(self._reach).any():
            raise ValueError(
                "folds over within the image of "
                f"{self.size[0]} x {self.size[1]} pixels: two directions have one pixel"
            )

    def scaled(self, to_new: _Floats, size: tuple[int, int]) -> "Lens":
        """Returns the lens for images of another size; (3, 3) `to_new` maps pixels to theirs."""
        return Lens(to_new @ self.intrinsics, self.coefficients, size, self.radius)

    @cached_property
    def undistorted(self) -> _Floats:
        """(3, 3) the intrinsics of the undistorted images, of the same size.

        They show everything, at most as large as before.
        """
        angles = np.linspace(-np.pi, np.pi, _DIRECTIONS, endpoint=False)
        ends = self._reach[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        low, high = ends.min(axis=0), ends.max(axis=0)
        focal = np.minimum(np.diag(self.intrinsics)[:2], np.array(self.size) / (high - low))
        centre = (np.array(self.size) - 1) / 2 - focal * (low + high) / 2
        return np.array([[focal[0], 0, centre[0]], [0, focal[1], centre[1]], [0, 0, 1.0]])

    def undo(self, image: NDArray[Any]) -> NDArray[Any]:
        """Returns the undistorted image, whose pixels are the nearest ones, or 0 outside.

        Nothing is interpolated, as between two depths there need not be any surface.
        """
        row, column = self._source
        found = image[row, column]
        found[row < 0] = 0
        return found

    @cached_property
    def _source(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """(h, w) the row and column of each undistorted pixel, -1 where there is none."""
        width, height = self.size
        focal, centre = np.diag(self.undistorted)[:2], self.undistorted[:2, 2]
        y, x = np.mgrid[:height, :width].astype(np.float64)
        points = (np.stack([x, y], axis=-1) - centre) / focal
        angles = np.linspace(-np.pi, np.pi, _DIRECTIONS, endpoint=False)
        angle = np.arctan2(points[..., 1], points[..., 0])
        reach = np.interp(angle, angles, self._reach, period=2 * np.pi)
        pixels = np.rint(self._pixels(points)).astype(np.int64)
        inside = (np.hypot(points[..., 0], points[..., 1]) <= reach) & (pixels >= 0).all(axis=-1)
        inside &= (pixels < (width, height)).all(axis=-1)
        pixels[~inside] = -1
        return pixels[..., 1].astype(np.int32), pixels[..., 0].astype(np.int32)

    @cached_property
    def _reach(self) -> _Floats:
        """(d,) in each direction, the distance at which the image ends; NaN if it folds before."""
        angles = np.linspace(-np.pi, np.pi, _DIRECTIONS, endpoint=False)
        corners = np.array([[x, y, 1.0] for x in (0, self.size[0]) for y in (0, self.size[1])])
        corner = np.linalg.norm((corners @ np.linalg.inv(self.intrinsics).T)[:, :2], axis=1).max()
        farthest = min(self.radius, WIDEST, _MOST_STRETCHED * corner)
        radii = np.linspace(0, farthest, _STEPS + 1)[1:]
        points = radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)[:, None]
        with np.errstate(all="ignore"):
            pixels = self._pixels(points)
            width, height = self.size
            inside = (pixels > -0.5) & (pixels < np.array([width, height]) - 0.5)
            outside = np.logical_not(inside.all(axis=-1))
            step = 1e-5
            along_x = self._pixels(points + np.array([step, 0])) - pixels
            along_y = self._pixels(points + np.array([0, step])) - pixels
            area = along_x[..., 0] * along_y[..., 1] - along_x[..., 1] * along_y[..., 0]
        ends = np.where(outside.any(axis=1), outside.argmax(axis=1), _STEPS - 1)
        folds = ~(area > 0)
        first = np.where(folds.any(axis=1), folds.argmax(axis=1), _STEPS)
        return np.where(first <= ends, np.nan, radii[ends])

    def _pixels(self, points: _Floats) -> _Floats:
        """Returns (..., 2) where (..., 2) undistorted points over depth appear."""
        k1, k2, p1, p2, k3, k4, k5, k6 = (*self.coefficients, *(0.0,) * 4)[:8]
        x, y = points[..., 0], points[..., 1]
        r = x * x + y * y
        g = (1 + r * (k1 + r * (k2 + r * k3))) / (1 + r * (k4 + r * (k5 + r * k6)))
        seen_x = x * g + 2 * p1 * x * y + p2 * (r + 2 * x * x)
        seen_y = y * g + p1 * (r + 2 * y * y) + 2 * p2 * x * y
        seen = np.stack([seen_x, seen_y, np.ones_like(x)], axis=-1)
        return np.asarray((seen @ self.intrinsics.T)[..., :2])
