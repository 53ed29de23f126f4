"""Known masks that are not stored in the file with the positions."""

from collections.abc import Iterator
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._arrays import Mask, mask_in_file
from .._checks import as_array, path_of
from .._errors import InputError, locating, naming, of_library
from ..frame import FileFrames, Frame, Indices, Stored
from ..header import ATTRIBUTES, Header
from .npz import arrays_in
from .rows import read_header
from .text import lines_in, number_of, words_in
from .times import index_of


class MaskedFrames(FileFrames):
    """A sequence whose known masks are given, or derived from a position, or both.

    Vertices all of whose coordinates are `missing` are not known.
    """

    def __init__(
        self,
        reader: Stored,
        known: Mask | str | PathLike[str] | None,
        missing: float | None = None,
        least_confidence: float | None = None,
    ) -> None:
        self._reader, self.least_confidence = reader, least_confidence
        with np.errstate(over="ignore"):
            self._missing = None if missing is None else reader.dtype.type(missing)
        shape = (reader.n_frames, reader.n_vertices)
        self._mask_files = [path_of("known", known)] if isinstance(known, str | PathLike) else []
        self._known: Mask | None = None
        self._damaged: Damaged = {}
        if self._mask_files and self._mask_files[0].suffix.lower() not in (".npy", ".npz"):
            self._damaged = _listed(self._mask_files[0], reader.header)
        elif known is not None:
            self._known = _load(self._mask_files[0] if self._mask_files else known, shape)
        read = [*reader.files, *self._mask_files]
        header = replace(reader.header, attributes=["known", *reader.header.attributes])
        super().__init__(reader.path, header, read, reader.lost, reader.origin)

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        frames = self._reader.frames_at(numbers)
        for number, frame in zip(numbers, frames, strict=True):
            known = frame.known
            if known is None:
                known = np.asarray(np.isfinite(frame.points).all(axis=1))
            if self._known is not None:
                file = self._mask_files[0] if self._mask_files else None
                with locating(frame=self.header.number(number), file=file):
                    known = mask_in_file(np.array(self._known[number]), self.least_confidence)
            for listed in (None, number):
                if listed in self._damaged:
                    known = known.copy()
                    known[self._damaged[listed]] = False
            if self._missing is not None:
                known = known & (frame.points != self._missing).any(axis=1)
            if number in self.lost:
                known = np.zeros_like(known)
            yield replace(frame, known=known)

    def _close(self) -> None:
        self._reader.close()


Damaged: TypeAlias = dict[int | None, NDArray[np.int64]]
"""Vertices that are not known, by the frame, counted from 0; None stands for all frames."""


def _listed(path: Path, header: Header) -> Damaged:
    """Reads a text file with lines "frame vertex vertex ...", in which * stands for all frames."""
    results: dict[int | None, list[int]] = {}
    with naming(path):
        for number, line in enumerate(lines_in(path), 1):
            words = words_in(line)
            if not words:
                continue
            try:
                frame = None if words[0] == "*" else number_of(words[0], number)
                vertices = [number_of(word, number) for word in words[1:]]
                if any(vertex % 1 for vertex in vertices):
                    raise InputError(line)
            except ValueError:
                message = f"line {number}: must be a frame, or *, and numbers of vertices"
                raise InputError(f"{message}, not {line[:60]!r}") from None
            at = None if frame is None else index_of(header, frame, f"line {number}")
            outside = [vertex for vertex in vertices if not 0 <= vertex < header.n_vertices]
            if outside:
                raise InputError(
                    f"line {number}: there is no vertex {outside[0]:.15g}, only 0 to "
                    f"{header.n_vertices - 1}"
                )
            results.setdefault(at, []).extend(map(int, vertices))
    return {at: np.array(own, np.int64) for at, own in results.items()}


def _load(known: Any, shape: tuple[int, int]) -> Mask:
    known = as_array("known", known)
    if isinstance(known, np.ndarray):
        ATTRIBUTES["known"].check(known.dtype, known.shape, shape)
        return known
    path = path_of("known", known, "a numpy array or a path")
    with naming(path):
        if path.suffix.lower() == ".npz":
            mask: Mask = arrays_in(path, "known")["known"]
        else:
            with path.open("rb") as file:
                read_header(file)  # numpy would allocate memory without checking
            with of_library("is not a .npy file with a mask"):
                mask = np.asanyarray(np.load(path, mmap_mode="r", allow_pickle=False))
        ATTRIBUTES["known"].check(mask.dtype, mask.shape, shape)
    return mask
