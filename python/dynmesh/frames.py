"""Frames of a mesh: what all of them share, one of them, and those that can be gone through.

A :class:`Header` is what all frames share, a :class:`Frame` one of them. :class:`Stored` frames,
those of a file or of a :class:`dynmesh.Sequence`, can be read in any order and as often as one
likes, those of a :class:`Run` once, while they are made.
"""

import contextlib
import os
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Container, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from importlib import import_module
from itertools import chain, islice
from pathlib import Path
from typing import Any, Generic, Literal, NoReturn, Self, TypeAlias, TypeVar, cast, overload

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ._arrays import Integers, Mask, Positions, as_mask
from ._checks import (
    check_array,
    check_choice,
    check_integer,
    check_number,
    check_positive,
    check_times,
    frame_index,
    indices_among,
    native,
    selected,
)
from ._errors import InputError, KindError, locating, naming
from ._report import DoubtfulWarning, Report, warn
from .polygons import Polygons, check_exist, check_polygons, split_faces, split_polygons

__all__ = ["FileFrames", "Frame", "Frames", "Header", "Origin", "Run", "Stored"]

Axis: TypeAlias = Literal["x", "y", "z"]

StandardErrorOf: TypeAlias = Literal["position", "surface"]
"""What standard errors are of: a coordinate of the position of a vertex, as
:class:`dynmesh.Completer` reports them, or its distance from the true surface, as
:class:`dynmesh.Tracker` does, which says nothing of how far it is off along the surface."""

Indices: TypeAlias = Sequence[int]
"""Of frames, counted from 0."""

R = TypeVar("R", bound=Report)

TEXTURE, RANGE = "texture coordinates", "range of frames"
"""What messages call them."""

FUSED = -2
"""The generation of a vertex that was put together from other frames: see
:func:`dynmesh.whole_frames.whole_frame`."""

LARGEST = {4: 1e18, 8: 1e200}
"""The largest coordinates that a completer accepts, by the bytes of a coordinate."""

largest_start = 2**53
"""float64 cannot represent all larger whole numbers."""

