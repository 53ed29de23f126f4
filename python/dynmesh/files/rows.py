"""Arrays in NumPy's own format, read and written row by row."""

import contextlib
import io
import math
import os
import warnings
from abc import abstractmethod
from pathlib import Path
from tokenize import TokenError
from typing import IO, Any, NamedTuple, Self

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ..frames.frame import Frame
from .named import kinds_per_frame, rows_of
from .writer import Writer

longest_header = 10_000
"""In bytes; NumPy refuses to read a longer header."""


class ArrayHeader(NamedTuple):
    """The header of a `.npy` file."""

    shape: tuple[int, ...]
    by_columns: bool
    dtype: np.dtype[Any]


def read_header(file: IO[bytes]) -> ArrayHeader:
    """Reads the header, up to the first number.

    Raises:
        ValueError: the file holds no array, or an array of Python objects.
    """
    version = npy.read_magic(file)
    length = int.from_bytes(file.read(4 if version > (1, 0) else 2), "little")
    if length > longest_header:  # NumPy allocates memory before it checks
        raise ValueError(f"is damaged: its header would have {length} bytes")
    file.seek(npy.MAGIC_LEN)
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    try:
        with warnings.catch_warnings(action="ignore", category=UserWarning):  # written by Python 2
            header = ArrayHeader(*read(file))
    except (TokenError, SyntaxError, TypeError) as error:
        raise ValueError(f"is damaged: its header cannot be read: {error}") from error
    if header.dtype.hasobject:
        raise ValueError("holds Python objects, not numbers")
    if min(header.shape, default=0) < 0:
        raise ValueError(f"declares an array of shape {header.shape}")
    return header


def read_array(file: IO[bytes], size: int) -> NDArray[Any]:
    """Reads the array of a file of `size` bytes, which must match its header.

    Raises:
        ValueError: see :func:`read_header`, or the size of the file does not match.
    """
    shape, by_columns, dtype = read_header(file)
    expected = file.tell() + math.prod(shape) * dtype.itemsize
    if size != expected:
        raise ValueError(f"its header declares {expected} bytes, but the file has {size}")
    numbers = np.frombuffer(bytearray(file.read()), dtype)
    return numbers.reshape(shape, order="F" if by_columns else "C")


def load_array(path: Path) -> NDArray[Any]:
    """Reads the array of a `.npy` file; see :func:`read_array`."""
    with path.open("rb") as file:
        return read_array(file, os.fstat(file.fileno()).st_size)


class RowFile:
    """A `.npy` file that grows row by row, up to a given length.

    Attributes:
        path: of the file.
        header: the bytes that were written before the first row; none if rows were kept.
    """

    def __init__(self, path: Path, dtype: np.dtype[Any], shape: tuple[int, ...], kept: int) -> None:
        """Creates the file, or opens it and removes all but its first `kept` rows."""
        self.path = path
        row_size = dtype.itemsize * int(np.prod(shape[1:]))
        with contextlib.ExitStack() as stack:
            file: IO[bytes] = stack.enter_context(path.open("r+b" if kept else "wb"))
            self.header = b""
            if kept == 0:
                kind = npy.dtype_to_descr(dtype)
                header = io.BytesIO()
                npy.write_array_header_1_0(
                    header, {"descr": kind, "fortran_order": False, "shape": shape}
                )
                self.header = header.getvalue()
                file.write(self.header)
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
        """Passes everything to the operating system."""
        self._file.flush()

    def close(self) -> None:
        """Closes the file; may be called more than once."""
        self._file.close()

    def __enter__(self) -> Self:
        """Returns the file itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the file."""
        self.close()


class RowFilesWriter(Writer):
    """A sequence that is being written, with a file for each array that has a row per frame."""

    resumable = True

    @abstractmethod
    def _row_file(self, name: str) -> Path:
        """Returns the file of the array with that name."""

    def _begin(self, kept: int) -> None:
        self._rows: dict[str, RowFile] = {}
        for name, (shape, dtype) in kinds_per_frame(self.header).items():
            rows = RowFile(self._row_file(name), dtype, shape, kept)
            self._rows[name] = rows
            self._add_sum(rows.path, rows.header)

    def _append(self, frame: Frame) -> None:
        for name, row in rows_of(frame).items():
            self._rows[name].append(row)
            self._add_sum(self._rows[name].path, np.ascontiguousarray(row).data)

    def _flush(self) -> None:
        for rows in self._rows.values():
            rows.flush()

    def _close(self) -> None:
        for rows in self._rows.values():
            rows.close()
