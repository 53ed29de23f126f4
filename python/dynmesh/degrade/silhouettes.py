"""Silhouettes: the edges beyond which a camera sees past the surface."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..sequence import Positions
from .shared import unit
from .visibility import Camera, visible

_Integers = NDArray[np.integer[Any]]
_Floats = NDArray[np.float64]


class Silhouettes:
    """The edges of a mesh of which one side faces a camera and the other does not, or is absent."""

    def __init__(self, faces: _Integers) -> None:
        """Finds the edges of the triangles, (m, 3)."""
        sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        self._faces = faces
        self._edges, inverse = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
        self._edge = inverse.reshape(-1)  # of each side
        self._face = np.tile(np.arange(len(faces)), 3)

    def seen_by(self, points: Positions, camera: Camera) -> _Integers:
        """Returns the (e, 2) vertices of the edges of a silhouette, hidden or not."""
        a, b, c = points.astype(np.float64)[self._faces.T]
        rays = a - camera.position
        faces_camera = np.einsum("mx,mx->m", np.cross(b - a, c - a), rays) < 0
        facing = np.bincount(self._edge, faces_camera[self._face], len(self._edges))
        present = np.bincount(self._edge, minlength=len(self._edges))
        borders = (facing > 0) & (facing < present) | (present == 1)
        return np.asarray(self._edges[borders])

    def flying(
        self, points: Positions, cameras: Sequence[Camera], wanted: int, rng: "np.random.Generator"
    ) -> tuple[_Floats, _Floats]:
        """Returns about as many visible points of silhouettes, evenly from all cameras.

        They are (n, 3), fewer if some are hidden, as are the unit vectors away from the cameras.
        """
        places, rays = [np.zeros((0, 3))], [np.zeros((0, 3))]
        for number, camera in enumerate(cameras):
            n = wanted * (number + 1) // len(cameras) - wanted * number // len(cameras)
            ends = points.astype(np.float64)[self.seen_by(points, camera)]
            lengths = np.nan_to_num(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))
            if n == 0 or not lengths.any():
                continue
            edge = rng.choice(len(ends), n, p=lengths / lengths.sum())
            share = rng.random((n, 1))
            place = ends[edge, 0] * (1 - share) + ends[edge, 1] * share
            everything = np.concatenate([points.astype(np.float64), place])
            among = np.arange(len(everything)) >= len(points)
            seen = visible(everything, self._faces, camera, among)[len(points) :]
            ray = place[seen] - camera.position
            places.append(place[seen])
            rays.append(unit(ray))
        return np.concatenate(places), np.concatenate(rays)
