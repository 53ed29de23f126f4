"""A room around a subject: a floor below it and a wall behind it, which sensors measure, too."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._checks import as_array, check_complete, check_positions
from .._errors import InputError
from ..sequence import Positions
from .visibility import horizon

_FLOOR = 4.0
"""Half the length of each side of the floor, and half the width of the wall."""

_WALL = 2.5
"""How far the wall is from the middle of the subject; :func:`orbit` puts cameras at 2."""

_HEIGHT = 3.0


class Room(NamedTuple):
    """A mesh of what surrounds a subject.

    Attributes:
        points: (n, 3) float64.
        faces: (m, 3) triangles of these points.
    """

    points: NDArray[np.float64]
    faces: NDArray[np.int64]


def room_around(subject: Positions, *, up: tuple[float, float, float] = (0, 0, 1)) -> Room:
    """Creates a floor under a mesh, and a wall opposite the first of the cameras of :func:`orbit`.

    The floor touches the lowest vertex. All lengths are in diagonals of the bounding box: the floor
    measures 8 by 8 and has the mesh in its middle, and the wall stands at 2.5, behind the cameras.

    Args:
        subject: (k, 3) finite positions: of a frame, or the corners of the box of all frames.
        up: the direction from the floor to the mesh, of any length.

    Raises:
        TypeError: an argument has the wrong kind.
        ValueError: a position is not finite, all are at one place, or `up` is zero.
    """
    subject = as_array("subject", subject, np.float64)
    check_positions("subject", subject)
    check_complete("subject", subject)
    ahead, left, axis = horizon(up)
    corners = np.stack([subject.min(axis=0), subject.max(axis=0)]).astype(np.float64)
    size = float(np.linalg.norm(corners[1] - corners[0]))
    if size == 0:
        raise InputError("must have vertices in more than one place", argument="subject")
    middle = corners.mean(axis=0)
    lowest = float((subject.astype(np.float64) @ axis).min())
    origin = middle + (lowest - middle @ axis) * axis

    def at(*steps: tuple[float, float, float]) -> NDArray[np.float64]:
        return np.asarray(origin + size * np.array(steps) @ np.stack([ahead, left, axis]))

    floor = at(*((x * _FLOOR, y * _FLOOR, 0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))))
    wall = at(*((-_WALL, y * _FLOOR, z) for y, z in ((-1, 0), (1, 0), (1, _HEIGHT), (-1, _HEIGHT))))
    square = np.array([[0, 1, 2], [0, 2, 3]])
    return Room(np.concatenate([floor, wall]), np.concatenate([square, square + 4]))
