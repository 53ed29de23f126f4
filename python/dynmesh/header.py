"""What a sequence says of itself beside its frames."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ._checks import (
    check_array,
    check_choice,
    check_integer,
    check_number,
    check_positive,
    check_times,
)
from ._errors import InputError, KindError
from .attributes import ATTRIBUTES, Attribute
from .origin import Origin
from .polygons import (
    Polygons,
    check_exist,
    check_polygons,
    split_faces,
    split_polygons,
)

Axis: TypeAlias = Literal["x", "y", "z"]

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
        origin: the file of which the mesh was read, if that holds more than is read; or None.
    """

    fps: float | None = None
    polygons: Polygons | None = None
    up_axis: str | None = None
    name: str | None = None
    start: float = 0
    times: NDArray[np.float64] | None = None
    metres_per_unit: float | None = None
    standard_error_of: StandardErrorOf = "position"
    origin: Origin | None = field(default=None, repr=False)

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
            message = (
                "are cut into other triangles than faces; give faces alone, with polygons None"
            )
            raise InputError(message, argument="polygons")

    def _check_description(self, n_frames: int) -> None:
        """Refuses what cannot be said of a sequence of n frames."""
        for argument in ("fps", "metres_per_unit"):
            if (value := getattr(self, argument)) is not None:
                check_positive(argument, value)
        if self.polygons is not None:
            check_polygons(self.polygons)
        if not isinstance(self.name, str | None):
            raise KindError(f"must be a string or None, not {self.name!r}", argument="name")
        if self.up_axis is not None:
            check_choice("up_axis", self.up_axis, Axis)
        check_number("start", self.start)
        if not abs(self.start) <= largest_start:
            raise InputError(f"must be from -2**53 to 2**53, not {self.start}", argument="start")
        check_times(self.times, n_frames)
        check_choice("standard_error_of", self.standard_error_of, StandardErrorOf)
        if not isinstance(self.origin, Origin | None):
            raise KindError("must be that of another sequence, or None", argument="origin")


@dataclass(frozen=True, eq=False)
class Header(Description):
    """The properties that all frames share.

    Attributes:
        faces: (m, 3) integers, triangles; or other polygons, as of a Sequence.
        n_frames: n.
        n_vertices: k.
        dtype: of the positions, float32 or float64.
        has_known: whether each frame has a known mask.
        has_provenance: whether each frame has the generation and the age of its vertices.
        has_standard_error: whether each frame has their standard errors as well.

    The attributes of :class:`dynmesh.Description`, from `fps` to `origin`, are keywords as well.

    Raises:
        TypeError, ValueError: an attribute is of the wrong kind or shape.
    """

    faces: NDArray[np.integer[Any]]
    n_frames: int
    n_vertices: int
    dtype: np.dtype[Any]
    has_known: bool = field(default=False, kw_only=True)
    has_provenance: bool = field(default=False, kw_only=True)
    has_standard_error: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        """Raises an error unless the properties are consistent."""
        check_integer("n_frames", self.n_frames, 0)
        check_integer("n_vertices", self.n_vertices, 0)
        self._take_faces(self.n_vertices)
        check_array("faces", self.faces)
        object.__setattr__(self, "dtype", np.dtype(self.dtype).newbyteorder("="))
        check_vertices(self.dtype, (self.n_frames, self.n_vertices, 3))
        check_faces(self.faces.dtype, self.faces.shape)
        check_corners(self.faces, self.n_vertices)
        for row in self.attributes.values():
            for needed in row.needs:
                if not getattr(self, flag := ATTRIBUTES[needed].flag):
                    raise InputError(f"{row.flag}: requires {flag}")
        self._check_description(self.n_frames)

    @property
    def texture(self) -> NDArray[np.float32] | None:
        """(c, 2) float32, the texture coordinates of each corner of the polygons, or None."""
        return self.origin.texture if self.origin is not None and self.has_origin else None

    @property
    def subdivision(self) -> str | None:
        """The subdivision scheme of the origin, or None."""
        return self.origin.subdivision if self.origin is not None and self.has_origin else None

    @property
    def has_origin(self) -> bool:
        """Whether there is an origin, and it is that of this mesh."""
        return self.origin is not None and self.origin.has_mesh(self.faces, self.n_vertices)

    @property
    def attributes(self) -> dict[str, Attribute]:
        """The attributes of the vertices of each frame, by name."""
        return {name: row for name, row in ATTRIBUTES.items() if getattr(self, row.flag)}

    def of_frames(self, indices: Sequence[int]) -> "Header":
        """The header of the frames with these indices, of which each keeps its number."""
        numbers = numbers_of(self, self.n_frames)[np.asarray(indices, np.intp)]
        run = indices if isinstance(indices, range) else range(0, 0, 2)
        are_consecutive = self.times is None and run.step == 1
        start = float(numbers[0]) if len(numbers) else self.start + run.start
        times = None if are_consecutive else numbers
        return replace(self, n_frames=len(numbers), start=start, times=times)

    @property
    def stated(self) -> dict[str, Any]:
        """What is said beside the mesh and the frames, by name; nothing that is left open."""
        is_subdivided = self.subdivision not in (None, "none")
        result = {**self.described(), "start": self.start or None}
        result["subdivision"] = self.subdivision if is_subdivided else None
        del result["origin"]
        if not self.has_standard_error:
            del result["standard_error_of"]
        return {name: value for name, value in result.items() if value is not None}

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is not read that moves or places the mesh, for the user."""
        return () if self.origin is None else self.origin.remarks


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
