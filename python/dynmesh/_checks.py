"""Refusals of arguments that are of the wrong kind (TypeError) or out of range (ValueError)."""

import math
import os
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .sequence import Positions


class SettingError(ValueError):
    """A setting of a completer that is refused: its name, a colon, and why."""


def check_integer(name: str, value: object, least: int) -> None:
    """Refuses what is no integer, or less than `least`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise TypeError(f"{name}: must be an integer, not {value!r}")
    if value < least:
        raise ValueError(f"{name}: must be at least {least}, not {value!r}")


def check_number(name: str, value: object) -> None:
    """Refuses what is no number."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError(f"{name}: must be a number, not {value!r}")


def check_between(name: str, value: float, low: float, high: float) -> None:
    """Refuses what does not lie above `low` and below `high`."""
    check_number(name, value)
    if not low < value < high:
        raise ValueError(f"{name}: must be above {low} and below {high}, not {value}")


def check_finite(name: str, value: float) -> None:
    """Refuses infinities and NaN."""
    check_number(name, value)
    if not math.isfinite(value):
        raise ValueError(f"{name}: must be finite, not {value}")


def check_positive(name: str, value: float) -> None:
    """Refuses what is no finite number above 0."""
    check_number(name, value)
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name}: must be positive and finite, not {value}")


def check_vector(name: str, value: tuple[float, float, float]) -> None:
    """Refuses what is not three finite numbers."""
    if not hasattr(value, "__len__"):
        raise TypeError(f"{name}: must be three numbers, not {value!r}")
    if len(value) != 3:
        raise ValueError(f"{name}: must be three numbers, not {value}")
    for coordinate in value:
        check_finite(name, coordinate)


def check_array(name: str, value: object) -> None:
    """Refuses what is no array."""
    if not isinstance(value, np.ndarray):
        raise TypeError(f"{name}: must be a numpy array, not {type(value).__name__}")


def check_path(name: str, value: object, expected: str = "a path") -> None:
    """Refuses what is no path; `expected` says what else might be given."""
    if not isinstance(value, str | os.PathLike):
        raise TypeError(f"{name}: must be {expected}, not {type(value).__name__}")


def check_positions(name: str, points: "Positions") -> None:
    """Refuses what is not (k, 3) positions of at least one vertex."""
    check_array(name, points)
    if points.dtype.kind != "f" or points.dtype.itemsize not in (4, 8):
        raise TypeError(f"{name}: must be float32 or float64, not {points.dtype}")
    if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
        raise ValueError(f"{name}: must have shape (k, 3) with k at least 1, not {points.shape}")


def check_complete(name: str, points: "Positions") -> None:
    """Refuses positions that are not all finite."""
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        vertex = int(finite.argmin())
        position = tuple(points[vertex].tolist())
        raise ValueError(f"{name}: must be finite, but vertex {vertex} is at {position}")
