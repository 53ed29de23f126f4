"""HDF5: datasets of the root group, with the same names as in `.npz`.

`known` is a bool dataset as h5py writes it, an 8-bit enumeration of FALSE and TRUE, or numbers, as
in all formats. `fps`, `up_axis`, `name`, `start`,
`metres_per_unit` and `standard_error_of` may also be attributes of the root group.
Datasets in other groups are ignored, and data in other files, to which HDF5 can refer by links,
virtual datasets and raw storage, are refused.
"""

import contextlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._checks import native
from .._errors import InputError, of_library, require
from ..frame import Frame, Indices
from ..header import Header
from ..stored import FileFrames
from .format import ARRAYS, STATED, Format
from .output import NO_LOCKS
from .rows import arrays_once, header_of, kinds_per_frame, per_frame, rows_of, single

# Frames that share compressed chunks are read in order, so the chunks are cached until the last.
chunk_cache = {"rdcc_nbytes": 48 << 20, "rdcc_nslots": 10007}
most_packed = 100_000
"""Largest ratio of data to file size, as compression and unwritten data take little space."""


_TRIED = "cannot be read as HDF5"


class Hdf5Frames(FileFrames):
    """A sequence in an HDF5 file, in any chunks, compression and byte order."""

    def __init__(self, path: Path) -> None:
        self._h5py = require("h5py", extra="hdf5")
        self._size = path.stat().st_size
        self._file = self._open(path)
        with contextlib.ExitStack() as stack, of_library(_TRIED):
            stack.enter_context(self._file)
            names = set(self._file) | set(self._file.attrs).intersection(single)
            if not names >= {"vertices", "faces"}:
                self._file.visit(names.add)  # so that the error lists all
            self._rows = {name: self._dataset(name) for name in per_frame if name in names}
            super().__init__(path, header_of(names, self._kind, self._array))
            stack.pop_all()  # the file stays open

    def _open(self, path: Path) -> Any:
        try:
            with of_library(_TRIED):
                return self._h5py.File(path, "r", **chunk_cache)
        except BlockingIOError as error:
            raise OSError(f"{path}: is open for writing in another program") from error
        except OSError as error:
            if error.errno not in NO_LOCKS:
                raise
            return self._h5py.File(path, "r", locking=False, **chunk_cache)

    def _dataset(self, name: str) -> Any:
        dataset = self._file[name]
        if not isinstance(dataset, self._h5py.Dataset):
            raise InputError(
                f"must be a dataset, not a {type(dataset).__name__.lower()}", argument=name
            )
        if dataset.file.filename != self._file.filename or dataset.is_virtual or dataset.external:
            raise InputError("is not in this file: copy the data into it", argument=name)
        if dataset.nbytes > most_packed * self._size:
            raise InputError(
                f"would have {dataset.nbytes} bytes, but the file has {self._size}", argument=name
            )
        return dataset

    def _kind(self, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
        rows = self._rows[name]
        return rows.shape or (), rows.dtype

    def _array(self, name: str) -> NDArray[Any]:
        if name in self._file:
            dataset = self._dataset(name)
            text = self._h5py.check_string_dtype(dataset.dtype) is not None
            return np.asarray(dataset.asstr()[()] if text else dataset[()])
        value = self._file.attrs[name]
        return np.asarray(value.decode() if isinstance(value, bytes) else value)

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        with of_library(_TRIED):
            for number in numbers:
                rows = {name: native(dataset[number]) for name, dataset in self._rows.items()}
                yield Frame(rows.pop("vertices"), **rows)

    def _close(self) -> None:
        self._file.close()


def write_hdf5(path: Path, header: Header, frames: Iterable[Frame]) -> None:
    """Writes datasets of an HDF5 file."""
    with contextlib.ExitStack() as stack:
        # No other process writes in the hidden folder, whose disk may have no locks.
        file = require("h5py", extra="hdf5").File(path, "w", locking=False)
        stack.callback(_close_quietly, file)  # on a full disk, closing fails as well
        rows = {
            name: file.create_dataset(name, shape, dtype)
            for name, (shape, dtype) in kinds_per_frame(header).items()
        }
        for name, array in arrays_once(header).items():
            file[name] = array
        for number, frame in enumerate(frames):
            for name, row in rows_of(frame).items():
                rows[name][number] = row
        stack.pop_all()
        file.close()


def _close_quietly(file: Any) -> None:
    with contextlib.suppress(Exception):
        file.close()


hdf5 = Format(
    "hdf5",
    (".h5", ".hdf5"),
    Hdf5Frames,
    write_hdf5,
    ARRAYS | {*STATED} - {"subdivision"},
    library=("h5py", "hdf5"),
)
