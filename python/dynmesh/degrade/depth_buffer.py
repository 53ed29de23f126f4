"""What a camera measures at the centres of its pixels: distances, and the triangles they belong to.

The ray through the centre of a pixel is intersected with every triangle whose image covers it, so
depths are exact at the centres, and triangles that cross the plane of the camera need no clipping.
"""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..sequence import Positions
from .visibility import Camera, axes_of, bounding_boxes, ranges

_Integers = NDArray[np.integer[Any]]
_Floats = NDArray[np.float64]

_TOLERANCE = 1e-9
"""Triangles are enlarged by this share of their size, so that no ray slips between two of them."""

_PAIRS_AT_ONCE = 1 << 18
"""The number of pairs of a triangle and a pixel that are compared at a time. It bounds the memory;
more pairs would not fit in the processor's cache."""


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
    """Renders a mesh.

    Args:
        points: (k, 3) positions. A triangle with a corner that is not finite is not there.
        faces: (m, 3) integers from 0 to k - 1.
        camera: the camera to look through; both sides of a triangle are seen.
        width: of the image, in pixels.
        height: of the image, in pixels.
    """
    depth = np.full(height * width, np.inf)
    triangle = np.full(height * width, -1)
    weights = np.zeros((height * width, 3))
    for hit in _hits(_in_pixels(points, camera, width, height)[faces.T], width, height):
        nearer = hit.depth < depth[hit.pixel]
        pixel, near, number = hit.pixel[nearer], hit.depth[nearer], hit.triangle[nearer]
        # Of several values for one pixel, NumPy keeps the last; here it is the nearest.
        order = np.lexsort((-number, -near))
        depth[pixel[order]] = near[order]
        triangle[pixel[order]] = number[order]
        weights[pixel[order]] = hit.weights[nearer][order]
    shape = (height, width)
    return DepthBuffer(depth.reshape(shape), triangle.reshape(shape), weights.reshape(*shape, 3))


class _Hits(NamedTuple):
    """Pairs of a pixel and a triangle that its ray hits."""

    pixel: _Integers
    triangle: _Integers
    depth: _Floats
    weights: _Floats


def _in_pixels(points: Positions, camera: Camera, width: int, height: int) -> _Floats:
    """Returns x and y of the image, both multiplied by the depth, and the depth."""
    pose = pose_of(camera)
    finite = np.isfinite(points).all(axis=1, keepdims=True)
    local = (np.where(finite, points, np.nan) - pose[:3, 3]) @ pose[:3, :3]
    return np.asarray(local @ intrinsics_of(camera, width, height).T)


def _hits(corners: _Floats, width: int, height: int) -> Iterator[_Hits]:
    """Intersects the rays of the pixels with triangles, whose (3, m, 3) corners are in pixels.

    A ray (x, y, 1) meets a triangle at volume / (u + v + w) times itself, where u, v, w are the
    volumes that it spans with the sides: none is negative if it passes inside.
    """
    normals = np.cross(np.roll(corners, -1, axis=0), np.roll(corners, -2, axis=0))
    volumes = np.einsum("tx,tx->t", corners[0], normals[0])
    low, high = bounding_boxes(corners)
    last = np.array([width - 1, height - 1])
    # Comparisons are False for triangles with a corner that is not finite.
    kept = np.flatnonzero((low <= last).all(axis=1) & (high >= 0).all(axis=1) & (volumes != 0))
    normals = normals[:, kept] * np.sign(volumes[kept])[:, None]
    volumes = np.abs(volumes[kept])
    first = np.ceil(np.clip(low[kept], 0, last) - _TOLERANCE).astype(np.int64)
    end = np.floor(np.clip(high[kept], 0, last) + _TOLERANCE).astype(np.int64) + 1
    rows = end[:, 1] - first[:, 1]
    of_row = np.repeat(np.arange(len(kept)), rows)
    row = ranges(first[:, 1], rows)
    lengths = (end - first)[of_row, 0]
    for run in _portions(lengths):
        which = np.repeat(of_row[run], lengths[run])
        x, y = ranges(first[of_row[run], 0], lengths[run]), np.repeat(row[run], lengths[run])
        ray = np.stack([x, y, np.ones_like(x)], axis=1).astype(np.float64)
        shares = np.stack([np.einsum("px,px->p", normal[which], ray) for normal in normals], axis=1)
        whole = shares.sum(axis=1)
        inside = (whole > 0) & (shares.min(axis=1) >= -_TOLERANCE * whole)
        whole, which = whole[inside], which[inside]
        yield _Hits(
            (y * width + x)[inside],
            kept[which],
            volumes[which] / whole,
            shares[inside] / whole[:, None],
        )


def _portions(lengths: _Integers) -> Iterator[slice]:
    """Divides runs of these lengths into portions of about equally many pairs."""
    ends = np.cumsum(lengths)
    total = int(ends[-1]) if len(ends) else 0
    limits = np.searchsorted(ends, np.arange(0, total, _PAIRS_AT_ONCE))
    for begin, end in pairwise([*limits, len(ends)]):
        yield slice(begin, end)
