"""What a simulated sensor looks at: a frame, the cameras, and what returns nothing."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, repeat
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..polygons import Faces
from ..sequence import Mask, Positions
from .losses import patch_known
from .shared import check_cameras, mean_edge_of, numbered, triangles_of
from .visibility import Camera, orbit

_Integers = NDArray[np.integer[Any]]

Cameras: TypeAlias = int | Sequence[Camera] | Callable[[int], Sequence[Camera]]
"""A number of cameras that stand around frame 0; cameras; or those of each frame."""

EDGE_ON = 0.1
"""The cosine of the angle between normal and ray below which a sensor measures nothing, which is
about 84 degrees."""

_HOLES = 6
"""Holes at a time; each stays for 15 frames."""


class Scene(NamedTuple):
    """A frame, and who looks at it."""

    number: int
    points: Positions
    faces: _Integers
    cameras: Sequence[Camera]
    present: Mask
    """(k,) False in holes."""
    mean_edge: float
    """Of frame 0."""


def scenes_of(
    frames: Iterable[Positions],
    faces: Faces,
    cameras: Cameras,
    holes: float,
    up: tuple[float, float, float],
    seed: int,
) -> Iterator[Scene]:
    """Yields the frames with those who look at them."""
    rest = numbered(frames)
    first = next(rest, None)
    if first is None:
        return
    mean_edge = mean_edge_of(first[1], faces)  # refuses polygons with corners that are no vertex
    triangles = triangles_of(faces)
    k = len(first[1])
    if isinstance(cameras, int):
        cameras = orbit(first[1], cameras, degrees_per_frame=0.0, up=up)
    present: Iterator[Mask] = repeat(np.ones(k, np.bool_))
    if holes:
        endless = 1 << 62  # frames; only those that exist are asked for
        present = patch_known(triangles, endless, k, holes, patches=_HOLES, seed=seed)
    for (number, points), mask in zip(chain([first], rest), present, strict=False):
        own = cameras(number) if callable(cameras) else cameras
        check_cameras(own, f"frame {number} has none")
        yield Scene(number, points, triangles, own, mask, mean_edge)
