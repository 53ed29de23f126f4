"""Which points that are far from a tracked mesh belong to a floor or a wall that was left in."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..sequence import Positions
from .planes import planes_of_room
from .surface_distance import Surface

_EXAMINED = 4000
"""Points of all sensors."""

_LEAST = 30
"""Far points, of which less tell nothing."""

_SIZE = 0.35
"""The least diameter of a plane, relative to the diagonal of the mesh: a crop leaves little."""

_SIZE_FOR_SHEETS = 1.5
"""The same for a sheet: a part of cloth that is not where the mesh is may be flat, too."""

_BOUNDARY = 8
"""A mesh is a sheet if the square of its boundary edges is at least so many times its vertices. A
disc has 4 pi, other sheets have more, and bodies that are open at the neck have less."""

_SHARE = 0.1
"""The least share of the far points that such a plane holds."""

_FLAT = 0.8
"""A plane holds at least this share of the points within thrice its thickness: a slice of a body
that is not where the mesh is holds a third."""

_PARALLEL = np.cos(np.radians(20))
_MOST_PARALLEL = 1 / 3
"""No plane is looked for that is parallel to so much of the mesh: a sheet that moves away from the
mesh is flat, too."""


def shares_in_planes(
    faces: NDArray[np.integer[Any]], vertices: Positions, clouds: Sequence[Positions]
) -> list[float]:
    """Returns which share of the points that are far from a mesh lies in planes of a room.

    Args:
        faces: (m, 3) triangles.
        vertices: (k, 3) the mesh as it was tracked.
        clouds: (n, 3) what each sensor measured, in the unit of the mesh.

    Returns:
        The share of all sensors, and that of each. A point is far beyond a mean edge.
    """
    every = 1 + sum(map(len, clouds)) // _EXAMINED
    surface = Surface(faces, vertices)
    far = []
    for cloud in clouds:
        some = cloud[::every].astype(np.float64)
        far.append(some[surface.distances(some) > surface.mean_edge])
    points = np.concatenate(far)
    inside = np.zeros(len(points), np.bool_)
    if len(points) >= _LEAST:
        thickness = surface.mean_edge
        size = (_SIZE_FOR_SHEETS if _is_sheet(faces) else _SIZE) * surface.size
        for plane in planes_of_room(points, thickness=thickness, size=size, share=_SHARE):
            around = plane._replace(thickness=3 * plane.thickness).holds(points)
            own = plane.holds(points)
            parallel = np.abs(surface.normals @ plane.normal) > _PARALLEL
            if own.sum() >= _FLAT * around.sum() and parallel.mean() < _MOST_PARALLEL:
                inside |= around
    ends = np.cumsum([len(one) for one in far])[:-1]
    parts = [inside, *np.split(inside, ends)]
    return [float(part.mean()) if len(part) else 0.0 for part in parts]


def _is_sheet(faces: NDArray[np.integer[Any]]) -> bool:
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    counts = np.unique(sides, axis=0, return_counts=True)[1]
    return bool(np.count_nonzero(counts == 1) ** 2 >= _BOUNDARY * len(np.unique(faces)))
