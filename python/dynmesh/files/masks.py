"""Known masks that are not stored in the file with the positions."""

from collections.abc import Container, Iterator
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from .._checks import as_array, check_path
from .._errors import InputError, locating
from ..attributes import ATTRIBUTES, as_mask
from ..sequence import Mask
from .frame import Frame
from .naming import naming
from .reader import Reader
from .rows import read_header


def check_missing(missing: object) -> None:
    """Refuses what does not name a value that marks missing positions."""
    if missing not in (None, "zero"):
        raise InputError(f"must be 'zero' or None, not {missing!r}", argument="missing")


class MaskedReader(Reader):
    """A sequence whose known masks are given, or derived from positions of zero, or both."""

    def __init__(
        self,
        reader: Reader,
        known: Mask | str | PathLike[str] | None,
        *,
        zero_is_missing: bool,
    ) -> None:
        """Takes ownership of `reader`, which :meth:`close` closes."""
        self._reader = reader
        self._zero_is_missing = zero_is_missing
        shape = (reader.n_frames, reader.n_vertices)
        self._mask_files = [Path(known)] if isinstance(known, str | PathLike) else []
        self._known = None if known is None else _load(known, shape)
        super().__init__(reader.path, replace(reader.header, has_known=True))

    @property
    def files(self) -> list[Path]:
        """The files that are read, that of the masks included."""
        return [*self._reader.files, *self._mask_files]

    @property
    def lost(self) -> Container[int]:
        """The numbers of the frames whose files are missing."""
        return self._reader.lost

    def _frames(self, numbers: range) -> Iterator[Frame]:
        frames = self._reader.frames(numbers.start, numbers.stop, numbers.step)
        for number, frame in zip(numbers, frames, strict=True):
            known = frame.known
            if self._known is not None:
                file = self._mask_files[0] if self._mask_files else None
                with locating(frame=self.header.number(number), file=file):
                    known = as_mask(np.array(self._known[number]))
            if known is None:
                known = np.asarray(np.isfinite(frame.points).all(axis=1))
            if self._zero_is_missing and number != self.whole:
                known = np.asarray(known & (frame.points != 0).any(axis=1), np.bool_)
            if number in self._reader.lost:
                known = np.zeros_like(known)
            yield replace(frame, known=known)

    def close(self) -> None:
        """Closes the file."""
        self._reader.close()


def _load(known: Any, shape: tuple[int, int]) -> Mask:
    known = as_array("known", known)
    if isinstance(known, np.ndarray):
        ATTRIBUTES["known"].check(known.dtype, known.shape, shape)
        return known
    check_path("known", known, "a numpy array or a path")
    path = Path(known)
    with naming(path):
        try:
            with path.open("rb") as file:
                read_header(file)  # numpy would allocate memory without checking
            mask: Mask = np.asanyarray(np.load(path, mmap_mode="r", allow_pickle=False))
        except (ValueError, EOFError) as error:
            raise ValueError(f"is not a .npy file with a mask: {error}") from error
        ATTRIBUTES["known"].check(mask.dtype, mask.shape, shape)
    return mask
