"""What a camera sees: vertices, by an irregular depth buffer, and the surface, by a regular one.

A regular depth buffer samples the surface at the centres of pixels, so a vertex is compared with
the depth of a neighbouring point: with too small a bias, a sloping surface hides itself, and with
too large a bias, the back of a finger shows through. An irregular depth buffer (Johnson et al.
2005, Aila and Laine 2004) has its samples at the projections of the vertices instead. It needs no
bias, and the grid that finds the samples below a triangle has no influence on the result.

Intersections of rays with triangles are exact but for rounding. Points are given as (x, y, z) such
that their image is (x / z, y / z), and z is positive in front of the camera. A triangle that
crosses the plane of the camera needs no clipping, as no point of it is projected: a ray is compared
with the planes through the camera and the sides of the triangle.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _arrays
from .._arrays import Floats, Integers, Mask, Positions
from .._checks import (
    check_between,
    check_complete,
    check_finite,
    check_integer,
    check_positive,
    check_vector,
)
from .._errors import InputError

TOLERANCE = 1e-9
"""Triangles are enlarged by this share of their size, so that no ray slips between two of them."""

_PAIRS_AT_ONCE = 1 << 18
"""The number of pairs of a triangle and a ray that are compared at a time. It bounds the memory;
more pairs would not fit in the processor's cache."""


class Triangles:
    """The triangles that rays within an image can meet.

    Attributes:
        number: (t,) their numbers among all triangles.
        low: (t, 2) lower corners of their bounding boxes in the image.
        high: (t, 2) upper corners.
        depth: (t,) lower bounds of z, wherever a ray meets them.
    """

    def __init__(self, corners: Floats, least: Any, most: Any) -> None:
        """Selects those in the image, whose bounds are two numbers or one for both axes.

        The corners are (3, m, 3), as numpy is slow along short last axes. A triangle with a corner
        that is not finite is left out, as is one that is seen edge-on.
        """
        normals = np.cross(np.roll(corners, -1, axis=0), np.roll(corners, -2, axis=0))
        # a . (b x c): six times the volume between triangle and camera, 0 if it is seen edge-on.
        volumes = np.einsum("tx,tx->t", corners[0], normals[0])
        depth = corners[:, :, 2]
        image = corners[:, :, :2] / np.where(depth > 0, depth, 1)[:, :, None]
        low, high = image.min(axis=0), image.max(axis=0)
        # A triangle that crosses the plane of the camera has an unbounded image; one behind the
        # camera has an empty one.
        crosses = depth.min(axis=0) <= 0
        low[crosses], high[crosses] = -np.inf, np.inf
        low[depth.max(axis=0) <= 0] = np.inf
        # Comparisons are False for triangles with a corner that is not finite.
        touches = (low <= most).all(axis=1) & (high >= least).all(axis=1)
        self.number = np.flatnonzero(touches & (volumes != 0))
        self.low, self.high = low[self.number], high[self.number]
        # Beyond the sides, by the tolerance, a triangle can be met nearer than its corners are.
        z = corners[:, self.number, 2]
        self.depth = z.min(axis=0) - 2 * TOLERANCE * np.ptp(z, axis=0)
        self._volumes = np.abs(volumes[self.number])  # both sides are met
        self._normals = normals[:, self.number] * np.sign(volumes[self.number])[:, None]

    def meet(self, triangle: Integers, ray: Floats) -> tuple[Integers, Floats, Floats, Floats]:
        """Compares (n,) of these triangles with (n, 3) rays, pair by pair.

        A ray p meets the triangle at p times volume / (u + v + w), where u, v, w are the volumes
        that p spans with the sides: none is negative if it passes inside. Returns the numbers of
        the pairs that meet, their volumes, their sums u + v + w, and (3, n) u, v and w, which are
        the parts of the corners in the point where they meet, times the sum.
        """
        # Here, numpy takes rows several times as fast as it indexes them.
        normals = (np.take(normal, triangle, axis=0) for normal in self._normals)
        u, v, w = (np.einsum("px,px->p", normal, ray) for normal in normals)
        whole = u + v + w
        inside = (whole > 0) & (np.minimum(np.minimum(u, v), w) >= -TOLERANCE * whole)
        pair = np.flatnonzero(inside)
        shares = np.stack([u[pair], v[pair], w[pair]])
        return pair, self._volumes[triangle[pair]], whole[pair], shares


