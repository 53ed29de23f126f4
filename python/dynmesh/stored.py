"""Frames of which any can be read, as often as one likes: those of a file or a sequence."""

from abc import abstractmethod
from collections.abc import Container, Generator, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast, overload

import numpy as np

from ._arrays import Integers, mask_in_file
from ._checks import frame_index, indices_among
from ._errors import locating, naming
from ._report import counted
from .frame import Frame, Frames, Indices, check_any, frame_at, rate, summary
from .header import ATTRIBUTES, RANGE, Header, Origin


class Stored(Frames):
    """Frames of which any can be read: those of a file, or of a :class:`dynmesh.Sequence`.

    ``frames[7]`` is a :class:`Frame`, ``frames[-1]`` the last one, and ``frames[10:50:2]`` or
    ``frames[[3, 5, 8]]`` are some of the frames, which are read when they are gone through. The
    frames keep their numbers and times: `start` is the number of the first, and unless all of a
    stretch are taken, `times` holds the others, so that `fps` remains valid. They may be none; the
    step must be positive and indices ascend, as times do.
    """

    least_confidence: float | None = None
    """Of the values of `known` that are no mask: the least that counts as known."""

    def frames_at(self, numbers: Indices) -> Generator[Frame, None, None]:
        """Yields the frames with these indices, which exist; nothing else is read."""
        with naming(self.path):
            for number, frame in zip(self._while_open(numbers), self._frames(numbers), strict=True):
                with locating(frame=self.header.number(number)):
                    known = frame.known
                    if known is not None:
                        known = mask_in_file(known, self.least_confidence)
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
        self.path, self.header = path, header
        self.files = [path] if files is None else [*files]
        self.lost, self.origin = lost, origin
        check_any(self)

    def _lost_frame(self) -> Frame:
        k = self.n_vertices
        attributes: dict[str, Any] = {
            name: np.full(k, ATTRIBUTES[name].absent, ATTRIBUTES[name].dtype)
            for name in self.header.attributes
        }
        return Frame(np.full((k, 3), np.nan, self.dtype), **attributes)

    def __repr__(self) -> str:
        header = self.header
        counts = summary(self.n_frames, self.n_vertices, len(header.faces), self.dtype)
        masks = "with masks" if header.has_known else "no masks"
        return f"{type(self).__name__}({str(self.path)!r}: {counts}, {masks}, {rate(header.fps)})"


class _Chosen(Stored):
    """Some of the frames of others, which stay open when these are closed."""

    def __init__(self, of: Stored, indices: Indices) -> None:
        self._of, self._indices = of, indices
        self.path, self.files = of.path, of.files
        self.header, self.origin = of.header.of_frames(indices), of._origin_of(indices)
        self.lost = {at for at, index in enumerate(indices) if index in of.lost}

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        return self._of.frames_at([self._indices[number] for number in numbers])

    def __repr__(self) -> str:
        return f"{counted(self.n_frames, 'frame')} of {self._of!r}"
