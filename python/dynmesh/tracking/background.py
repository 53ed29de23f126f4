"""What is taken away from scans before tracking: the room around the subject, as floor and walls.

The search for planes is RANSAC (Fischler and Bolles 1981). It is written here since the libraries
that offer it are either much larger than dynmesh (Open3D, PCL) or no longer maintained.
"""

from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats, Mask, Positions
from .._checks import check_flags, check_not_negative
from .._errors import InputError
from ..scans import DepthScan, PointScan, Scan
from ..topology import mean_edge_of, size_of_surface

_TRIALS = 1000
_EXAMINED = 2000
_MOST_PLANES = 8
_SHARE = 0.08
"""A plane holds at least this share of the points that are left; random triples miss planes that
hold much less."""
_FITS = 4
_CELLS = 10
_COVERED = 0.6
"""A plane covers at least this share of a square of the subject's size, in so many cells a side.
Slabs of a person and of a chest, a table or another person beside it cover up to 0.4 together, and
floors 6 or more."""


class Plane(NamedTuple):
    """A plane of a room: the points x with ``abs(normal @ x - offset)`` up to its thickness there.

    Attributes:
        thickness: beside the camera.
        growth: how much thicker it is at a depth of 1, as the noise of depth cameras grows with the
            square of the depth.
    """

    normal: Floats
    offset: float
    thickness: float
    growth: float = 0.0

    def holds(self, points: NDArray[np.floating[Any]], depths: Floats | float = 0.0) -> Mask:
        """Returns which of the (n, 3) points, at (n,) depths, belong to the plane."""
        heights = np.abs(points @ self.normal - self.offset)
        return np.asarray(heights <= self.thickness + self.growth * depths**2)