def in_axes(points: Positions, origin: Any, axes: Floats) -> Floats:
    """Returns (k, 3) positions in other axes, the columns of a matrix; NaN if one is not finite."""
    x, y, z = np.isfinite(points).T  # numpy is slow along short last axes
    finite = (x & y & z)[:, None]
    return np.asarray((np.where(finite, points, np.nan) - origin) @ axes)


def pairs(
    low: Integers, high: Integers, columns: int, starts: Integers
) -> Iterator[tuple[Integers, Integers]]:
    """Yields pairs of a box and an item in one of its cells, a portion at a time.

    Boxes reach from the cells `low` to `high`, (n, 2) columns and rows of a grid. The items of its
    cells, row by row, are those from `starts` of a cell to that of the next.
    """
    # Runs of consecutive items, one for each row of cells of each box.
    n_rows = high[:, 1] - low[:, 1] + 1
    box = np.repeat(np.arange(len(low)), n_rows)
    row = _ranges(low[:, 1], n_rows)
    first = starts[row * columns + low[box, 0]]
    lengths = starts[row * columns + high[box, 0] + 1] - first
    filled = lengths > 0
    box, first, lengths = box[filled], first[filled], lengths[filled]
    ends = np.cumsum(lengths)
    limits = np.searchsorted(ends, np.arange(0, int(lengths.sum()), _PAIRS_AT_ONCE))
    for run in map(slice, limits, [*limits[1:], len(ends)]):
        yield np.repeat(box[run], lengths[run]), _ranges(first[run], lengths[run])


def _ranges(starts: Integers, lengths: Integers) -> Integers:
    """Returns consecutive integers from each start, as many as its length, as one array."""
    before = np.cumsum(lengths) - lengths
    return np.asarray(np.repeat(starts - before, lengths) + np.arange(lengths.sum()))


_CONTACT = 1e-6
"""A triangle hides a vertex only if it is nearer by this share of the distance. This exceeds the
rounding of float32, so that vertices at one position, as along a seam, do not hide each other."""

_MOST_CELLS = 1024
"""Along either side of the image; bounds the memory."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with a square image.

    Attributes:
        position: x, y, z of the centre of projection.
        target: a point in the middle of the image.
        up: a direction that points upwards in the image, of any length.
        field_of_view: angle from the lower to the upper edge of the image, in degrees.
    """

    position: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float]
    field_of_view: float = 40.0

    def __post_init__(self) -> None:
        for name in ("position", "target", "up"):
            check_vector(name, getattr(self, name))
        check_between("field_of_view", self.field_of_view, 0, 180)
        view = np.subtract(self.target, self.position, dtype=np.float64)
        if not view.any():
            raise InputError(f"must differ from position, not {self.target}", argument="target")
        if _are_parallel(view, np.array(self.up, np.float64)):
            raise InputError(
                f"must not be zero or parallel to the view, not {self.up}", argument="up"
            )


