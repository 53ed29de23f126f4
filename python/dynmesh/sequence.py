"""A dynamic mesh held in memory."""

import math
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .polygons import Polygons, check_polygons

Positions: TypeAlias = NDArray[np.floating[Any]]
"""float32 or float64, x, y, z on the last axis, in any unit of length."""

Mask: TypeAlias = NDArray[np.bool_]
"""True where a position was observed in its frame."""

Provenance: TypeAlias = NDArray[np.integer[Any]]
"""The generation or the age of vertices, as :class:`dynmesh.Completer` tells them."""

largest_start = 2**53
"""Beyond it not every whole number is a float."""


@dataclass(frozen=True, eq=False)
class Sequence:
    """Frames of one fixed connectivity.

    Attributes:
        vertices: (n, k, 3) float32 or float64. Where ``known`` is False the value means nothing.
        faces: (m, 3) integers, triangles.
        known: (n, k) bool, or None where every position was observed.
        fps: frames per second, or None where nobody said.
        polygons: the faces as they were before they were cut into triangles, or None where they
            were triangles.
        up_axis: "y" or "z", or None where nobody said.
        name: of the mesh among others in its file, as "/world/body", or None.
        start: the number of the first frame where it comes from, as 1001; USD's may be fractional.
            Only files have it: dynmesh itself counts frames from 0 everywhere.
        generation: (n, k) int32, 0 an anchor, g a satellite, -1 unseen, or None.
        age: (n, k) int32, frames since the vertex was last observed; None as `generation` is.

    Raises:
        TypeError: an array of another kind.
        ValueError: an array of another shape, ``fps`` not positive and finite, or ``start`` so
            large that frames cannot be counted.
    """

    vertices: Positions
    faces: NDArray[np.integer[Any]]
    known: Mask | None = None
    fps: float | None = None
    polygons: Polygons | None = None
    up_axis: str | None = None
    name: str | None = None
    start: float = 0
    generation: Provenance | None = None
    age: Provenance | None = None

    def __post_init__(self) -> None:
        """Refuses arrays that do not fit together."""
        for name in ("vertices", "faces", "known", "generation", "age"):
            value = getattr(self, name)
            optional = name not in ("vertices", "faces")
            if not isinstance(value, np.ndarray) and not (optional and value is None):
                raise TypeError(f"{name}: must be a numpy array, not {type(value).__name__}")
        check_vertices(self.vertices.dtype, self.vertices.shape)
        check_faces(self.faces.dtype, self.faces.shape)
        frames = self.vertices.shape[:2]
        if self.known is not None:
            check_known(self.known.dtype, self.known.shape, frames)
        if (self.generation is None) != (self.age is None):
            raise ValueError("generation, age: must be given both or neither")
        for name in ("generation", "age"):
            if (values := getattr(self, name)) is not None:
                check_provenance(name, values.dtype, values.shape, frames)
        check_description(self.fps, self.polygons, self.up_axis, self.start)


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


def check_provenance(
    name: str, dtype: np.dtype[Any], shape: tuple[int, ...], expected: tuple[int, ...]
) -> None:
    """Refuses what cannot be the generation or the age of (n, k) = ``expected`` vertices."""
    if dtype.kind not in "iu":
        raise TypeError(f"{name}: must be integers, not {dtype}")
    if shape != expected:
        raise ValueError(f"{name}: must have shape {expected}, as vertices say, not {shape}")


def check_description(
    fps: float | None, polygons: Polygons | None, up_axis: str | None, start: float
) -> None:
    """Refuses what cannot be said of a sequence beside its frames."""
    if fps is not None and not (math.isfinite(fps) and fps > 0):
        raise ValueError(f"fps: must be positive and finite, not {fps}")
    if polygons is not None:
        check_polygons(polygons)
    if up_axis not in (None, "y", "z"):
        raise ValueError(f"up_axis: must be 'y' or 'z', not {up_axis!r}")
    if not abs(start) <= largest_start:
        raise ValueError(f"start: must be from -2**53 to 2**53, not {start}")
