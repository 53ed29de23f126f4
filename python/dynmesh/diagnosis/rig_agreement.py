"""Whether the depth images of a rig agree with each other, without a template.

Each camera's points are projected into the other images. A point that lies clearly in front of what
the other camera measured there contradicts it; one that lies behind is hidden. Where points meet
the surface that the other camera sees, their distances from it tell whether a camera is a little
off. What no other camera sees cannot be judged, nor can a turn or a unit of the whole rig.
"""

from collections.abc import Iterable, Iterator
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..files.scans import Rig, ScanCamera
from ..sequence import Mask
from .odd_cameras import SCALES, longer
from .planes import extent_of, planes_of_room
from .rig_reading import (
    NO_UNITS,
    Hypothesis,
    Reading,
    RigFinding,
    about_images,
    about_poses,
    about_swapped,
    about_units,
)
from .rig_view import View
from .surface_distance import motion_onto

_Floats = NDArray[np.float64]

_POINTS = 700
"""Of each camera that are projected, of planes such as a floor, and besides of everything else."""

_PLANE = 0.5
"""The least size of such a plane, relative to what the camera sees."""

_TOLERANCE = 0.01
"""Of depths, relative to them: points meet what another camera sees if they differ less, and
contradict it if they are farther in front."""

_REACH = 0.05
"""The same, for points that may belong together although a camera is off."""

_SAME_SIDE = 0.5
"""Between the normals of points that may belong together."""

_SLANT = 0.3
"""The least cosine between a surface and the ray to a camera, without which it is at an outline."""

_LEAST = 60
"""Points, of which less tell nothing."""

_WRONG = 0.15
_RIGHT = 0.1
_MEET = 0.03
"""A reading may be wrong if less than `_MEET` of the points meet what another camera sees, or if
more than `_WRONG` of those that meet or contradict it contradict it. It is right if less than
`_RIGHT` do, and more than `_MEET` of all points meet."""

_TIED = 0.9
"""Readings in which so many points meet, relative to the best, cannot be told from it."""

_ODD = 0.06
_LESS = 0.5
"""A camera is odd if the share of contradicting points is `_ODD` more than twice that among the
others, and if another pose or focal length leaves at most `_LESS` of it, with more that meet; or if
it is above `_WRONG`, and the others agree."""

_STEPS = 10


class _Image(NamedTuple):
    """What a camera sees, as a surface in its own axes.

    Attributes:
        points: (h, w, 3) positions; undefined where `depth` is 0.
        normals: (h, w, 3) of the surface; zeros at its boundary.
        depth: (h, w).
        front: (h, w) the least depth of a pixel and its neighbours.
        intrinsics: (3, 3).
        pose: (4, 4) from the axes of the camera to the world.
        free: indices of some pixels inside the surface, on no large plane.
        held: the same on large planes.
    """

    points: _Floats
    normals: _Floats
    depth: _Floats
    front: _Floats
    intrinsics: _Floats
    pose: _Floats
    free: NDArray[np.intp]
    held: NDArray[np.intp]

    def with_focal(self, scale: float) -> "_Image":
        """Returns the image of a camera with this many times the focal length."""
        to_new = np.array([scale, scale, 1])
        intrinsics = self.intrinsics * [[scale, 1, 1], [1, scale, 1], [1, 1, 1]]
        return self._replace(points=self.points / to_new, intrinsics=intrinsics)

    def some(self, pixels: NDArray[np.intp]) -> tuple[_Floats, _Floats]:
        """Returns (n, 3) the points of some pixels in the world, and their normals."""
        rotation, place = self.pose[:3, :3], self.pose[:3, 3]
        points, normals = (
            values.reshape(-1, 3)[pixels] @ rotation.T for values in (self.points, self.normals)
        )
        return points + place, normals

    def met_by(self, world: _Floats, facing: _Floats) -> "_Met":
        """Returns what this camera sees where these points are, which have these normals."""
        local = (world - self.pose[:3, 3]) @ self.pose[:3, :3]
        is_ahead = local[:, 2] > 0
        pixels = local @ self.intrinsics.T / np.where(is_ahead, local[:, 2], 1)[:, None]
        height, width = self.depth.shape
        column, row = np.rint(pixels[:, :2]).T
        inside = is_ahead & (column >= 0) & (column < width) & (row >= 0) & (row < height)
        column, row = (np.where(inside, one, 0).astype(np.intp) for one in (column, row))
        seen = inside & (self.depth[row, column] > 0)
        depth = np.where(seen, self.depth[row, column], 1)
        normals = self.normals[row, column]
        heights = ((local - self.points[row, column]) * normals).sum(axis=1)
        normals = normals @ self.pose[:3, :3].T
        belongs = seen & ((normals * facing).sum(axis=1) > _SAME_SIDE)
        meets = belongs & (np.abs(local[:, 2] - depth) < _TOLERANCE * depth)
        # At an outline, the next pixel sees something else.
        slant = np.abs((local * (facing @ self.pose[:3, :3])).sum(axis=1))
        in_front = seen & (slant > _SLANT * np.linalg.norm(local, axis=1))
        in_front &= local[:, 2] < (1 - _TOLERANCE) * self.front[row, column]
        near = np.flatnonzero(belongs & (np.abs(heights) < _REACH * depth))
        return _Met(meets & ~in_front, in_front, near, normals, heights, depth)


