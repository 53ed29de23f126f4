"""What a camera measures at the centres of its pixels: distances, and the triangles they belong to.

The ray through the centre of a pixel is intersected with every triangle whose image covers it, so
depths are exact at the centres, and triangles that cross the plane of the camera need no clipping.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..sequence import Positions
from .rays import TOLERANCE, Triangles, in_axes, portions, ranges, rows_of
from .visibility import Camera, axes_of

_Integers = NDArray[np.integer[Any]]
_Floats = NDArray[np.float64]


class DepthBuffer(NamedTuple):
    """The nearest triangle of each pixel.

    Attributes:
        depth: (h, w) distances along the optical axis, infinite where there is no triangle.
        triangle: (h, w) its number, or -1.
        weights: (h, w, 3) the shares of its corners in the point that was hit.
    """

    depth: _Floats
    triangle: _Integers
    weights: _Floats


def intrinsics_of(camera: Camera, width: int, height: int) -> _Floats:
    """Returns the (3, 3) matrix from camera coordinates to pixels, with square pixels.

    The centre of the first pixel is at (0, 0), and the field of view of the camera is that from the
    lower to the upper edge of the image.
    """
    focal = height / 2 / math.tan(math.radians(camera.field_of_view) / 2)
    return np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])


def pose_of(camera: Camera) -> _Floats:
    """Returns the (4, 4) matrix from camera coordinates, x right, y down, z ahead, to the world."""
    pose = np.eye(4)
    pose[:3, :3] = axes_of(camera) * [1, -1, 1]
    pose[:3, 3] = camera.position
    return pose


def depth_buffer(
    points: Positions, faces: _Integers, camera: Camera, width: int, height: int
) -> DepthBuffer:
    """Renders a mesh, of which both sides of a triangle are seen.

    A triangle with a corner that is not finite is not there.
    """
    pose = pose_of(camera)
    # x and y of the image, both multiplied by the depth, and the depth.
    local = in_axes(points, pose[:3, 3], pose[:3, :3]) @ intrinsics_of(camera, width, height).T
    depth = np.full(height * width, np.inf)
    triangle = np.full(height * width, -1)
    weights = np.zeros((height * width, 3))
    for pixel, number, near, shares in _hits(local[faces.T], width, height):
        nearer = near < depth[pixel]
        pixel, number, near = pixel[nearer], number[nearer], near[nearer]
        # Of several values for one pixel, NumPy keeps the last; here it is the nearest.
        order = np.lexsort((-number, -near))
        depth[pixel[order]] = near[order]
        triangle[pixel[order]] = number[order]
        weights[pixel[order]] = shares[nearer][order]
    shape = (height, width)
    return DepthBuffer(depth.reshape(shape), triangle.reshape(shape), weights.reshape(*shape, 3))


def _hits(
    corners: _Floats, width: int, height: int
) -> Iterator[tuple[_Integers, _Integers, _Floats, _Floats]]:
    """Intersects the rays of the pixels with triangles, whose (3, m, 3) corners are in pixels.

    Yields pixels, the triangle that the ray of each hits, its depth, and the shares of its corners.
    """
    last = np.array([width - 1, height - 1])
    triangles = Triangles(corners, 0, last)
    low = np.ceil(np.clip(triangles.low, 0, last) - TOLERANCE).astype(np.int64)
    high = np.floor(np.clip(triangles.high, 0, last) + TOLERANCE).astype(np.int64)
    triangle, row = rows_of(low[:, 1], high[:, 1])
    lengths = (high - low)[triangle, 0] + 1
    for run in portions(lengths):
        which = np.repeat(triangle[run], lengths[run])
        x, y = ranges(low[triangle[run], 0], lengths[run]), np.repeat(row[run], lengths[run])
        hits = triangles.meet(which, np.stack([x, y, np.ones_like(x)], axis=1).astype(np.float64))
        pixel, number = (y * width + x)[hits.pair], triangles.number[which[hits.pair]]
        yield pixel, number, hits.volume / hits.whole, (hits.shares / hits.whole).T
