"""Errors of completed frames (section 4 of the paper, "Metrics")."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._arrays import Positions, first_frame, floats, packed, triangles
from ._errors import InputError
from .polygons import Faces

__all__ = ["bounding_box_diagonal", "nmsve", "vertex_error"]


def bounding_box_diagonal(frame: Positions) -> float:
    """Returns the length of the diagonal of the axis-aligned bounding box of a (k, 3) frame."""
    points = first_frame("frame", frame).astype(np.float64)
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def nmsve(faces: Faces, reference: Positions, completed: Positions) -> Any:
    """Normalised mean square visual error (paper, eq. 5 and 6).

    1/(2k) times the sum of |v_i - v'_i| + |GL(v_i) - GL(v'_i)| over all vertices, where GL(v_i) is
    v_i minus the mean of its neighbours weighted by inverse distance. The time is linear in the
    number of edges.

    Args:
        faces: (m, 3) integers, or other polygons; see :data:`dynmesh.polygons.Faces`.
        reference: a frame (k, 3) or n frames (n, k, 3), float32 or float64, finite.
        completed: the completed frame or frames, of the same shape.

    Returns:
        The error in the unit of the positions: a float, or (n,) float64 for n frames.
    """
    true, result = _pair(reference, completed)
    errors = np.empty(len(true))
    _core.nmsve(triangles(faces, true.shape[1]), true, result, errors)
    return errors if np.ndim(reference) == 3 else float(errors[0])


def vertex_error(reference: Positions, completed: Positions) -> NDArray[np.float64]:
    """The error |v_i - v'_i| of each vertex, the heatmap of the paper.

    Args:
        reference: a frame (k, 3) or n frames (n, k, 3), float32 or float64, finite.
        completed: the completed frame or frames, of the same shape.

    Returns:
        The errors (k,) or (n, k), float64, in the unit of the positions.
    """
    true, result = _pair(reference, completed)
    errors = np.empty(true.shape[:2])
    _core.vertex_error(true, result, errors)
    return errors if np.ndim(reference) == 3 else errors[0]


def _pair(reference: Any, completed: Any) -> tuple[Positions, Positions]:
    """Both as packed arrays (n, k, 3)."""
    true, result = floats("reference", reference), floats("completed", completed)
    for name, array in (("reference", true), ("completed", result)):
        if array.ndim not in (2, 3) or array.shape[-1] != 3:
            message = f"must have shape (k, 3) or (n, k, 3), not {array.shape}"
            raise InputError(message, argument=name)
    if true.shape != result.shape:
        raise InputError(
            f"has shape {result.shape}, but the reference has {true.shape}", argument="completed"
        )
    true, result = (packed(array, np.float64) for array in (true, result))
    return (true, result) if true.ndim == 3 else (true[None], result[None])
