"""Checks of arguments: TypeError for the wrong kind, ValueError for a value out of range."""

import math
import os
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .sequence import Positions


class SettingError(ValueError):
    """A setting that a completer refuses; the message is its name, a colon, and the reason."""


def check_integer(name: str, value: object, least: int) -> None:
    """Raises an error unless the value is an integer of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise TypeError(f"{name}: must be an integer, not {value!r}")
    if value < least:
        raise ValueError(f"{name}: must be at least {least}, not {value!r}")


def check_number(name: str, value: object) -> None:
    """Raises an error unless the value is a number."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError(f"{name}: must be a number, not {value!r}")


def check_between(name: str, value: float, low: float, high: float) -> None:
    """Raises an error unless the value is above `low` and below `high`."""
    check_number(name, value)
    if not low < value < high:
        raise ValueError(f"{name}: must be above {low} and below {high}, not {value}")


def check_finite(name: str, value: float) -> None:
    """Raises an error if the value is infinite or NaN."""
    check_number(name, value)
    if not math.isfinite(value):
        raise ValueError(f"{name}: must be finite, not {value}")


def check_positive(name: str, value: float) -> None:
    """Raises an error unless the value is finite and above 0."""
    check_number(name, value)
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name}: must be positive and finite, not {value}")


def check_vector(name: str, value: tuple[float, float, float]) -> None:
    """Raises an error unless the value is three finite numbers."""
    if not hasattr(value, "__len__"):
        raise TypeError(f"{name}: must be three numbers, not {value!r}")
    if len(value) != 3:
        raise ValueError(f"{name}: must be three numbers, not {value}")
    for coordinate in value:
        check_finite(name, coordinate)


def check_array(name: str, value: object) -> None:
    """Raises an error unless the value is an array."""
    if not isinstance(value, np.ndarray):
        raise TypeError(f"{name}: must be a numpy array, not {type(value).__name__}")


def check_path(name: str, value: object, expected: str = "a path") -> None:
    """Raises an error unless the value is a path; `expected` names everything that is accepted."""
    if not isinstance(value, str | os.PathLike):
        raise TypeError(f"{name}: must be {expected}, not {type(value).__name__}")


def check_positions(name: str, points: "Positions") -> None:
    """Raises an error unless the array holds (k, 3) positions of at least one vertex."""
    check_array(name, points)
    if points.dtype.kind != "f" or points.dtype.itemsize not in (4, 8):
        raise TypeError(f"{name}: must be float32 or float64, not {points.dtype}")
    if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
        raise ValueError(f"{name}: must have shape (k, 3) with k at least 1, not {points.shape}")


def check_complete(name: str, points: "Positions") -> None:
    """Raises an error unless all positions are finite."""
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        vertex = int(finite.argmin())
        position = tuple(points[vertex].tolist())
        raise ValueError(f"{name}: must be finite, but vertex {vertex} is at {position}")
