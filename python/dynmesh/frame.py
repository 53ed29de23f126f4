"""One frame of a mesh, and frames that can be gone through."""

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Container, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self, TypeAlias

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ._arrays import Integers, Mask, Positions
from ._checks import as_array, check_array, selected
from ._errors import InputError, KindError, locating, naming
from ._report import counted
from .header import ATTRIBUTES, Header, Origin

FUSED = -2
"""The generation of a vertex that was put together from other frames: see
:func:`dynmesh.whole_frames.whole_frame`."""


LARGEST = {4: 1e18, 8: 1e200}
"""The largest coordinates that a completer accepts, by the bytes of a coordinate."""


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


def summary(n_frames: int, n_vertices: int, n_faces: int, dtype: np.dtype[Any]) -> str:
    """Describes the size of a sequence."""
    counts = {"frame": n_frames, "vertex": n_vertices, "face": n_faces}
    return ", ".join([*(counted(count, what) for what, count in counts.items()), str(dtype)])


def shares(points: NDArray[Any], known: NDArray[Any] | None) -> str:
    """Describes how many vertices are known, by a mask or, without one, by NaN."""
    there = np.isfinite(points).all(axis=-1) if known is None else known
    if known is None and there.all():
        return "no masks"
    share = f"{100 * np.count_nonzero(there) / max(1, there.size):.3g} % known"
    return share if known is not None else f"{share}, NaN for the others"


def rate(fps: float | None) -> str:
    """Describes the frames per second."""
    return "no fps" if fps is None else f"{fps:g} fps"


@dataclass(frozen=True, eq=False, repr=False)
class Frame(VertexAttributes):
    """One frame of a sequence. It can be unpacked: ``points, known = frame``.

    Attributes:
        points: (k, 3) float32 or float64.
        known: (k,), or None if the sequence has no masks.

    Those of :class:`VertexAttributes` are (k,).
    """

    points: Positions
    known: Mask | None = None

    def __post_init__(self) -> None:
        for name, given in {"points": self.points, **self.attributes()}.items():
            array = as_array(name, given, np.float64 if name == "points" else None)
            check_array(name, array)
            object.__setattr__(self, name, array)
        dtype, shape = self.points.dtype, self.points.shape
        if dtype.kind != "f" or dtype.itemsize not in LARGEST:
            raise KindError(f"must be float32 or float64, not {dtype}", argument="points")
        if len(shape) != 2 or shape[1] != 3:
            raise InputError(f"must have shape (k, 3), not {shape}", argument="points")
        for name, values in self.attributes().items():
            ATTRIBUTES[name].check(values.dtype, values.shape, shape[:1])

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
        k = counted(len(self.points), "vertex")
        return f"Frame({k}, {self.points.dtype}, {known:.0%} observed)"

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
            f"{len(missing)} of {counted(len(frame.points), 'vertex')} "
            f"{'is' if len(missing) == 1 else 'are'} missing, the first is vertex {missing[0]}"
            f"{advice}"
        )


Indices: TypeAlias = Sequence[int]
"""Of frames, counted from 0."""


class Frames(ABC):
    """Frames of one mesh that can be gone through, one after another.

    Iteration yields every :class:`Frame`, from the first on, and ``len`` is their number. Use it in
    a ``with`` statement if it may hold a file open.

    Attributes:
        header: what all frames share: faces, frames per second and others.
        path: names the frames in messages: the file that they are read from.
        files: all files that they are read from.
        lost: the indices of the frames whose files are missing; nothing was observed in them.
        origin: the file of the mesh, if that holds more than is read; or None.
        report: of the verb that made the frames; None of others.
        wanted: names of attributes of the vertices that were asked for, so that a format that
            cannot hold them is refused.
        each: of several meshes of a scene together, the frames of each by its path, in its own
            space, vertices in this order; empty of a single mesh.
    """

    header: Header
    path: Path
    files: Sequence[Path] = ()
    lost: Container[int] = ()
    origin: Origin | None = None
    report: Any = None
    wanted: Sequence[str] = ()
    each: "Mapping[str, Frames]" = MappingProxyType({})
    _is_closed = False

    @property
    def faces(self) -> Integers:
        """(m, 3) integers, the triangles."""
        return self.header.faces

    @property
    def fps(self) -> float | None:
        """Frames per second, or None if they are not known."""
        return self.header.fps

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
        return self.frames_at(selected(self.n_frames, start, stop, step))

    def frames_at(self, numbers: Indices) -> Generator[Frame, None, None]:
        """Yields the frames with these indices, which exist, and ascend or descend."""
        frames = (frame for index, frame in enumerate(self) if index in numbers)
        is_backwards = len(numbers) > 1 and numbers[0] > numbers[-1]
        yield from reversed([*frames]) if is_backwards else frames

    def close(self) -> None:
        """Closes what they are read from. Frames that are asked for later are refused."""
        self._is_closed = True
        self._close()

    def _close(self) -> None:  # noqa: B027 (most keep nothing open)
        """Closes what is open."""

    def _check_open(self) -> None:
        if self._is_closed:
            message = "is closed, so that no frame can be read; open it again"
            raise InputError(message, file=self.path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __getstate__(self) -> object:
        raise KindError(
            "its frames are read or made in this process alone, and cannot be pickled or copied; "
            "dynmesh.read() keeps them in memory, dynmesh.write() in a file",
            file=self.path,
        )


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
    if points.shape != (k, 3) or points.dtype != header.dtype:
        message = f"must be {header.dtype} of shape {(k, 3)}"
        raise InputError(f"{message}, not {points.dtype} of shape {points.shape}")
    values = frame.attributes()
    for name, row in ATTRIBUTES.items():
        if (name in values) != (name in header.attributes):
            raise InputError(f"give {row.what} with every frame or with none")
