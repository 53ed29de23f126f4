"""Known masks that are not stored in the file with the positions."""

from collections.abc import Iterator
from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np

from .._arrays import Mask, mask_in_file
from .._checks import as_array, path_of
from .._errors import locating, naming, of_library
from ..frame import Frame, Indices
from ..header import ATTRIBUTES
from ..stored import FileFrames, Stored
from .npz import arrays_in
from .rows import read_header


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
        if known is not None:
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
            if self._missing is not None:
                known = known & (frame.points != self._missing).any(axis=1)
            if number in self.lost:
                known = np.zeros_like(known)
            yield replace(frame, known=known)

    def _close(self) -> None:
        self._reader.close()


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
