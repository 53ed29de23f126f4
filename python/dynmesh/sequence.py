"""A dynamic mesh held in memory."""

import math
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Positions: TypeAlias = NDArray[np.floating[Any]]
"""float32 or float64, x, y, z on the last axis, in any unit of length."""

Mask: TypeAlias = NDArray[np.bool_]
"""True where a position was observed in its frame."""


@dataclass(frozen=True, eq=False)
class Sequence:
    """Frames of one fixed connectivity.

    Attributes:
        vertices: (n, k, 3) float32 or float64. Where ``known`` is False the value means nothing.
        faces: (m, 3) integers, triangles.
        known: (n, k) bool, or None where every position was observed.
        fps: frames per second, or None where nobody said.

    Raises:
        TypeError: an array of another kind.
        ValueError: an array of another shape, or ``fps`` not positive and finite.
    """

    vertices: Positions
    faces: NDArray[np.integer[Any]]
    known: Mask | None = None
    fps: float | None = None

    def __post_init__(self) -> None:
        """Refuses arrays that do not fit together."""
        for name in ("vertices", "faces", "known"):
            value = getattr(self, name)
            if not isinstance(value, np.ndarray) and not (name == "known" and value is None):
                raise TypeError(f"{name}: must be a numpy array, not {type(value).__name__}")
        check_vertices(self.vertices.dtype, self.vertices.shape)
        check_faces(self.faces.dtype, self.faces.shape)
        if self.known is not None:
            check_known(self.known.dtype, self.known.shape, self.vertices.shape[:2])
        if self.fps is not None:
            check_fps(self.fps)


def check_vertices(dtype: np.dtype[Any], shape: tuple[int, ...]) -> None:
    """Refuses what cannot be the vertices of a sequence."""
    if dtype.kind != "f" or dtype.itemsize not in (4, 8):
        raise TypeError(f"vertices: must be float32 or float64, not {dtype}")
    if len(shape) != 3 or shape[2] != 3:
        raise ValueError(f"vertices: must have shape (n, k, 3), not {shape}")


def check_faces(dtype: np.dtype[Any], shape: tuple[int, ...]) -> None:
    """Refuses what cannot be the faces of a sequence."""
    if dtype.kind not in "iu":
        raise TypeError(f"faces: must be integers, not {dtype}")
    if len(shape) != 2 or shape[1] != 3:
        raise ValueError(f"faces: must have shape (m, 3), not {shape}")


def check_known(dtype: np.dtype[Any], shape: tuple[int, ...], expected: tuple[int, ...]) -> None:
    """Refuses what cannot be the known masks of (n, k) = ``expected`` vertices."""
    if dtype.kind != "b":
        raise TypeError(f"known: must be bool, not {dtype}")
    if shape != expected:
        raise ValueError(f"known: must have shape {expected}, as vertices say, not {shape}")


def check_fps(fps: float) -> None:
    """Refuses what cannot be frames per second."""
    if not (math.isfinite(fps) and fps > 0):
        raise ValueError(f"fps: must be positive and finite, not {fps}")
