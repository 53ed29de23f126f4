"""The methods that the paper compares with, which complete each frame separately (section 4)."""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _core
from ._arrays import Mask, Positions
from ._checks import check_integer
from .polygons import Faces

__all__ = ["LaplacianInterpolation", "LeastSquaresMesh"]


class _Baseline:
    _core: Any

    def complete(
        self, points: Positions, known: Mask, *, previous: Positions | None = None
    ) -> NDArray[np.float64]:
        """Completes one frame, independently of all others.

        Args:
            points: positions, (k, 3) float32 or float64. Rows that are not known are ignored.
            known: the known mask, (k,) bool. At least one vertex of each component must be known.
            previous: a complete frame, (k, 3). If given, the method is applied to the motion
                vectors from it instead of to the positions.

        Returns:
            The completed frame, (k, 3) float64.
        """
        frame = _arrays.points("points", points, np.float64)
        completed = np.empty(frame.shape)
        before = None if previous is None else _arrays.points("previous", previous, np.float64)
        self._core.complete(frame, _arrays.known_mask(known), before, completed)
        return completed


class LeastSquaresMesh(_Baseline):
    """Least-squares meshes (Sorkine and Cohen-Or 2004), in which known vertices move as well.

    Minimises |L x|^2 + sum over the known vertices of |x_i - given_i|^2, where L is the
    combinatorial Laplacian, of faces of k vertices. An object may be used by one thread at a time.
    """

    def __init__(self, faces: Faces, n_vertices: int) -> None:
        self._core = _core.least_squares_mesh(*_mesh(faces, n_vertices))


class LaplacianInterpolation(_Baseline):
    """Laplacian interpolation (Oostendorp et al. 1989), in which known vertices do not move.

    An object may be used by one thread at a time.

    Args:
        faces: (m, 3) integers, or other polygons; see :data:`dynmesh.polygons.Faces`.
        n_vertices: the number of vertices, k.
        objective: "harmonic" sets (L x)_i = 0 at the unknown vertices; "least_squares" minimises
            |L x|.
        weights: "uniform", or "inverse_distance", measured on `reference`.
        reference: a frame, (k, 3). Required for weights "inverse_distance" only.
    """

    def __init__(
        self,
        faces: Faces,
        n_vertices: int,
        *,
        objective: Literal["least_squares", "harmonic"] = "least_squares",
        weights: Literal["uniform", "inverse_distance"] = "uniform",
        reference: Positions | None = None,
    ) -> None:
        frame = None if reference is None else _arrays.points("reference", reference, np.float64)
        self._core = _core.laplacian_interpolation(
            *_mesh(faces, n_vertices), objective, weights, frame
        )


def _mesh(faces: Faces, n_vertices: int) -> tuple[NDArray[np.int32], int]:
    check_integer("n_vertices", n_vertices, 0, np.iinfo(np.int32).max)
    return _arrays.triangles(faces, n_vertices), n_vertices
