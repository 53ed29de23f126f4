"""Frames that were completed backwards, on disk until they can be written in order."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from ..files import Frame, Header, naming
from ..files.kept import Pieces, Sums


class ReversedFrames:
    """A file of the frames before the whole one, which arrive in reverse order.

    Every frame takes the same number of bytes, and the last one, which arrives first, is the first
    in the file.
    """

    def __init__(
        self, path: Path, header: Header, n_frames: int, kept: int, pieces: Pieces | None = None
    ) -> None:
        """Creates the file, or continues it after as many frames as are `kept`.

        `pieces` have their checksums, from :meth:`pieces`.

        Raises:
            OSError: the file cannot be opened.
            ValueError: the file has fewer frames than are to be kept.
        """
        k = header.n_vertices
        kinds: list[tuple[str, Any, tuple[int, ...]]] = [("points", header.dtype, (k, 3))]
        kinds += [(name, row.dtype, (k,)) for name, row in header.attributes.items()]
        self._record = np.dtype(kinds)
        self._n_frames = n_frames
        self._path = path
        self._sums = Sums({path.name: (pieces or {}).get(path.name, ())} if kept else None)
        self._file = path.open("r+b" if kept else "w+b")
        size = kept * self._record.itemsize
        if os.fstat(self._file.fileno()).st_size < size:
            self._file.close()
            raise ValueError(f"{path}: has less than {kept} frames")
        self._file.truncate(size)
        self._file.seek(size)

    def append(self, frame: Frame) -> None:
        """Adds the frame before the last one that was added."""
        row = np.empty((), self._record)
        for name in self._record.names or ():
            row[name] = getattr(frame, name)
        data = row.tobytes()
        with naming(self._path):
            self._file.write(data)
            self._file.flush()  # so that the frame survives this process
        self._sums.add(self._path.name, data)

    def pieces(self) -> Pieces:
        """Returns checksums of the frames so far."""
        return self._sums.pieces()

    def frame(self, number: int) -> Frame:
        """Returns the frame with this number in the sequence; all of them must be there."""
        size = self._record.itemsize
        self._file.seek((self._n_frames - 1 - number) * size)
        row = np.frombuffer(self._file.read(size), self._record)[0]
        return Frame(**{name: row[name] for name in self._record.names or ()})

    def close(self) -> None:
        """Closes the file, which remains."""
        self._file.close()
