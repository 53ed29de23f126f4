"""Completed frames that wait on disk until they can be written in order."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..files import Frame, Header, naming
from ..files.kept import Pieces, Sums
from ..frames.attributes import ATTRIBUTES


class WaitingFrames:
    """A file of frames, in the order in which they were completed.

    Every frame takes the same number of bytes.
    """

    def __init__(
        self,
        path: Path,
        header: Header,
        attributes: Iterable[str],
        numbers: range,
        kept: int,
        pieces: Pieces,
    ) -> None:
        """Creates the file, or continues it after as many frames as are `kept`.

        Args:
            path: of the file.
            header: of the sequence.
            attributes: the names of those that are stored.
            numbers: of the frames in the sequence, in the order of their completion.
            kept: how many of them the file has.
            pieces: their checksums, from :meth:`pieces`.

        Raises:
            OSError: the file cannot be opened.
            ValueError: the file has fewer frames than are to be kept.
        """
        k = header.n_vertices
        kinds: list[tuple[str, Any, tuple[int, ...]]] = [("points", header.dtype, (k, 3))]
        kinds += [(name, ATTRIBUTES[name].dtype, (k,)) for name in attributes]
        self._record = np.dtype(kinds)
        self.numbers = numbers
        self._path = path
        self._sums = Sums({path.name: pieces.get(path.name, ())} if kept else None)
        self._file = path.open("r+b" if kept else "w+b")
        size = kept * self._record.itemsize
        if os.fstat(self._file.fileno()).st_size < size:
            self._file.close()
            raise ValueError(f"{path}: has less than {kept} frames")
        self._file.truncate(size)

    def append(self, frame: Frame) -> None:
        """Adds the next frame."""
        row = np.empty((), self._record)
        for name in self._record.names or ():
            row[name] = getattr(frame, name)
        data = row.tobytes()
        with naming(self._path):
            self._file.seek(0, os.SEEK_END)
            self._file.write(data)
            self._file.flush()  # so that the frame survives this process
        self._sums.add(self._path.name, data)

    def pieces(self) -> Pieces:
        """Returns checksums of the frames so far."""
        return self._sums.pieces()

    def frame(self, number: int) -> Frame:
        """Returns the frame with this number in the sequence, which must be there."""
        size = self._record.itemsize
        self._file.seek(self.numbers.index(number) * size)
        row = np.frombuffer(self._file.read(size), self._record)[0]
        return Frame(**{name: row[name] for name in self._record.names or ()})

    def close(self) -> None:
        """Closes the file, which remains."""
        self._file.close()
