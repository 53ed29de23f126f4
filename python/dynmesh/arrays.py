"""Frames that are held in memory."""

from collections.abc import Iterator
from collections.abc import Sequence as Some
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self, overload

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ._arrays import Integers, Mask, Positions
from ._checks import as_array, check_array
from .attributes import ATTRIBUTES, VertexAttributes, as_mask, check_needed, flags_of
from .frames import Frame, Indices, Stored, as_array_of
from .header import (
    Description,
    Header,
    check_corners,
    check_faces,
    check_vertices,
    rate,
    summary,
)


@dataclass(frozen=True, eq=False)
class ArrayFrames(Description, VertexAttributes, Stored):
    """Frames of one fixed connectivity in memory: what a :class:`dynmesh.Sequence` holds.

    Attributes:
        vertices: (n, k, 3) float32 or float64. Values are arbitrary where ``known`` is False.
        faces: (m, 3) integers, triangles. Other polygons, as :data:`dynmesh.polygons.Faces`, are
            cut into triangles and kept as `polygons`.
        known: (n, k) bool, or integers 0 and 1, or None if every position was observed.
        generation: (n, k) int32, 0 for anchors, g for satellites, -1 for disconnected vertices, -2
            for those that were put together from other frames, or None. If there are generations,
            only vertices of generation 0 were observed; when the sequence is completed again, the
            others are estimated again.
        age: (n, k) int32, frames since the vertex was last observed; None if `generation` is.
        standard_error: (n, k) float32, how far each vertex may be off, in the unit of the
            positions; `standard_error_of` says in which sense: see
            :attr:`dynmesh.Completer.standard_error` and :attr:`dynmesh.Tracker.standard_error`.
            None if it was not estimated.

    The attributes of :class:`dynmesh.Description`, from `fps` to `origin`, are keywords as well.

    Raises:
        TypeError: an array has the wrong kind.
        ValueError: an array has the wrong shape, a face refers to a vertex that does not exist,
            ``fps`` or ``metres_per_unit`` is not positive and finite, ``times`` do not ascend,
            ``start`` is so large that frames cannot be counted, or the step of a slice is not
            positive.
        IndexError: there is no such frame.
    """

    vertices: Positions
    faces: NDArray[np.integer[Any]]
    known: Mask | None = None

    def __post_init__(self) -> None:
        """Converts lists and polygons, and raises an error unless the arrays are consistent."""
        for name in ("vertices", "times", *self.attributes()):
            whole = np.float64 if name in ("vertices", "times") else None
            object.__setattr__(self, name, as_array(name, getattr(self, name), whole))
        if np.ndim(self.vertices) == 3:
            self._take_faces(self.vertices.shape[1])
        arrays = {"vertices": self.vertices, "faces": self.faces, **self.attributes()}
        if self.times is not None:
            arrays["times"] = self.times
        for name, array in arrays.items():
            check_array(name, array)
        check_vertices(self.vertices.dtype, self.vertices.shape)
        check_faces(self.faces.dtype, self.faces.shape)
        check_corners(self.faces, self.vertices.shape[1])
        frames = self.vertices.shape[:2]
        check_needed(self.attributes())
        for name, values in self.attributes().items():
            ATTRIBUTES[name].check(values.dtype, values.shape, frames)
        if self.known is not None:
            object.__setattr__(self, "known", as_mask(self.known))
        self._check_description(len(self.vertices))

    def __repr__(self) -> str:
        """Describes the sequence without its numbers."""
        masks = "no masks"
        if self.known is not None:
            masks = f"{100 * np.count_nonzero(self.known) / max(1, self.known.size):.3g} % known"
        counts = summary(self.n_frames, self.n_vertices, len(self.faces), self.dtype)
        return f"{type(self).__name__}({counts}, {masks}, {rate(self.fps)})"

    @cached_property
    def header(self) -> Header:  # type: ignore[override]
        """What all frames share."""
        n_frames, n_vertices, _ = self.vertices.shape
        what = {**flags_of(self.attributes()), **self.described()}
        return Header(self.faces, n_frames, n_vertices, self.vertices.dtype, **what)

    @property
    def path(self) -> Path:  # type: ignore[override]
        """What messages call the sequence."""
        return Path(vars(self).get("called", "sequence"))

    def named(self, name: str, files: Some[Path] = ()) -> Self:
        """The same sequence, which messages call by this name, and which was read from files."""
        other = copy(self)
        vars(other).update(called=name, files=files)
        return other

    def close(self) -> None:
        """Does nothing: frames in memory stay there."""

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        rows: dict[str, Any] = self.attributes()
        for number in numbers:
            values = {name: array[number] for name, array in rows.items()}
            yield Frame(self.vertices[number], **values)

    def _chosen(self, indices: Indices) -> Self:
        at = (
            slice(indices.start, indices.stop, indices.step)
            if isinstance(indices, range)
            else indices
        )
        rows: dict[str, Any] = {name: array[at] for name, array in self.attributes().items()}
        header = self.header.of_frames(indices)
        return replace(
            self, vertices=self.vertices[at], **rows, start=header.start, times=header.times
        )

    @overload
    def __getitem__(self, frames: int | np.integer[Any]) -> Frame: ...
    @overload
    def __getitem__(self, frames: slice | Some[int] | Integers) -> Self: ...
    def __getitem__(
        self, frames: int | np.integer[Any] | slice | Some[int] | Integers
    ) -> "Frame | Self":
        """A frame, or a sequence of some of the frames; see the class."""
        result: Frame | Self = super().__getitem__(frames)  # type: ignore[assignment]
        return result

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """The vertices, NaN where the mask says that they are not known."""
        return as_array_of(self.vertices, self.known, dtype, copy)