class _Met(NamedTuple):
    """What a camera sees where (n, 3) points are.

    Attributes:
        meets: (n,) whether that is where they are.
        in_front: (n,) whether they are so far in front of it that it would see them.
        near: the indices of points that may belong to its surface.
        normals: (n, 3) of its surface, in the world.
        heights: (n,) their distances from its surface.
        depth: (n,) of its surface.
    """

    meets: Mask
    in_front: Mask
    near: NDArray[np.intp]
    normals: _Floats
    heights: _Floats
    depth: _Floats


class _Agreement(NamedTuple):
    """How far cameras agree.

    Attributes:
        points: number of points that are projected.
        meet: of those that are there.
        in_front: of those that contradict it.
    """

    points: int
    meet: int
    in_front: int

    @property
    def excess(self) -> int:
        """How many more points meet than contradict."""
        return self.meet - self.in_front

    @property
    def contradiction(self) -> float:
        """The share of contradicting points; 0 where nothing meets or contradicts."""
        return self.in_front / max(1, self.in_front + self.meet)


def _agreement(pairs: Iterable[tuple[_Image, _Image]]) -> _Agreement:
    """Adds up what is known of pairs, of which each camera's points are seen by the other one."""
    counts = np.zeros(3, np.int64)
    for one, other in ((a, b) for pair in pairs for a, b in (pair, pair[::-1])):
        met = other.met_by(*one.some(one.free))
        counts += [len(met.meets), met.meets.sum(), met.in_front.sum()]
    return _Agreement(*counts.tolist())


def disagreements(
    views: Iterable[View], stated: Rig | None, reading: Reading
) -> Iterator[RigFinding]:
    """Yields what is wrong with depth cameras of which several see the same."""
    views = [view for view in views if view.camera is not None]
    if stated is None or len(views) < 2:
        return
    samples = [_samples(view) for view in views]
    images = _images(views, samples, stated, reading)
    now, found = _agreement(combinations(images, 2)), []
    if now.contradiction > _WRONG or now.meet < _MEET * now.points:
        for hypothesis in _hypotheses(views, stated, reading):
            images_then = _images(views, samples, stated, hypothesis.reading)
            then = _agreement(combinations(images_then, 2))
            is_right = then.contradiction < _RIGHT and then.meet > _MEET * then.points
            if is_right and then.excess > now.excess:
                found.append((then, hypothesis))
    if found:
        best = max(then.meet for then, _ in found)
        tied = [(then, one) for then, one in found if then.meet >= _TIED * best]
        conditions = ", or if ".join(one.condition for _, one in tied)
        then, first = max(tied, key=lambda pair: pair[0].meet)
        yield RigFinding(
            f"{then.meet} points meet what another camera sees and {then.in_front} lie in front of "
            f"it if {conditions}, but {now.meet} and {now.in_front} as it is read now: "
            f"{first.remedy}",
            first.options,
            is_refused=True,
        )
        return
    odd = list(_odd_cameras(views, images))
    yield from odd
    if not odd and now.contradiction > _WRONG:
        yield RigFinding(
            f"{now.meet} of {now.points} points meet what another camera sees, but {now.in_front} "
            "lie in front of it: poses, intrinsics or depths are wrong",
            {},
        )


def _hypotheses(views: list[View], rig: Rig, reading: Reading) -> Iterator[Hypothesis]:
    """Yields the readings in which the cameras lie otherwise to each other."""
    yield from about_poses(reading)
    yield from about_swapped(reading, rig)
    yield from about_images(reading, rig, {view.name: view.size for view in views})
    for one in about_units(reading, rig, NO_UNITS):
        if one.options.keys() == {"depth_scale"}:
            yield one


def _samples(view: View) -> tuple[Mask, Mask]:
    """Returns (h, w) the pixels of no large plane, and those of one.

    Points of a floor agree in many readings, and are most of what there is.
    """
    assert view.camera is not None
    points = view.local
    thickness = _TOLERANCE * float(np.median(points[:, 2]))
    planes = planes_of_room(points, thickness=thickness, size=_PLANE * extent_of(points))
    whole = _surface(view.image, np.asarray(view.camera.intrinsics))[0]
    held = np.zeros(view.image.shape, np.bool_)
    for plane in planes:
        held |= plane.holds(whole.reshape(-1, 3)).reshape(held.shape)
    return ~held, held


def _images(
    views: list[View], samples: list[tuple[Mask, Mask]], stated: Rig, reading: Reading
) -> list[_Image]:
    cameras = reading.cameras_of(stated, {view.name: view.size for view in views})
    return [
        _image(view, parts, cameras[view.name])
        for view, parts in zip(views, samples, strict=True)
        if view.name in cameras
    ]


