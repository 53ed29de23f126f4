"""A frame of a sequence, and the header that describes all frames."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._checks import check_array, check_integer
from ..polygons import Polygons
from ..sequence import (
    Mask,
    Positions,
    Provenance,
    check_corners,
    check_derived,
    check_description,
    check_faces,
    check_times,
    check_vertices,
)


@dataclass(frozen=True, eq=False, slots=True)
class Frame:
    """One frame of a sequence. It can be unpacked: ``points, known = frame``.

    Attributes:
        points: (k, 3)
        known: (k,), or None if the sequence has no masks.
        generation: (k,), or None if the sequence has no provenance.
        age: (k,), or None if `generation` is.
    """

    points: Positions
    known: Mask | None = None
    generation: Provenance | None = None
    age: Provenance | None = None

    def __iter__(self) -> Iterator[Any]:
        """Yields the points and the mask."""
        yield self.points
        yield self.known


@dataclass(frozen=True, eq=False)
class Header:
    """The properties that all frames of a file share.

    Attributes:
        faces: (m, 3) integers, triangles.
        n_frames: n.
        n_vertices: k.
        dtype: of the positions, float32 or float64.
        fps: frames per second, or None.
        polygons: the faces before they were cut into triangles, or None if all were triangles.
        up_axis: "y" or "z", or None.
        name: path of the mesh in its file, or None.
        start: the number of the first frame in its file; see :class:`dynmesh.Sequence`.
        times: (n,) float64, the number of each frame in its file, or None if the numbers follow
            from `start`.
        metres_per_unit: length of a unit of the positions, or None.
        has_known: whether each frame has a known mask.
        has_provenance: whether each frame has the generation and the age of its vertices.
        derived: what else in the file follows from the positions, or None; see
            :class:`dynmesh.Sequence`.
    """

    faces: NDArray[np.integer[Any]]
    n_frames: int
    n_vertices: int
    dtype: np.dtype[Any]
    fps: float | None = None
    polygons: Polygons | None = None
    up_axis: str | None = None
    name: str | None = None
    start: float = 0
    times: NDArray[np.float64] | None = None
    metres_per_unit: float | None = None
    has_known: bool = False
    has_provenance: bool = False
    derived: Mapping[str, str] | None = None

    def __post_init__(self) -> None:
        """Raises an error unless the properties are consistent."""
        check_integer("n_frames", self.n_frames, 0)
        check_integer("n_vertices", self.n_vertices, 0)
        check_array("faces", self.faces)
        check_vertices(self.dtype, (self.n_frames, self.n_vertices, 3))
        check_faces(self.faces.dtype, self.faces.shape)
        check_corners(self.faces, self.n_vertices)
        check_times(self.times, self.n_frames)
        check_description(
            self.fps, self.polygons, self.up_axis, self.name, self.start, self.metres_per_unit
        )
        check_derived(self.derived)
