"""A dynamic mesh held in memory."""

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, TypeAlias, get_args, overload

import numpy as np
from numpy.typing import NDArray

from ._arrays import Mask as Mask
from ._arrays import Positions as Positions
from ._checks import (
    as_array,
    check_array,
    check_integer,
    check_number,
    check_positive,
    check_times,
    frame_index,
)
from ._errors import InputError, KindError
from .attributes import ATTRIBUTES, VertexAttributes, as_mask, check_needed
from .polygons import Polygons, check_exist, check_polygons, split_faces, split_polygons

StandardErrorOf: TypeAlias = Literal["position", "surface"]
"""What standard errors are of: a coordinate of the position of a vertex, as
:class:`dynmesh.Completer` reports them, or its distance from the true surface, as
:class:`dynmesh.Tracker` does, which says nothing of how far it is off along the surface."""

largest_start = 2**53
"""float64 cannot represent all larger whole numbers."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Description:
    """What a sequence says of itself beside its mesh and its frames.

    :class:`dynmesh.Sequence` and :class:`dynmesh.Header` have these attributes too.

    Attributes:
        fps: frames per second, or None if unknown.
        polygons: the faces before they were cut into triangles, or None if all of them were
            triangles.
        up_axis: "x", "y" or "z", or None if unknown.
        name: the path of the mesh in its file, such as "/world/body", or None.
        start: the number of the first frame in its file, such as 1001; may be fractional in USD.
            Messages, tables, pictures and options call frames by such numbers. Frames of arrays,
            also of a :class:`dynmesh.Sequence`, are counted from 0.
        times: (n,) float64, the ascending numbers of the frames in their file, or None if they are
            `start`, `start` + 1 and so on. `fps` of them are a second in either case.
        metres_per_unit: the length of a unit of the positions, or None if unknown.
        standard_error_of: what the standard errors are of, if there are any: "position", a
            coordinate of the vertex, as in :class:`dynmesh.Completer`, or "surface", its distance
            from the true surface, as in :class:`dynmesh.Tracker`.
    """

    fps: float | None = None
    polygons: Polygons | None = None
    up_axis: str | None = None
    name: str | None = None
    start: float = 0
    times: NDArray[np.float64] | None = None
    metres_per_unit: float | None = None
    standard_error_of: StandardErrorOf = "position"

    def described(self) -> dict[str, Any]:
        """These attributes alone, by name: the keywords of another description."""
        return {field.name: getattr(self, field.name) for field in fields(Description)}

    def number(self, frame: int) -> int | float:
        """The number, in its file, of a frame that is counted from 0; see `start`."""
        number = self.start + frame if self.times is None else float(self.times[frame])
        return int(number) if number == int(number) else number

    def _take_faces(self: Any, n_vertices: int) -> None:
        """Cuts faces that are polygons into triangles; others must be those of the polygons."""
        faces, polygons = split_faces(self.faces, n_vertices)
        object.__setattr__(self, "faces", faces)
        if polygons is not None:
            object.__setattr__(self, "polygons", polygons)
        elif self.polygons is not None and not np.array_equal(
            split_polygons(self.polygons)[0], faces
        ):
            told = "are cut into other triangles than faces; give faces alone, with polygons None"
            raise InputError(told, argument="polygons")

    def _check_description(self, n_frames: int) -> None:
        """Refuses what cannot be said of a sequence of n frames."""
        for argument in ("fps", "metres_per_unit"):
            if (value := getattr(self, argument)) is not None:
                check_positive(argument, value)
        if self.polygons is not None:
            check_polygons(self.polygons)
        if not isinstance(self.name, str | None):
            raise KindError(f"must be a string or None, not {self.name!r}", argument="name")
        if self.up_axis not in (None, "x", "y", "z"):
            raise InputError(f"must be 'x', 'y' or 'z', not {self.up_axis!r}", argument="up_axis")
        check_number("start", self.start)
        if not abs(self.start) <= largest_start:
            raise InputError(f"must be from -2**53 to 2**53, not {self.start}", argument="start")
        check_times(self.times, n_frames)
        if self.standard_error_of not in get_args(StandardErrorOf):
            told = f"must be 'position' or 'surface', not {self.standard_error_of!r}"
            raise InputError(told, argument="standard_error_of")


@dataclass(frozen=True, eq=False)
class Sequence(Description, VertexAttributes):
    """Frames of one fixed connectivity.

    ``len(sequence)`` is the number of frames n, and iteration yields the positions of one frame
    after another. ``sequence[7]`` returns the positions of frame 7, (k, 3), and ``sequence[-1]``
    those of the last. ``sequence[10:50:2]`` is a Sequence of some of the frames, with their masks,
    generations and ages. Neither copies the arrays. The frames keep their numbers and times:
    `start` is the number of the first, and if there is a step, `times` holds all of them, so that
    `fps` remains valid. A slice may be empty; its step must be positive, as times ascend.

    In a notebook, a sequence shows itself: as a player that needs no network if the extra `view` is
    installed, with a simplified mesh and fewer frames if it is large, and as a table.
    :func:`dynmesh.picture` draws frames.

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

    The attributes of :class:`dynmesh.Description`, from `fps` to `standard_error_of`, are keywords
    as well.

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
        n_frames, n_vertices, _ = self.vertices.shape
        counts = summary(n_frames, n_vertices, len(self.faces), self.vertices.dtype)
        return f"Sequence({counts}, {masks}, {rate(self.fps)})"

    def _repr_html_(self) -> str:
        """A player or a table, as notebooks show it."""
        from .draw.notebook import shown  # which needs this class

        return shown(self)

    def __len__(self) -> int:
        """The number of frames."""
        return len(self.vertices)

    def __iter__(self) -> Iterator[Positions]:
        """Yields the positions of each frame, (k, 3)."""
        return iter(self.vertices)

    @overload
    def __getitem__(self, frames: int | np.integer[Any]) -> Positions: ...
    @overload
    def __getitem__(self, frames: slice) -> "Sequence": ...
    def __getitem__(self, frames: int | np.integer[Any] | slice) -> "Positions | Sequence":
        """The positions of a frame, or a sequence of some of the frames; see the class."""
        if not isinstance(frames, slice):
            points: Positions = self.vertices[frame_index(frames, len(self))]
            return points
        if frames.step is not None:
            check_integer("step", frames.step, 1)
        first, _, step = frames.indices(len(self))
        numbers = numbers_of(self, len(self))[frames]
        cut: dict[str, Any] = {name: values[frames] for name, values in self.attributes().items()}
        cut["vertices"] = self.vertices[frames]
        consecutive = self.times is None and step == 1
        start = float(numbers[0]) if len(numbers) else self.start + first
        return replace(self, **cut, start=start, times=None if consecutive else numbers)