_ACCEPTED = {
    "b": ("biu", "bool, or integers 0 and 1, not {}"),
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


@dataclass(frozen=True, eq=False, kw_only=True)
class VertexAttributes:
    """What is known of the provenance of positions, for all vertices of a frame or of all frames.

    Attributes:
        generation: integers, 0 for anchors, g for satellites, -1 for disconnected vertices, -2 for
            those that were put together from other frames, where completion starts.
        age: integers, frames since the vertex was last observed; None if `generation` is.
        standard_error: floats, in the unit of the positions: how far each vertex may be off, see
            :data:`dynmesh.frames.StandardErrorOf`; None if they were not estimated.
    """

    generation: NDArray[np.integer[Any]] | None = None
    age: NDArray[np.integer[Any]] | None = None
    standard_error: NDArray[np.floating[Any]] | None = None

    def attributes(self) -> dict[str, NDArray[Any]]:
        """Returns the attributes that are there by name, the known mask included."""
        result = {name: getattr(self, name) for name in ATTRIBUTES}
        return {name: values for name, values in result.items() if values is not None}


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
        check_corners(self.faces, self.n_vertices)
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


@dataclass(frozen=True, eq=False, repr=False)
class Frame(VertexAttributes):
    """One frame of a sequence. It can be unpacked: ``points, known = frame``.

    Attributes:
        points: (k, 3)
        known: (k,), or None if the sequence has no masks.
        generation: (k,), or None if the sequence has no provenance.
        age: (k,), or None if `generation` is.
        standard_error: (k,), or None if it was not estimated.
    """

    points: Positions
    known: Mask | None = None

    def __post_init__(self) -> None:
        for name, array in {"points": self.points, **self.attributes()}.items():
            if isinstance(array, np.ndarray):
                object.__setattr__(self, name, native(array))

    @property
    def present(self) -> Mask:
        """(k,) bool, which vertices have a position that can be used, observed or estimated."""
        with np.errstate(invalid="ignore"):
            usable = np.abs(self.points) <= LARGEST[self.points.dtype.itemsize]
        there: Mask = np.asarray(usable.all(axis=1))
        return there if self.known is None else there & self.known

    @property
    def claimed(self) -> Mask:
        """(k,) bool, which vertices were observed, by what the frame says of them.

        These are the known ones or, without a mask, those whose position is finite; and of them,
        where there are generations, those of generation 0. All others were estimated, and are so
        again when the frame is completed again.
        """
        said = np.isfinite(self.points).all(axis=1) if self.known is None else self.known
        return np.asarray(said if self.generation is None else said & (self.generation == 0))

    @property
    def observed(self) -> Mask:
        """(k,) bool, which vertices were observed and have a position that can be used."""
        return self.claimed & self.present

    def __repr__(self) -> str:
        known = np.count_nonzero(self.observed) / max(1, len(self.points))
        return f"Frame({len(self.points)} vertices, {self.points.dtype}, {known:.0%} observed)"

    def __iter__(self) -> Iterator[Any]:
        yield self.points
        yield self.known

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return as_array_of(self.points, self.known, dtype, copy)


def as_array_of(
    points: Positions, known: Mask | None, dtype: DTypeLike | None, copy: bool | None
) -> NDArray[Any]:
    """Positions as NumPy asks an object for them, NaN where they are not known."""
    if known is not None and not known.all():
        if copy is False:
            raise InputError("a copy is needed, to mark what is not known as NaN")
        points = np.where(known[..., None], points, np.nan).astype(points.dtype)
    return np.array(points, dtype) if copy else np.asarray(points, dtype)


def check_whole(frame: Frame, advice: str) -> None:
    """Refuses a frame with missing vertices; the advice ends the message."""
    missing = np.flatnonzero(~frame.present)
    if len(missing):
        raise InputError(
            f"{len(missing)} of {len(frame.points)} vertices "
            f"{'is' if len(missing) == 1 else 'are'} missing, the first is vertex {missing[0]}"
            f"{advice}"
        )


class Frames(ABC):
    """Frames of one mesh that can be gone through, one after another.

    Iteration yields every :class:`Frame`, from the first on, and ``len`` is their number. Use it in
    a ``with`` statement if it may hold a file open.

    Attributes:
        header: what all frames share: faces, frames per second and others.
        path: names the frames in messages: the file that they are read from.
        faces: (m, 3) integers, triangles; those of the header.
        fps: frames per second, or None if they are not known; those of the header.
        files: all files that they are read from.
        lost: the indices of the frames whose files are missing; nothing was observed in them.
        origin: the file of the mesh, if that holds more than is read; or None.
        report: of the verb that made the frames; None of others.
        wanted: names of attributes of the vertices that were asked for, so that a format that
            cannot hold them is refused.
    """

    header: Header
    faces: Integers
    fps: float | None
    path: Path
    files: Sequence[Path] = ()
    lost: Container[int] = ()
    origin: Origin | None = None
    report: Any = None
    wanted: Sequence[str] = ()
    _is_closed = False

    @property
    def n_frames(self) -> int:
        """The number of frames."""
        return self.header.n_frames

    @property
    def n_vertices(self) -> int:
        """The number of vertices of each frame."""
        return self.header.n_vertices

    @property
    def dtype(self) -> np.dtype[Any]:
        """The dtype of the positions, float32 or float64."""
        return self.header.dtype

    @property
    def own_origin(self) -> Origin | None:
        """The origin, if it is still that of this mesh; in memory, faces may be replaced."""
        origin, header = self.origin, self.header
        has_mesh = origin is not None and origin.has_mesh(header.faces, header.n_vertices)
        return origin if has_mesh else None

    @property
    def texture(self) -> NDArray[np.float32] | None:
        """(c, 2) float32, the texture coordinates of each corner of the polygons, or None."""
        return None if self.own_origin is None else self.own_origin.texture

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is not read that moves or places the mesh, for the user."""
        return () if self.origin is None else self.origin.remarks

    def __len__(self) -> int:
        return self.header.n_frames

    @abstractmethod
    def __iter__(self) -> Iterator[Frame]:
        """Yields all frames, from the first on."""

    def frames(
        self, start: int = 0, stop: int | None = None, step: int = 1
    ) -> Generator[Frame, None, None]:
        """Yields the frames ``[start:stop:step]``; several iterators may be used at once.

        Frames are counted from 0, independently of the numbers in a file. Those of a run are all
        made, because its report is of all; with a negative step, those that are yielded are held in
        memory.
        """
        return self._made(selected(self.n_frames, start, stop, step))

    def _made(self, wanted: range) -> Generator[Frame, None, None]:
        frames = (frame for index, frame in enumerate(self) if index in wanted)
        yield from frames if wanted.step > 0 else reversed([*frames])

    def close(self) -> None:
        """Closes what they are read from. Frames that are asked for later are refused."""
        self._is_closed = True
        self._close()

    def _close(self) -> None:  # noqa: B027 (most keep nothing open)
        """Closes what is open."""

    def _check_open(self) -> None:
        """Refuses to read frames that are closed."""
        if self._is_closed:
            message = "is closed, so that no frame can be read; open it again"
            raise InputError(message, file=self.path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Stored(Frames):
    """Frames of which any can be read: those of a file, or of a :class:`dynmesh.Sequence`.

    ``frames[7]`` is a :class:`Frame`, ``frames[-1]`` the last one, and ``frames[10:50:2]`` or
    ``frames[[3, 5, 8]]`` are some of the frames, which are read when they are gone through. The
    frames keep their numbers and times: `start` is the number of the first, and unless all of a
    stretch are taken, `times` holds the others, so that `fps` remains valid. They may be none; the
    step must be positive and indices ascend, as times do.

    Raises:
        IndexError: there is no such frame.
    """

    def frames(
        self, start: int = 0, stop: int | None = None, step: int = 1
    ) -> Generator[Frame, None, None]:
        """See :meth:`Frames.frames`; nothing else is read."""
        return self.frames_at(selected(self.n_frames, start, stop, step))

    def frames_at(self, numbers: Indices) -> Generator[Frame, None, None]:
        """Yields the frames with these indices, which exist."""
        with naming(self.path):
            for number, frame in zip(self._while_open(numbers), self._frames(numbers), strict=True):
                with locating(frame=self.header.number(number)):
                    known = None if frame.known is None else as_mask(frame.known)
                yield replace(frame, known=known)

    def _while_open(self, numbers: Indices) -> Iterator[int]:
        for number in numbers:
            self._check_open()
            yield number

    @abstractmethod
    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        """Yields the frames with these indices, which exist."""

    def __iter__(self) -> Iterator[Frame]:
        return self.frames()

    @overload
    def __getitem__(self, frames: int | np.integer[Any]) -> Frame: ...
    @overload
    def __getitem__(self, frames: slice | Sequence[int] | Integers) -> "Stored": ...
    def __getitem__(
        self, frames: int | np.integer[Any] | slice | Sequence[int] | Integers
    ) -> "Frame | Stored":
        if isinstance(frames, slice | range | list | np.ndarray):
            return self._chosen(indices_among(frames, self.n_frames))
        return frame_at(self, frame_index(cast(int, frames), self.n_frames))

    def _chosen(self, indices: Indices) -> "Stored":
        return _Chosen(self, indices)

    def _origin_of(self, indices: Indices) -> Origin | None:
        """The origin of some of the frames."""
        if self.origin is None or len(indices) == self.n_frames:
            return self.origin
        return self.origin.after([RANGE])


class FileFrames(Stored):
    """Frames in a file: what :func:`dynmesh.open` returns.

    A format derives from it: it opens its file in ``__init__``, and then calls this class.
    """

    def __init__(
        self,
        path: Path,
        header: Header,
        files: Sequence[Path] | None = None,
        lost: Container[int] = (),
        origin: Origin | None = None,
    ) -> None:
        """Called when the file is open and its header is read.

        Without `files`, the file at the path alone is read.
        """
        self.path = path
        self.header, self.faces, self.fps = header, header.faces, header.fps
        self.files = [path] if files is None else [*files]
        self.lost, self.origin = lost, origin
        check_any(self)

    def __repr__(self) -> str:
        header = self.header
        counts = summary(self.n_frames, self.n_vertices, len(header.faces), self.dtype)
        masks = "with masks" if header.has_known else "no masks"
        return f"{type(self).__name__}({str(self.path)!r}: {counts}, {masks}, {rate(header.fps)})"


def frame_at(frames: Frames, index: int) -> Frame:
    """Reads one frame, counted from 0."""
    with contextlib.closing(frames.frames(index, index + 1)) as stretch:
        return next(stretch)


def check_any(frames: Frames) -> None:
    """Refuses frames of which there are none."""
    if frames.n_frames == 0:
        raise InputError("has no frames, but a complete frame 0 is needed", file=frames.path)


def checked(frames: Frames) -> Generator[Frame, None, None]:
    """Yields frames, each of which is as their header says."""
    header, count = frames.header, 0
    with naming(frames.path):
        for count, frame in enumerate(frames, 1):
            if count > header.n_frames:
                raise InputError(f"has more frames than the {header.n_frames} of its header")
            with locating(frame=header.number(count - 1)):
                check_frame(frame, header)
            yield frame
        if count < header.n_frames:
            raise InputError(f"has only {count} of the {header.n_frames} frames of its header")


def check_frame(frame: Frame, header: Header) -> None:
    """Raises an error unless a frame is as the header says."""
    k, points = header.n_vertices, frame.points
    for name, array in {"points": points, **frame.attributes()}.items():
        check_array(name, array)
    if points.shape != (k, 3) or points.dtype != header.dtype:
        message = f"must be {header.dtype} of shape {(k, 3)}"
        raise InputError(f"{message}, not {points.dtype} of shape {points.shape}")
    values = frame.attributes()
    for name, row in ATTRIBUTES.items():
        if (name in values) != (name in header.attributes):
            raise InputError(f"give {row.what} with every frame or with none")
        if name in values:
            row.check(values[name].dtype, values[name].shape, (k,))


class _Chosen(Stored):
    """Some of the frames of others, which stay open when these are closed."""

    def __init__(self, of: Stored, indices: Indices) -> None:
        self._of, self._indices = of, indices
        self.path, self.files, self.faces, self.fps = of.path, of.files, of.faces, of.fps
        self.header, self.origin = of.header.of_frames(indices), of._origin_of(indices)
        self.lost = {at for at, index in enumerate(indices) if index in of.lost}

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        return self._of.frames_at([self._indices[number] for number in numbers])

    def __repr__(self) -> str:
        return f"{self.n_frames} frames of {self._of!r}"


class Run(Frames, Generic[R]):
    """Frames that are made while they are gone through, once: what a verb makes of a file.

    Write them by :meth:`write`, read them into memory by :meth:`read`, or go through them; `report`
    then says what was done. A result that is doubtful is a :class:`dynmesh.DoubtfulWarning`
    as well, and what is made of doubtful frames is doubtful.
    """

    def __init__(
        self,
        header: Header,
        make: Callable[[], Iterator[Frame] | Generator[Frame, None, R]],
        source: Frames | None = None,
        *,
        files: Sequence[Path] = (),
        origin: Origin | None = None,
        wanted: Sequence[str] = (),
        close: Callable[[], object] = lambda: None,
    ) -> None:
        """Takes what makes the frames.

        Args:
            header: of the frames that are made.
            make: returns an iterator over the frames; a generator may return a report.
            source: the frames of which they are made, if there are any.
            files: those that are read beside those of the source.
            origin: the file of their mesh.
            wanted: see :class:`Frames`.
            close: closes what was opened for the frames.
        """
        self.header, self.faces, self.fps = header, header.faces, header.fps
        self.path, self.files, self.wanted = Path("frames"), files, wanted
        if source is not None:
            self.path, self.files, self.lost = source.path, [*source.files, *files], source.lost
        self.origin = origin
        self._make, self._source, self._opened = make, source, close
        self._has_begun, self._report = False, cast(Any, None)

    def __iter__(self) -> Iterator[Frame]:
        """Makes all frames, from the first on.

        The report is there before the last one is yielded, after which nobody may ask for more.

        Raises:
            ValueError: they were gone through before.
        """
        self._check_open()
        if self._has_begun:
            raise InputError(
                "its frames were gone through, which is possible once; read() keeps them in memory",
                file=self.path,
            )
        self._has_begun = True
        return self._passing()

    def _passing(self) -> Generator[Frame, None, None]:
        frames = iter(self._make())
        yield from islice(frames, self.n_frames - 1)
        last = next(frames, None)
        if last is None:  # there are fewer than the header says, so nothing is reported of them
            return
        try:
            further = next(frames)
        except StopIteration as end:
            done = Report() if end.value is None else end.value
            before = None if self._source is None else self._source.report
            if done.quality == "good" and before is not None:
                done = replace(done, quality=before.quality, reason=before.reason)
            self._report = done
            if done.reason:
                warn(f"{self.path}: {done.reason}", DoubtfulWarning)
        else:
            frames = chain([further], frames)  # which are too many
        yield last
        yield from frames

    @property
    def report(self) -> R:
        """What was done.

        Raises:
            ValueError: not all frames have been made yet.
        """
        if self._report is None:
            message = "is there when all frames have been gone through, as write and read do"
            raise InputError(message, argument="report")
        report: R = self._report
        return report

    def write(self, path: str | os.PathLike[str], **options: Any) -> Any:
        """Writes the frames to a file: see :func:`dynmesh.write`."""
        return import_module(".formats", __package__).write(path, self, **options)

    def read(self) -> Any:
        """Reads the frames into memory, as a :class:`dynmesh.Sequence`."""
        return import_module(".sequence", __package__).read(self)

    def _close(self) -> None:
        self._opened()

    def __getitem__(self, frames: object) -> NoReturn:
        raise KindError("frames are made one after another; read() gives all of them")

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NoReturn:
        raise KindError("frames are made one after another; read() gives arrays")

    def __getattr__(self, name: str) -> NoReturn:
        hint = "; read() gives all frames, with arrays" if name in _OF_ARRAYS else ""
        raise AttributeError(f"a Run has no attribute {name!r}{hint}")

    def __repr__(self) -> str:
        counts = summary(self.n_frames, self.n_vertices, len(self.faces), self.dtype)
        return f"{type(self).__name__}({str(self.path)!r}: {counts}, made when gone through)"


_OF_ARRAYS = {"vertices", *ATTRIBUTES}


class Kept(Stored):
    """The frames of a run in an unnamed temporary file, as far as they were wanted."""

    def __init__(self, run: Frames) -> None:
        self._run, self._records, self._n_kept = run, cast(Records | None, None), 0
        self.path, self.files, self.lost = run.path, run.files, run.lost
        self.header, self.faces, self.fps = run.header, run.faces, run.fps
        self.origin, self.wanted = run.origin, run.wanted

    @property
    def report(self) -> Any:
        """That of the run, all frames of which are made for it."""
        self._keep(self.n_frames)
        return self._run.report

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        for number in numbers:
            yield self._keep(number + 1).frame(number)

    def _keep(self, n: int) -> "Records":
        """Keeps the first n frames."""
        if self._records is None:
            self._records, self._left = Records(self.header, self.n_frames), checked(self._run)
        while self._n_kept < n:
            self._records.store(self._n_kept, next(self._left))
            self._n_kept += 1
        return self._records

    def _close(self) -> None:
        self._records = None
        self._run.close()


class Records:
    """Space for n frames, in an unnamed temporary file."""

    def __init__(self, header: Header, n: int) -> None:
        k = header.n_vertices
        kinds: list[Any] = [("points", header.dtype, (k, 3))]
        kinds += [(name, ATTRIBUTES[name].dtype, (k,)) for name in header.attributes]
        record = np.dtype(kinds)
        self._rows: NDArray[Any] = np.empty(0, record)
        if n * record.itemsize == 0:
            return
        with naming(Path(tempfile.gettempdir())), tempfile.TemporaryFile() as file:
            if hasattr(os, "posix_fallocate"):  # else a full disk would end the process
                os.posix_fallocate(file.fileno(), 0, n * record.itemsize)
            self._rows = np.memmap(file, record, "w+", shape=(n,))

    def store(self, number: int, frame: Frame) -> None:
        """Keeps a frame."""
        for name in self._rows.dtype.names or ():
            self._rows[name][number] = getattr(frame, name)

    def frame(self, number: int) -> Frame:
        """A frame that was kept."""
        names = self._rows.dtype.names or ()
        return Frame(**{name: np.array(self._rows[name][number]) for name in names})

    def __len__(self) -> int:
        return len(self._rows)
