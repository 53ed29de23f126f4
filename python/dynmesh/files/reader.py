"""The interface of all readers: a sequence, frame by frame."""

import contextlib
import math
from abc import ABC, abstractmethod
from collections.abc import Container, Generator, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, locating, naming
from ..attributes import as_mask
from ..sequence import rate, summary
from .frame import Frame
from .header import Header
from .units import explaining

_SAME = 1.05
"""Two sequences are in different units if their sizes differ by the ratio of these, about."""
_MUCH = 2.0
"""A result that is wrong may differ by less than this factor, and is measured all the same."""


class Reader(ABC):
    """A sequence in a file: what :func:`dynmesh.open` returns.

    Iterating yields every :class:`Frame`, always from frame 0 on. Use it in a ``with`` statement.
    A subclass opens its file in ``__init__`` and then calls the base class.

    Attributes:
        path: of the file.
        header: the properties of all frames.
        files: those that are read.
        lost: the numbers of the frames whose files are missing; nothing was observed in them.
    """

    def __init__(
        self,
        path: Path,
        header: Header,
        files: Sequence[Path] | None = None,
        lost: Container[int] = (),
    ) -> None:
        """Called by subclasses when the file is open and its header is read.

        Without `files`, the file at the path alone is read.
        """
        self.path = path
        self.header = header
        self.files = [path] if files is None else [*files]
        self.lost = lost
        if header.n_frames == 0:
            raise ValueError("has no frames, but a complete frame 0 is needed")

    @property
    def faces(self) -> NDArray[np.integer[Any]]:
        """(m, 3) integers, triangles."""
        return self.header.faces

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
    def has_known(self) -> bool:
        """Whether each frame has a known mask."""
        return self.header.has_known

    @property
    def has_provenance(self) -> bool:
        """Whether each frame has the generation and the age of its vertices."""
        return self.header.has_provenance

    @property
    def fps(self) -> float | None:
        """Frames per second, or None if the file does not state them."""
        return self.header.fps

    def __repr__(self) -> str:
        """Describes the file without its numbers."""
        counts = summary(self.n_frames, self.n_vertices, len(self.faces), self.dtype)
        masks = "with masks" if self.has_known else "no masks"
        return f"{type(self).__name__}({str(self.path)!r}: {counts}, {masks}, {rate(self.fps)})"

    def __iter__(self) -> Iterator[Frame]:
        """Yields all frames, from frame 0 on."""
        return self.frames()

    def frames(
        self, start: int = 0, stop: int | None = None, step: int = 1
    ) -> Generator[Frame, None, None]:
        """Yields the frames ``range(start, stop, step)``; several iterators may be used at once.

        Frames are counted from 0, independently of the numbers in the file.
        """
        with naming(self.path):
            numbers = range(self.n_frames)[start:stop:step]
            for number, frame in zip(numbers, self._frames(numbers), strict=True):
                with locating(frame=self.header.number(number)):
                    known = None if frame.known is None else as_mask(frame.known)
                yield replace(frame, known=known)

    @abstractmethod
    def _frames(self, numbers: range) -> Iterator[Frame]:
        """Yields the frames with these numbers, which ascend and exist."""

    def close(self) -> None:  # noqa: B027 (most readers keep nothing open)
        """Closes the file."""

    def __enter__(self) -> Self:
        """Returns the reader itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the file."""
        self.close()


def check_same_mesh(other: Reader, reader: Reader) -> None:
    """Raises an error unless a file has the mesh of another one, and states no other unit or axis.

    What one of them does not state is not compared.
    """
    ours, theirs = reader.n_vertices, other.n_vertices
    if ours != theirs:
        raise InputError(f"has {theirs} vertices, but {reader.path} has {ours}", file=other.path)
    if not np.array_equal(other.faces, reader.faces):
        raise InputError(f"has other faces than {reader.path}", file=other.path)
    _check_alike(other, reader, "metres_per_unit", "unit in metres", "--to-unit")
    _check_alike(other, reader, "up_axis", "up axis", "--to-up")


def check_comparable(completed: Reader, reference: Reader) -> None:
    """Raises an error unless the sequences also have the same number of frames and rate."""
    check_same_mesh(completed, reference)
    ours, truth = completed.n_frames, reference.n_frames
    if ours != truth:
        raise InputError(
            f"has {ours} frames, but {reference.path} has {truth}", file=completed.path
        )
    _check_alike(completed, reference, "fps", "rate in frames per second", "--fps")


def _check_alike(other: Reader, reader: Reader, name: str, what: str, option: str) -> None:
    theirs, ours = getattr(other.header, name), getattr(reader.header, name)
    if None in (theirs, ours) or theirs == ours:
        return
    if isinstance(ours, str) or not math.isclose(theirs, ours, rel_tol=1e-5):  # rounded in files
        raise InputError(
            f"its {what} is {theirs}, but {ours} in {reader.path}; dynmesh convert {option} {ours} "
            "makes them alike",
            file=other.path,
        )


def remarks_of(*readers: Reader | None) -> tuple[str, ...]:
    """What of the motion of sequences is not read, with the names of their files."""
    there = [reader for reader in readers if reader is not None]
    return tuple(f"{one.path.name}: {remark}" for one in there for remark in one.header.remarks)


def check_same_size(completed: Reader, reference: Reader) -> None:
    """Refuses a sequence that is as much larger or smaller than its reference as another unit."""
    sizes = []
    for reader in (completed, reference):
        with contextlib.closing(reader.frames(0, 1)) as frames:
            frame = next(frames)
        seen = frame.points[frame.observed].astype(np.float64)
        sizes.append(float(np.linalg.norm(np.ptp(seen, axis=0))) if len(seen) else 0.0)
    if min(sizes) == 0:
        return
    ratio = sizes[0] / sizes[1]
    if max(ratio, 1 / ratio) > _MUCH and (pairs := explaining(1 / ratio, _SAME)):
        ours, theirs = pairs[0]
        raise InputError(
            f"is {ratio:.4g} times as large as {reference.path}, as if it were in {ours} and that "
            f"in {theirs}; dynmesh convert --scale {1 / ratio:.4g} makes them comparable",
            file=completed.path,
        )
