"""Poses and intrinsics in JSON, as lists of rows."""

import math
import reprlib
from typing import Any

import numpy as np

from .._arrays import Floats
from .._checks import check_finite
from .._errors import InputError

_ROUNDED = 1e-3
"""By how much a rotation may deviate from an exact one, as it was written with a few digits."""


def matrix_of(name: str, value: Any, size: int) -> Floats:
    """Returns a square matrix from its rows."""
    if not _is_square(value, size):
        raise InputError(
            f"{name}: must be {size} rows of {size} numbers, not {reprlib.repr(value)}"
        )
    for number, row in enumerate(value):
        for one in row:
            check_finite(f"{name}: row {number}", one)
    result = np.array(value, np.float64)
    last = np.eye(size)[-1]
    if (result[-1] != last).any() and (result[:, -1] == last).all():
        raise InputError(
            f"{name}: its last row must be {_row(last)}, not {_row(result[-1])}; its last column "
            "is, so it is listed column by column: list it row by row"
        )
    return result


def pose_of(name: str, value: Any) -> Floats:
    """Returns (4, 4) a rotation and a position from their rows."""
    pose = matrix_of(name, value, 4)
    if pose[3].tolist() != [0, 0, 0, 1]:
        raise InputError(f"{name}: its last row must be 0 0 0 1, not {_row(pose[3])}")
    turn = pose[:3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        error = np.abs(turn.T @ turn - np.eye(3)).max()
        determinant = np.linalg.det(turn)
    if not error <= _ROUNDED:
        raise InputError(
            f"{name}: its columns must be unit vectors at right angles, but they deviate "
            f"by {error:.3g}"
        )
    if determinant < 0:
        raise InputError(
            f"{name}: mirrors (determinant {determinant:.3g}); the axes are x right, "
            "y down, z ahead"
        )
    return pose


def pose_or_lost(name: str, value: Any) -> Floats:
    """Returns the same; NaN for a pose that was lost, with numbers that are not finite."""
    numbers = [one for row in value for one in row] if _is_square(value, 4) else []
    if any(isinstance(one, float) and not math.isfinite(one) for one in numbers):
        return np.full((4, 4), np.nan)
    return pose_of(name, value)


def inverted(poses: Floats) -> Floats:
    """Returns (..., 4, 4) the inverse motions; NaN of those that were lost."""
    turns = np.swapaxes(poses[..., :3, :3], -1, -2)
    result = np.broadcast_to(np.eye(4), poses.shape).copy()
    result[..., :3, :3] = turns
    result[..., :3, 3] = -(turns @ poses[..., :3, 3, None])[..., 0]
    return result


def _is_square(value: Any, size: int) -> bool:
    rows = value if isinstance(value, list) else []
    return len(rows) == size and all(isinstance(row, list) and len(row) == size for row in rows)


def intrinsics_of(name: str, value: Any) -> Floats:
    """Returns (3, 3) a matrix that leads from the axes of a camera to its pixels.

    A negative fx or fy is that of an image that is mirrored, as in ICL-NUIM.
    """
    matrix = matrix_of(name, value, 3)
    is_upper = matrix[2].tolist() == [0, 0, 1] and matrix[1, 0] == 0
    if not is_upper or 0 in (matrix[0, 0], matrix[1, 1]):
        rows = "; ".join(map(_row, matrix))
        raise InputError(
            f"{name}: must be fx s cx; 0 fy cy; 0 0 1, with fx and fy that are not 0, not {rows}"
        )
    return matrix


def _row(values: Floats) -> str:
    return " ".join(f"{value:g}" for value in values)