def _image(view: View, parts: tuple[Mask, Mask], camera: ScanCamera) -> _Image:
    assert view.camera is not None
    scale = (camera.depth_scale or 1.0) / (view.camera.depth_scale or 1.0)
    intrinsics = np.asarray(camera.intrinsics)
    depth = view.image.astype(np.float64) * scale
    points, normals = _surface(depth, intrinsics)
    inside = normals.any(axis=-1)
    free, held = (np.flatnonzero(inside & part) for part in parts)
    free, held = (one[:: max(1, len(one) // _POINTS)] for one in (free, held))
    near = np.pad(np.where(depth > 0, depth, np.inf), 1, constant_values=np.inf)
    h, w = depth.shape
    front = np.min([near[i : i + h, j : j + w] for i in range(3) for j in range(3)], axis=0)
    if len(free) < _LEAST:
        free, held = held, free
    return _Image(points, normals, depth, front, intrinsics, camera.camera_to_world, free, held)


def _surface(depth: NDArray[Any], intrinsics: _Floats) -> tuple[_Floats, _Floats]:
    """Returns (h, w, 3) the points of an image, and the normals where it is smooth, or zeros."""
    row, column = np.indices(depth.shape)
    rays = np.stack([column, row, np.ones_like(row)], axis=-1) @ np.linalg.inv(intrinsics).T
    points = rays * depth[..., None]
    normals = np.zeros_like(points)
    across = points[1:-1, 2:] - points[1:-1, :-2]
    down = points[2:, 1:-1] - points[:-2, 1:-1]
    whole = np.cross(across, down)
    around = [depth[1:-1, 2:], depth[1:-1, :-2], depth[2:, 1:-1], depth[:-2, 1:-1]]
    middle = depth[1:-1, 1:-1]
    is_smooth = middle > 0
    for one in around:
        is_smooth &= np.abs(one - middle) < 2 * _TOLERANCE * middle
    length = np.linalg.norm(whole, axis=-1, keepdims=True)
    normals[1:-1, 1:-1] = np.where(is_smooth[..., None], whole / np.where(length > 0, length, 1), 0)
    return points, normals


def _odd_cameras(views: list[View], images: list[_Image]) -> Iterator[RigFinding]:
    """Yields the cameras that are a little off, the worst one first, of at least three."""
    left = list(range(len(images)))
    while len(left) > 2:
        found = {n: odd for n in left if (odd := _odd(views[n].name, n, left, images)) is not None}
        if not found:
            return
        worst = max(found, key=lambda n: found[n][0])
        yield found[worst][1]
        left.remove(worst)


def _odd(
    name: str, number: int, left: list[int], images: list[_Image]
) -> tuple[float, RigFinding] | None:
    """Returns how odd a camera is, judged by the others, and what is wrong; or None."""
    own, others = images[number], [images[n] for n in left if n != number]

    def beside(image: _Image) -> _Agreement:
        return _agreement((image, other) for other in others)

    now, rest = beside(own), _agreement(combinations(others, 2))
    excess = now.contradiction - 2 * rest.contradiction
    if now.meet + now.in_front < _LEAST or excess < _ODD:
        return None
    pose = _motion(own, others) @ own.pose
    off = float(np.linalg.norm(pose[:3, 3] - own.pose[:3, 3]))
    ways = {f"when moved by {off:.2g}: check its pose": beside(own._replace(pose=pose))}
    ways |= {longer(scale): beside(own.with_focal(scale)) for scale in SCALES}
    best = max(ways, key=lambda words: ways[words].excess)
    then = ways[best]
    message = (
        f"{now.in_front} points lie in front of what camera {name!r} or another one sees there and "
        f"{now.meet} meet it"
    )
    if then.contradiction <= _LESS * now.contradiction and then.meet > now.meet:
        message += f", but {then.in_front} and {then.meet} {best}"
    elif now.contradiction > _WRONG and rest.meet >= _LEAST and rest.contradiction < _ODD:
        message += ", while the others agree: check its pose and intrinsics"
    else:
        return None
    return excess, RigFinding(message, {}, name)


def _motion(own: _Image, others: list[_Image]) -> _Floats:
    """Returns (4, 4) the rigid motion that brings most points onto what other cameras see."""
    points, facing = own.some(np.concatenate([own.free, own.held]))
    motion = np.eye(4)
    for scale in np.geomspace(_REACH, _TOLERANCE / 4, _STEPS):
        moved = points @ motion[:3, :3].T + motion[:3, 3]
        met = [other.met_by(moved, facing) for other in others]
        kept = np.concatenate([one.near for one in met])
        if len(kept) < _LEAST:
            break
        normals, heights, depth = (
            np.concatenate([values[one.near] for one, values in zip(met, each, strict=True)])
            for each in zip(*((one.normals, one.heights, one.depth) for one in met), strict=True)
        )
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = motion_onto(
            moved[kept], normals, heights, heights / (scale * depth)
        )
        motion = step @ motion
    return motion