def numbers_of(description: Description, n_frames: int) -> NDArray[np.float64]:
    """Returns (n,) the number of each of n frames in their file."""
    if description.times is not None:
        return description.times
    return description.start + np.arange(n_frames, dtype=np.float64)


def summary(n_frames: int, n_vertices: int, n_faces: int, dtype: np.dtype[Any]) -> str:
    """Describes the size of a sequence."""
    return f"{n_frames} frames, {n_vertices} vertices, {n_faces} faces, {dtype}"


def rate(fps: float | None) -> str:
    """Describes the frames per second."""
    return "no fps" if fps is None else f"{fps:g} fps"


def check_vertices(dtype: np.dtype[Any], shape: tuple[int, ...]) -> None:
    """Raises an error unless this describes the vertices of a sequence."""
    if dtype.kind != "f" or dtype.itemsize not in (4, 8):
        raise KindError(f"must be float32 or float64, not {dtype}", argument="vertices")
    if len(shape) != 3 or shape[2] != 3:
        raise InputError(f"must have shape (n, k, 3), not {shape}", argument="vertices")


def check_faces(dtype: np.dtype[Any], shape: tuple[int, ...]) -> None:
    """Raises an error unless this describes the faces of a sequence."""
    if dtype.kind not in "iu":
        raise KindError(f"must be integers, not {dtype}", argument="faces")
    if len(shape) != 2 or shape[1] != 3:
        raise InputError(f"must have shape (m, 3), not {shape}", argument="faces")


def check_corners(faces: NDArray[np.integer[Any]], n_vertices: int) -> None:
    """Raises an error if a face refers to a vertex that does not exist."""
    check_exist(faces.reshape(-1), np.repeat(np.arange(len(faces)), 3), n_vertices)
