"""Whether the cameras of depth images are read as they are meant, judged by the first scan.

Every usual misreading is undone in turn, and the scan compared with the template.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..diagnosis.planes import planes_of_room
from ..diagnosis.surface_distance import Surface
from ..scans import DepthScan, Rig
from ..tracker import find_alignment

_Floats = NDArray[np.float64]

_EXAMINED = 10000
_POINTS = 500
"""So many points of a camera are searched for floor and walls; so many of the rest are compared."""

_LEAST = 60
"""Fewer points than this cannot be judged."""

_FAR = 0.01
_FAR_EDGES = 0.5
"""A point is far from the template beyond this share of its diagonal and of its mean edge."""

_COVERED = 0.3
"""If the points of no camera extend over this share of the template, all of them count as far:
with a depth scale that is far too small, they fall on one place, which may lie on the surface."""

FIT = 0.12
"""The cameras fit if of each at most so many points are far: of right ones, 10 % were with outliers
or a room, and of one turned by 4 degrees about its axis, 14 %."""


def _flipped(pose: _Floats) -> _Floats:
    return np.asarray(pose @ np.diag([1.0, -1, -1, 1]))


def _inverted(pose: _Floats) -> _Floats:
    return np.asarray(np.linalg.inv(pose))


def _transposed(pose: _Floats) -> _Floats:
    return np.block([[pose[:3, :3].T, pose[:3, 3:]], [pose[3:]]])


def _posed(change: Callable[[_Floats], _Floats], rig: Rig) -> Rig:
    cameras = (replace(c, camera_to_world=change(c.camera_to_world)) for c in rig.cameras)
    return replace(rig, cameras=tuple(cameras))


def _scaled(positions: float, depths: float, rig: Rig) -> Rig:
    """Multiplies the positions of the cameras and the depths of a count."""
    factors = np.vstack([np.tile([1, 1, 1, positions], (3, 1)), np.ones((1, 4))])
    moved = _posed(lambda pose: pose * factors, rig)
    cameras = (replace(c, depth_scale=depths * (c.depth_scale or 1.0)) for c in moved.cameras)
    return replace(rig, cameras=tuple(cameras))


def _exchanged(one: str, other: str, rig: Rig) -> Rig:
    names = {one: other, other: one}
    renamed = (replace(c, name=names.get(c.name, c.name)) for c in rig.cameras)
    return replace(rig, cameras=tuple(renamed))


class Reading(NamedTuple):
    """What may be wrong with a camera file.

    Attributes:
        wrong: in a sentence.
        right: makes the cameras that are meant.
    """

    wrong: str
    right: Callable[[Rig], Rig]


_READINGS = (
    Reading(
        "the poses are inverted: they lead from the world to the cameras, as extrinsics do",
        partial(_posed, _inverted),
    ),
    Reading(
        "the cameras have the axes of OpenGL, x right, y up, z back, instead of those of OpenCV",
        partial(_posed, _flipped),
    ),
    Reading(
        "the poses are inverted, from the world to the cameras, which have the axes of OpenGL",
        partial(_posed, lambda pose: _flipped(_inverted(pose))),
    ),
    Reading("the rotations of the poses are transposed", partial(_posed, _transposed)),
    Reading(
        "the depths are in millimetres, so that depth_scale is 1000 times too large",
        partial(_scaled, 1, 1e-3),
    ),
    Reading(
        "the depths are in metres and everything else in millimetres, so that depth_scale is 1000 "
        "times too small",
        partial(_scaled, 1, 1e3),
    ),
    Reading(
        "the positions of the cameras are in millimetres and everything else in metres",
        partial(_scaled, 1e-3, 1),
    ),
    Reading(
        "positions and depths of the cameras are in millimetres and the template in metres",
        partial(_scaled, 1e-3, 1e-3),
    ),
)


def readings_of(rig: Rig) -> Iterator[Reading]:
    """Yields what may be wrong with the cameras of a rig."""
    yield from _READINGS
    for one, other in combinations([camera.name for camera in rig.cameras], 2):
        yield Reading(
            f"cameras {one!r} and {other!r} are exchanged: each has the images of the other",
            partial(_exchanged, one, other),
        )


class Fit(NamedTuple):
    """How a scan lies on a template.

    Attributes:
        far: the share of the points that are far from it.
        by_camera: the same of each camera.
    """

    far: float
    by_camera: tuple[float, ...]


def fit_of(scan: DepthScan, surface: Surface, *, moves: bool = True) -> Fit:
    """Compares a scan, in the unit of the template, also after the rigid motion of tracking."""
    clouds = [_subject(cloud, surface) for cloud in scan.clouds]
    cloud = np.concatenate(clouds)
    extents = [np.linalg.norm(np.ptp(one, axis=0)) for one in clouds if len(one)]
    if len(cloud) < _LEAST or max(extents) < _COVERED * surface.size:
        return Fit(1.0, (1.0,) * len(clouds))
    found = find_alignment(surface.faces, surface.points, cloud)
    most = max(_FAR * surface.size, _FAR_EDGES * surface.mean_edge)
    ways = [cloud, (cloud - found.shift) @ found.rotation][: 1 + moves]
    far = min((surface.distances(one) > most for one in ways), key=np.mean)
    each = np.split(far, np.cumsum([len(one) for one in clouds])[:-1])
    return Fit(float(far.mean()), tuple(float(one.mean()) if len(one) else 0.0 for one in each))


def _subject(cloud: _Floats, surface: Surface) -> _Floats:
    """Returns some of the points of a camera, without floor and walls."""
    some = cloud[:: 1 + len(cloud) // _EXAMINED]
    for plane in planes_of_room(some, thickness=surface.mean_edge, size=surface.size):
        some = some[~plane.holds(some)]
    return some[:: 1 + len(some) // _POINTS]
