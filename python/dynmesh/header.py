"""What all frames of a mesh share, what every vertex of them has, and where they are from."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
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
from .polygons import Polygons, check_exist, check_polygons, split_faces, split_polygons

Axis: TypeAlias = Literal["x", "y", "z"]


StandardErrorOf: TypeAlias = Literal["position", "surface"]
"""What standard errors are of: a coordinate of the position of a vertex, as
:class:`dynmesh.Completer` reports them, or its distance from the true surface, as
:class:`dynmesh.Tracker` does, which says nothing of how far it is off along the surface."""


TEXTURE, RANGE = "texture coordinates", "range of frames"
"""What messages call them."""


largest_start = 2**53
"""float64 cannot represent all larger whole numbers."""


_ACCEPTED = {
    "b": ("biuf", "bool or numbers, not {}"),
    "i": ("iu", "integers, not {}"),
    "f": ("f", "floats, not {}"),
}
"""By the kind of the dtype in files: the kinds that are accepted, and what must be."""


@dataclass(frozen=True, eq=False)
class Attribute:
    """One value of every vertex in every frame, beside its position.

    Attributes:
        name: in Python and in all files.
        dtype: of the values in files.
        absent: the value in a frame in which nothing was observed.
        what: the name, in messages, of this attribute and those that it comes with.
        needs: the names of others without which it has no meaning.
    """

    name: str
    dtype: np.dtype[Any]
    absent: float
    what: str
    needs: tuple[str, ...] = ()

    def check(
        self, dtype: np.dtype[Any], shape: tuple[int, ...], expected: tuple[int, ...]
    ) -> None:
        """Raises an error unless this describes values for vertices of the ``expected`` shape."""
        kinds, must_be = _ACCEPTED[self.dtype.kind]
        if dtype.kind not in kinds:
            raise KindError(f"must be {must_be.format(dtype)}", argument=self.name)
        if shape != expected:
            raise InputError(
                f"must have shape {expected} to match vertices, not {shape}", argument=self.name
            )


_INTEGERS, _PROVENANCE = np.dtype(np.int32), "generation and age"


ATTRIBUTES = {
    row.name: row
    for row in (
        Attribute("known", np.dtype(np.bool_), False, "known masks"),
        Attribute("generation", _INTEGERS, -1, _PROVENANCE, ("age",)),
        Attribute("age", _INTEGERS, 0, _PROVENANCE, ("generation",)),
        Attribute(
            "standard_error",
            np.dtype(np.float32),
            np.inf,
            "standard errors",
            ("generation", "age"),
        ),
    )
}
"""By name. A row here and its field below are all that formats need of an attribute."""


def with_all_needed(names: Collection[str]) -> list[str]:
    """Returns the names of the attributes among these that have all the others that they need."""
    return [name for name, row in ATTRIBUTES.items() if name in names and {*row.needs} <= {*names}]


def check_needed(names: Collection[str]) -> None:
    """Raises an error if an attribute is there without another one that it needs."""
    for name, row in ATTRIBUTES.items():
        for other in row.needs:
            if name in ATTRIBUTES[other].needs and (name in names) != (other in names):
                raise InputError(f"{name}, {other}: must be given both or neither")
        if name in names and not {*row.needs} <= {*names}:
            raise InputError(f"{name}: requires {' and '.join(row.needs)}")


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


@dataclass(frozen=True, eq=False)
class Header(Description):
    """What all frames share: a value, which names no file.

    Attributes:
        faces: (m, 3) integers, triangles; or other polygons, as of a Sequence.
        n_frames: n.
        n_vertices: k.
        dtype: of the positions, float32 or float64.
        attributes: the attributes that the vertices of each frame have, by name; given as names,
            such as "known".

    The attributes of :class:`dynmesh.frames.Description`, from `fps` on, are keywords as well.
    """

    faces: NDArray[np.integer[Any]]
    n_frames: int
    n_vertices: int
    dtype: np.dtype[Any]
    attributes: Collection[str] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        check_integer("n_frames", self.n_frames, 0)
        check_integer("n_vertices", self.n_vertices, 0)
        self._take_faces(self.n_vertices)
        check_array("faces", self.faces)
        object.__setattr__(self, "dtype", np.dtype(self.dtype).newbyteorder("="))
        check_vertices(self.dtype, (self.n_frames, self.n_vertices, 3))
        check_faces(self.faces.dtype, self.faces.shape)
        check_exist(
            self.faces.reshape(-1), np.repeat(np.arange(len(self.faces)), 3), self.n_vertices
        )
        if others := {*self.attributes} - ATTRIBUTES.keys():
            message = f"must be among {', '.join(ATTRIBUTES)}, not {min(others)!r}"
            raise InputError(message, argument="attributes")
        check_needed(self.attributes)
        object.__setattr__(self, "attributes", tuple(n for n in ATTRIBUTES if n in self.attributes))
        self._check_description(self.n_frames)

    @property
    def has_known(self) -> bool:
        """Whether each frame has a known mask."""
        return "known" in self.attributes

    @property
    def has_provenance(self) -> bool:
        """Whether each frame has the generation and the age of its vertices."""
        return "generation" in self.attributes

    @property
    def has_standard_error(self) -> bool:
        """Whether each frame has the standard errors of its vertices."""
        return "standard_error" in self.attributes

    @property
    def numbers(self) -> NDArray[np.float64]:
        """(n,) the number of each frame in its file."""
        if self.times is not None:
            return self.times
        return self.start + np.arange(self.n_frames, dtype=np.float64)

    def of_frames(self, indices: Sequence[int]) -> "Header":
        """The header of the frames with these indices, of which each keeps its number."""
        numbers = self.numbers[np.asarray(indices, np.intp)]
        run = indices if isinstance(indices, range) else range(0, 0, 2)
        are_consecutive = self.times is None and run.step == 1
        start = float(numbers[0]) if len(numbers) else self.start + run.start
        times = None if are_consecutive else numbers
        return replace(self, n_frames=len(numbers), start=start, times=times)

    @property
    def stated(self) -> dict[str, Any]:
        """What is said beside the mesh and the frames, by name; nothing that is left open."""
        result = {**self.described(), "start": self.start or None}
        if not self.has_standard_error:
            del result["standard_error_of"]
        return {name: value for name, value in result.items() if value is not None}


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


@dataclass(frozen=True)
class Origin:
    """The file of which a mesh was read, and what of it is not read as frames.

    A format makes it, and it stays with the frames through verbs that change positions alone, and
    through memory. A format then keeps what it can: texture coordinates, what a file of the same
    format holds, or a whole scene, over which another file lies. What is not kept is named when
    frames are written.

    Attributes:
        path: of the file.
        faces: (m, 3), the triangles of the mesh.
        n_vertices: their number.
        name: the path of the mesh in the file, or None.
        holds: what the file holds beside positions and faces, such as "texture coordinates".
        remarks: what is not read that moves or places the mesh, for the user.
        subdivision: the subdivision scheme that a USD stage states, or None.
        texture: (c, 2) float32, the texture coordinates of each corner of the polygons, one polygon
            after another, if USD or Alembic state them; or None.
        is_scene: whether another file can lie over this one.
        is_below: whether another file that is written shall lie over it.
        changed: what was changed of the frames beside their positions, and forbids that, in words.
        stamp: the size and the time of the file when it was read.
    """

    path: Path
    faces: NDArray[np.integer[Any]] = field(repr=False, compare=False)
    n_vertices: int
    name: str | None = None
    holds: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    subdivision: str | None = None
    texture: NDArray[np.float32] | None = field(default=None, repr=False, compare=False)
    is_scene: bool = False
    is_below: bool = False
    changed: tuple[str, ...] = ()
    stamp: tuple[int, int] | None = None

    @classmethod
    def of(
        cls,
        path: Path,
        header: Header,
        holds: Iterable[str],
        **more: Any,
    ) -> "Origin | None":
        """Describes a file that has just been read; None if it holds and says nothing more."""
        held = tuple(sorted(holds))
        if not held and not any(map(more.get, ("remarks", "subdivision", "is_scene"))):
            return None
        more |= {"holds": held, "stamp": _stamp_of(path)}
        return cls(path, header.faces, header.n_vertices, **more)

    def below(self) -> "Origin":
        """The same file, over which the file that is written shall lie, if that is possible."""
        return replace(self, is_below=self.is_scene)

    def after(self, changes: Iterable[str]) -> "Origin":
        """The same file, of whose frames more than the positions was changed, in words."""
        return replace(self, changed=tuple(dict.fromkeys([*self.changed, *changes])))

    def has_mesh(self, faces: NDArray[np.integer[Any]], n_vertices: int) -> bool:
        """Whether this is its mesh; in memory, its faces may have been replaced."""
        return n_vertices == self.n_vertices and (
            faces is self.faces or np.array_equal(faces, self.faces)
        )

    @property
    def is_unchanged(self) -> bool:
        """Whether the file is still the one that was read."""
        return self.path.exists() and self.stamp == _stamp_of(self.path)


def _stamp_of(path: Path) -> tuple[int, int]:
    result = path.stat()
    return result.st_size, result.st_mtime_ns
