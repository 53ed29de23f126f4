"""The methods that the paper compares with, which complete each frame separately (section 4).

The classes can be reused for many frames of one mesh; the functions complete a single frame.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ._core import LaplacianInterpolation, LeastSquaresMesh
from ._errors import KindError
from .polygons import Faces
from .sequence import Mask, Positions

__all__ = [
    "LaplacianInterpolation",
    "LeastSquaresMesh",
    "laplacian_interpolation",
    "least_squares_mesh",
]


def least_squares_mesh(
    faces: Faces,
    points: Positions,
    known: Mask,
    *,
    previous: Positions | None = None,
) -> NDArray[np.float64]:
    """Completes a frame as :class:`LeastSquaresMesh` does, which also moves known vertices.

    Args:
        faces: (m, 3) integers, or other polygons; see :data:`dynmesh.polygons.Faces`.
        points: (k, 3); rows that are not known are ignored.
        known: (k,) bool, at least one vertex of each component.
        previous: (k, 3), a complete frame; if given, the motion since then is completed.

    Raises:
        ValueError, TypeError: bad input, such as a component without a known vertex.
    """
    return LeastSquaresMesh(faces, _rows(points)).complete(points, known, previous=previous)


def laplacian_interpolation(
    faces: Faces,
    points: Positions,
    known: Mask,
    *,
    objective: Literal["least_squares", "harmonic"] = "least_squares",
    weights: Literal["uniform", "inverse_distance"] = "uniform",
    reference: Positions | None = None,
    previous: Positions | None = None,
) -> NDArray[np.float64]:
    """Completes a frame as :class:`LaplacianInterpolation` does, without moving known vertices.

    Args:
        faces: (m, 3) integers, or other polygons; see :data:`dynmesh.polygons.Faces`.
        points: (k, 3); rows that are not known are ignored.
        known: (k,) bool, at least one vertex of each component.
        objective: "harmonic": (L x)_i = 0 at the unknown vertices; "least_squares": min |L x|.
        weights: "uniform", or "inverse_distance", measured on `reference`.
        reference: (k, 3), required for "inverse_distance" only.
        previous: (k, 3), a complete frame; if given, the motion since then is completed.

    Raises:
        ValueError, TypeError: bad input, such as a component without a known vertex.
    """
    system = LaplacianInterpolation(
        faces, _rows(points), objective=objective, weights=weights, reference=reference
    )
    return system.complete(points, known, previous=previous)


def _rows(points: Positions) -> int:
    shape: tuple[int, ...] = np.shape(points)
    if not shape:
        raise KindError(f"must be (k, 3) positions, not {points!r}", argument="points")
    return shape[0]