def planes_of_background(
    points: NDArray[np.floating[Any]],
    depths: Floats | None = None,
    *,
    thickness: float,
    size: float,
) -> list[Plane]:
    """Finds at most 8 planes that are larger than a subject, the one with most points first.

    The points, (n, 3) and finite, of a plane are at most `thickness` from it. Where they scatter
    less, the plane becomes thinner, so that less of the feet is lost, and where they scatter more
    at larger depths, (n,), it becomes thicker there. A plane that is smaller than the `size` of the
    subject may be a part of it, and stays. Equal input gives equal results.
    """
    rng = np.random.default_rng(0)
    left = points.astype(np.float64)
    depths = np.zeros(len(left)) if depths is None else depths
    planes: list[Plane] = []
    while len(left) >= 3 and len(planes) < _MOST_PLANES:
        if np.linalg.norm(np.ptp(left, axis=0)) <= size:
            break
        a, b, c = left[rng.integers(len(left), size=(3, _TRIALS))]
        normals = np.cross(b - a, c - a)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals /= np.where(lengths > 0, lengths, 1)
        every = -(-len(left) // _EXAMINED)
        some = left[::every]
        near = np.abs(some @ normals.T - (a * normals).sum(axis=1)) <= thickness
        counts = near.sum(axis=0) * (lengths[:, 0] > 0)
        # A part of the subject may hold more points than what is left of a wall.
        best = [i for i in np.argsort(-counts) if counts[i] >= max(3, _SHARE * len(some))]
        wide = (i for i in best if is_large(some[near[:, i]], normals[i], size))
        result = (Plane(normals[i], float(a[i] @ normals[i]), thickness) for i in wide)
        fitted = (_fitted(plane, left, depths, thickness) for plane in result)
        plane = next((one for one in fitted if _is_room(one, left, depths, size)), None)
        if plane is None:
            break
        outside = ~plane.holds(left, depths)
        planes.append(plane)
        left, depths = left[outside], depths[outside]
    return planes


def planes_around(
    template: Positions, faces: NDArray[Any], cloud: Positions, depths: Floats | None = None
) -> list[Plane]:
    """Finds the planes in a scan that are larger than a template."""
    size, thickness = size_of_surface(faces, template), mean_edge_of(template, faces)
    return planes_of_background(cloud, depths, thickness=thickness, size=size)


def without_planes(points: Positions, *, thickness: float, size: float) -> Positions:
    """Returns the points that are on no plane of a room; see :func:`planes_of_background`."""
    for plane in planes_of_background(points, thickness=thickness, size=size):
        points = points[~plane.holds(points)]
    return points


def _is_room(plane: Plane, points: Floats, depths: Floats, size: float) -> bool:
    """Whether so many points are on a plane, over more than the size of the subject."""
    inside = plane.holds(points, depths)
    enough = np.count_nonzero(inside) >= max(3, _SHARE * len(points))
    return bool(enough and is_large(points[inside], plane.normal, size))


def _fitted(plane: Plane, points: Floats, depths: Floats, most: float) -> Plane:
    """Returns the plane of least squares through its points, as thick as they scatter.

    Its points follow from how thick it is, so that it is fitted several times.
    """
    for _ in range(_FITS):
        inside = plane.holds(points, depths)
        own, own_depths = points[inside], depths[inside]
        if len(own) < 3:
            return plane
        weights = (plane.thickness + plane.growth * own_depths**2) ** -2
        middle = np.average(own, axis=0, weights=weights)
        arms = own - middle
        normal = np.linalg.eigh(arms.T @ (arms * weights[:, None]))[1][:, 0]
        near, growing = _scatter(np.abs(arms @ normal), own_depths)
        thickness = min(most, max(5 * near, 0.1 * most))
        plane = Plane(normal, float(middle @ normal), thickness, 5 * growing)
    return plane


def _scatter(heights: Floats, depths: Floats) -> tuple[float, float]:
    """Returns the standard deviation of heights at a depth of 0, and how much larger it is at 1."""
    order = np.argsort(depths)
    shares = np.array_split(order, min(8, 1 + len(order) // 50))
    found = np.array([1.4826 * np.median(heights[share]) for share in shares])
    squares = np.array([np.mean(depths[share] ** 2) for share in shares])
    if not np.ptp(squares) > 0:
        return 1.4826 * float(np.median(heights)), 0.0
    growth, near = np.polyfit(squares, found, 1)
    if growth <= 0:
        return float(found.mean()), 0.0
    # Noise that would be negative beside the camera grows from 0.
    return (float(near), float(growth)) if near > 0 else (0.0, float((found / squares).mean()))


def is_large(points: Positions, normal: Floats, size: float) -> bool:
    """Whether (n, 3) points of a plane reach farther than a subject, and cover enough.

    They reach as far as their diameter, without the outermost fifth: a slab of the subject that
    continues into a wall is not large.
    """
    if len(points) == 0:
        return False
    away = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    if 2 * np.quantile(away, 0.8) <= size:
        return False
    across = np.linalg.svd(normal[None])[2][1:]
    cells = np.floor(points @ across.T * (_CELLS / size))
    return len(np.unique(cells, axis=0)) >= _COVERED * _CELLS**2


Crop = float | tuple[float, float, float, float, float, float]
"""A distance from the box of the mesh, in a tracker that of the last frame, or x, y, z of two
corners of a box."""


def crop_of(value: Any) -> Crop | None:
    """Checks what should be cropped: a number, six numbers, or text with these and commas."""
    if value is None:
        return None
    try:
        given = value.split(",") if isinstance(value, str) else value
        numbers = np.atleast_1d(np.asarray(given, np.float64)).tolist()
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) not in (1, 6) or not np.isfinite(numbers).all():
        message = f"must be a distance, or x,y,z,x,y,z of two corners, not {value!r}"
        raise InputError(message, argument="crop", value=value)
    if len(numbers) == 1:
        check_not_negative("crop", numbers[0])
        return float(numbers[0])
    a, b, c, d, e, f = numbers
    if not (a < d and b < e and c < f):
        raise InputError(
            f"the first corner must be the smaller one in x, y and z, but the box is {value!r}",
            argument="crop",
        )
    return a, b, c, d, e, f


AnyScan = TypeVar("AnyScan", PointScan, DepthScan, Scan)


class Background:
    """Takes what is not the subject from scans, all but the crop in the unit of the template.

    Attributes:
        factor: the unit of the scans, which is that of the crop, in that of the template.
        planes: floor and walls, once :meth:`find` or :meth:`enter` was called.
        removes_planes: whether they are to be left out.
        follows: whether the box of the mesh matters, as the crop is a distance from it.
    """

    def __init__(self, crop: Crop | str | None, remove_planes: bool, factor: float = 1.0) -> None:
        check_flags(remove_planes=remove_planes)
        self.factor = factor
        self._crop = crop_of(crop)
        self.removes_planes = remove_planes
        self.planes: list[Plane] = []
        self.follows = isinstance(self._crop, float)
        self._box = np.zeros((2, 3))

    def __bool__(self) -> bool:
        return self.removes_planes or self._crop is not None

    def follow(self, points: Positions) -> None:
        """Notes where the mesh is."""
        self._box = np.stack([points.min(axis=0), points.max(axis=0)]).astype(np.float64)

    def find(self, scan: Scan, faces: NDArray[Any], template: Positions) -> None:
        """Finds floor and walls in the first scan, and notes where the template is.

        They are sought in the whole scan, as they are hardly larger than the subject in a crop.
        """
        self.follow(template)
        if self.removes_planes:
            self.planes = planes_around(template, faces, scan.cloud, scan.depths)

    def enter(self, scan: Scan, faces: NDArray[Any], template: Positions) -> Scan:
        """Does the same, and returns what is left of the scan."""
        self.find(scan, faces, template)
        left = self.without(scan)
        if scan.has_points and not left.has_points:
            raise InputError("nothing is left of the scan without planes and what is cropped")
        return left

    @property
    def remark(self) -> str:
        """What was asked for, but not found in the first scan."""
        if not self.removes_planes or self.planes:
            return ""
        return "no plane was removed, as none in the scan is larger than the template"

    def without(self, scan: AnyScan) -> AnyScan:
        """Returns the scan without the room."""
        if self._crop is None and not self.planes:
            return scan
        cloud, depths = scan.cloud, scan.depths
        kept = np.ones(len(cloud), np.bool_)
        if self._crop is not None:
            if isinstance(self._crop, float):
                reach = self._crop * self.factor
                low, high = self._box[0] - reach, self._box[1] + reach
            else:
                low, high = np.reshape(self._crop, (2, 3)) * self.factor
            kept = ((cloud >= low) & (cloud <= high)).all(axis=1)
        for plane in self.planes:
            kept &= ~plane.holds(cloud, depths)
        return scan.only(kept)

    def subject(self, scan: Scan | None) -> Scan | None:
        """Returns what a scan, in its own unit, shows of the subject; None if nothing."""
        left = None if scan is None else self.without(scan.scaled(self.factor))
        return left if left is not None and left.has_points else None