def orbit(
    first_frame: Positions,
    n_cameras: int = 1,
    *,
    degrees_per_frame: float = 1.0,
    elevation: float = 15.0,
    distance: float = 2.0,
    up: tuple[float, float, float] = (0, 0, 1),
) -> Callable[[int], list[Camera]]:
    """Creates cameras that circle a mesh and look at it, for :func:`dynmesh.losses.camera_known`.

    They are evenly spaced around the centre of the bounding box of frame 0, and move
    counterclockwise about `up`. In frame 0 the first one stands in the direction of x, or of y if
    `up` is along x.

    Args:
        first_frame: (k, 3) finite positions.
        n_cameras: number of cameras, at least 1.
        degrees_per_frame: angle by which they move from one frame to the next.
        elevation: angle of the cameras above the mesh in degrees, above -90 and below 90.
        distance: from the centre, in diagonals of the bounding box, positive.
        up: the axis of the circle, of any length.

    Returns:
        A function that returns the cameras of the frame with a given number.
    """
    check_integer("n_cameras", n_cameras, 1)
    check_finite("degrees_per_frame", degrees_per_frame)
    check_between("elevation", elevation, -90, 90)
    check_positive("distance", distance)
    ahead, left, axis = horizon(up)
    first_frame = _arrays.first_frame("first_frame", first_frame)
    check_complete("first_frame", first_frame)
    box = np.stack([first_frame.min(axis=0), first_frame.max(axis=0)]).astype(np.float64)
    centre, diagonal = box.mean(axis=0), float(np.linalg.norm(box[1] - box[0]))
    if diagonal == 0:
        raise InputError("must have vertices in more than one place", argument="first_frame")
    tilt = math.radians(elevation)

    def camera(turn: float) -> Camera:
        angle = 2 * math.pi * turn
        level = math.cos(angle) * ahead + math.sin(angle) * left
        direction = math.cos(tilt) * level + math.sin(tilt) * axis
        position = centre + distance * diagonal * direction
        return Camera(_triple(position), _triple(centre), _triple(axis))

    def cameras(frame: int) -> list[Camera]:
        start = frame * degrees_per_frame / 360
        return [camera(start + number / n_cameras) for number in range(n_cameras)]

    return cameras


def visible(points: Positions, faces: Integers, camera: Camera, among: Mask | None = None) -> Mask:
    """Returns which vertices a camera sees.

    It sees the finite vertices in front of it and inside its image that no triangle of other
    vertices hides. Both sides of a triangle hide what is behind them. A triangle that crosses the
    plane of the camera hides with its part in front of the plane; a triangle with a corner that is
    not finite hides nothing.

    Vertices that are not `among` those to be tested are not seen.
    """
    scale = 1 / math.tan(math.radians(camera.field_of_view) / 2)
    # Axes to the right, up and ahead, scaled such that the image is |x|, |y| <= z > 0.
    local = in_axes(points, np.array(camera.position), axes_of(camera) * [scale, scale, 1])
    x, y, z = np.ascontiguousarray(local.T)
    seen: Mask = np.asarray((z > 0) & (np.abs(x) <= z) & (np.abs(y) <= z))
    if among is not None:
        seen &= among
    triangles = Triangles(local[faces.T], -1, 1)
    for triangle, vertex in _near_in_image(triangles, local, np.flatnonzero(seen)):
        # Most pairs are of a triangle behind the vertex.
        nearer = np.take(triangles.depth, triangle) < np.take(z, vertex)
        triangle, vertex = triangle[nearer], vertex[nearer]
        pair, volume, whole, _ = triangles.meet(triangle, np.take(local, vertex, axis=0))
        hidden = pair[volume < (1 - _CONTACT) * whole]
        # A triangle never hides its own corners, except by rounding if it is seen edge-on.
        own = (faces[triangles.number[triangle[hidden]]] == vertex[hidden, None]).any(axis=1)
        seen[vertex[hidden[~own]]] = False
    return seen


def _near_in_image(
    triangles: Triangles, local: Floats, vertices: Integers
) -> Iterator[tuple[Integers, Integers]]:
    """Yields pairs of a triangle and a vertex in the grid cells of its bounding box."""
    # About sixteen cells for each vertex: with fewer, triangles meet more vertices in vain; with
    # more, counting the vertices in them takes longer than what it saves.
    grid = min(4 * math.isqrt(len(vertices)) + 1, _MOST_CELLS)
    cell = _cell(local[vertices, :2] / local[vertices, 2:], grid) @ [1, grid]
    in_cells = vertices[np.argsort(cell, kind="stable")]
    starts = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=grid * grid))])
    low, high = _cell(triangles.low - TOLERANCE, grid), _cell(triangles.high + TOLERANCE, grid)
    for triangle, place in pairs(low, high, grid, starts):
        yield triangle, in_cells[place]


def _cell(image: Floats, grid: int) -> NDArray[np.int64]:
    """Returns column and row, of the nearest of grid x grid cells for points outside the image."""
    cell = np.floor((image + 1) * (grid / 2))
    return np.clip(cell, 0, grid - 1).astype(np.int64)


