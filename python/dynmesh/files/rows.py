"""Arrays in numpy's own format, read and written row by row."""

import contextlib
import os
from abc import abstractmethod
from pathlib import Path
from typing import IO, Any, NamedTuple, Self

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from .header import Frame
from .named import kinds_per_frame, rows_of
from .writer import Writer


class ArrayHeader(NamedTuple):
    """What a `.npy` file says of its array."""

    shape: tuple[int, ...]
    by_columns: bool
    dtype: np.dtype[Any]


def read_header(file: IO[bytes]) -> ArrayHeader:
    """Reads up to where the numbers begin; refuses Python objects."""
    version = npy.read_magic(file)
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    header = ArrayHeader(*read(file))
    if header.dtype.hasobject:
        raise ValueError("holds Python objects, not numbers")
    return header


class RowFile:
    """A `.npy` file that grows row by row, up to a length known beforehand."""

    def __init__(self, path: Path, dtype: np.dtype[Any], shape: tuple[int, ...], kept: int) -> None:
        """Begins the file, or opens it and forgets all but its first `kept` rows."""
        self.path = path
        row_size = dtype.itemsize * int(np.prod(shape[1:]))
        with contextlib.ExitStack() as stack:
            file: IO[bytes] = stack.enter_context(path.open("r+b" if kept else "wb"))
            if kept == 0:
                kind = npy.dtype_to_descr(dtype)
                header = {"descr": kind, "fortran_order": False, "shape": shape}
                npy.write_array_header_1_0(file, header)
            else:
                read_header(file)
                end = file.tell() + kept * row_size
                if os.fstat(file.fileno()).st_size < end:
                    raise ValueError(f"{path.name} ends before row {kept}")
                file.truncate(end)
                file.seek(end)
            self._file = file
            stack.pop_all()  # the file stays open

    def append(self, row: NDArray[Any]) -> None:
        """Adds a row."""
        self._file.write(np.ascontiguousarray(row).data)

    def flush(self) -> None:
        """Hands everything to the system."""
        self._file.flush()

    def close(self) -> None:
        """Closes the file; may be called again."""
        self._file.close()

    def __enter__(self) -> Self:
        """Is the file itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the file."""
        self.close()


class RowFilesWriter(Writer):
    """A sequence in the making; each array that has a row per frame grows in a file of its own."""

    resumable = True

    @abstractmethod
    def _row_file(self, name: str) -> Path:
        """Where the array of that name grows."""

    def _begin(self, kept: int) -> None:
        self._rows: dict[str, RowFile] = {}
        for name, (shape, dtype) in kinds_per_frame(self.header).items():
            self._rows[name] = RowFile(self._row_file(name), dtype, shape, kept)

    def _append(self, frame: Frame) -> None:
        for name, row in rows_of(frame).items():
            self._rows[name].append(row)

    def _flush(self) -> None:
        for rows in self._rows.values():
            rows.flush()

    def _close(self) -> None:
        for rows in self._rows.values():
            rows.close()