def axes_of(camera: Camera) -> Floats:
    """Returns the directions to the right, up and ahead, as the columns of a matrix."""
    ahead = np.subtract(camera.target, camera.position, dtype=np.float64)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, np.array(camera.up, np.float64))
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, ahead), ahead], axis=1)


def horizon(up: tuple[float, float, float]) -> tuple[Floats, Floats, Floats]:
    """Unit vectors at right angles: x as seen from above, counterclockwise of it, and up."""
    check_vector("up", up)
    if not any(up):
        raise InputError(f"must not be zero, but is {up}", argument="up")
    x, y = np.eye(3)[:2]
    axis = np.array(up, np.float64)
    axis /= np.linalg.norm(axis)
    left = np.cross(axis, y if _are_parallel(axis, x) else x)
    left /= np.linalg.norm(left)
    return np.cross(left, axis), left, axis


def _triple(vector: Floats) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def _are_parallel(a: Floats, b: Floats) -> bool:
    """Whether two vectors are parallel up to rounding, or one of them is zero."""
    return bool(np.linalg.norm(np.cross(a, b)) <= 1e-6 * np.linalg.norm(a) * np.linalg.norm(b))


class DepthBuffer(NamedTuple):
    """The nearest triangle of each pixel.

    Attributes:
        depth: (h, w) distances along the optical axis, infinite where there is no triangle.
        triangle: (h, w) its number, or -1.
        weights: (h, w, 3) the shares of its corners in the point that was hit.
    """

    depth: Floats
    triangle: Integers
    weights: Floats


def intrinsics_of(camera: Camera, width: int, height: int) -> Floats:
    """Returns the (3, 3) matrix from camera coordinates to pixels, with square pixels.

    The centre of the first pixel is at (0, 0), and the field of view of the camera is that from the
    lower to the upper edge of the image.
    """
    focal = height / 2 / math.tan(math.radians(camera.field_of_view) / 2)
    return np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])


def pose_of(camera: Camera) -> Floats:
    """Returns the (4, 4) matrix from camera coordinates, x right, y down, z ahead, to the world."""
    pose = np.eye(4)
    pose[:3, :3] = axes_of(camera) * [1, -1, 1]
    pose[:3, 3] = camera.position
    return pose


def depth_buffer(
    points: Positions, faces: Integers, camera: Camera, width: int, height: int
) -> DepthBuffer:
    """Renders a mesh, of which both sides of a triangle are seen.

    The ray through the centre of a pixel is intersected with every triangle whose image covers it,
    so depths are exact at the centres, and triangles that cross the plane of the camera need no
    clipping. A triangle with a corner that is not finite is not there.
    """
    pose = pose_of(camera)
    # x and y of the image, both multiplied by the depth, and the depth.
    local = in_axes(points, pose[:3, 3], pose[:3, :3]) @ intrinsics_of(camera, width, height).T
    depth = np.full(height * width, np.inf)
    triangle = np.full(height * width, -1)
    weights = np.zeros((height * width, 3))
    last = np.array([width - 1, height - 1])
    triangles = Triangles(local[faces.T], 0, last)
    low = np.ceil(np.clip(triangles.low, 0, last) - TOLERANCE).astype(np.int64)
    high = np.floor(np.clip(triangles.high, 0, last) + TOLERANCE).astype(np.int64)
    for covering, covered in pairs(low, high, width, np.arange(height * width + 1)):
        row, column = np.divmod(covered, width)
        rays = np.stack([column, row, np.ones_like(row)], axis=1).astype(np.float64)
        pair, volume, whole, shares = triangles.meet(covering, rays)
        pixel, number = covered[pair], triangles.number[covering[pair]]
        near, shares = volume / whole, (shares / whole).T
        nearer = near < depth[pixel]
        pixel, number, near = pixel[nearer], number[nearer], near[nearer]
        # Of several values for one pixel, NumPy keeps the last; here it is the nearest.
        order = np.lexsort((-number, -near))
        depth[pixel[order]] = near[order]
        triangle[pixel[order]] = number[order]
        weights[pixel[order]] = shares[nearer][order]
    shape = (height, width)
    return DepthBuffer(depth.reshape(shape), triangle.reshape(shape), weights.reshape(*shape, 3))
