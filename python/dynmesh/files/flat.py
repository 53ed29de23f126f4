"""Files that hold all frames one after another, each of the same size."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def check_size(size: int, begin: int, n_frames: int, row_size: int) -> None:
    """Raises an error unless a file has the size that its header declares.

    The rows begin after `begin` bytes, and have `row_size` bytes each.
    """
    expected = begin + n_frames * row_size
    if size < begin:
        raise ValueError(f"ends in its header, after {size} of {begin} bytes")
    if size < expected:
        number, rest = divmod(size - begin, row_size)
        where = "in the middle of" if rest else "before"
        raise ValueError(
            f"ends {where} frame {number} of {n_frames}: "
            f"its header declares {expected} bytes, but the file has {size}"
        )
    if size > expected:
        raise ValueError(
            f"continues after its {n_frames} frames: "
            f"its header declares {expected} bytes, but the file has {size}"
        )


class FlatRows:
    """The rows of an array in a file, mapped into memory one at a time.

    Mapping them all at once would need as much address space as the file is long. In an array by
    columns, in Fortran order, no row is contiguous, so it is mapped as a whole.
    """

    def __init__(
        self,
        path: Path,
        begin: int,
        shape: tuple[int, ...],
        dtype: np.dtype[Any],
        *,
        by_columns: bool = False,
    ) -> None:
        """Opens the file, whose rows, on the first axis of the array, begin after `begin` bytes.

        Raises:
            ValueError: a length is negative, or the file is shorter or longer than these rows.
        """
        if min(shape, default=-1) < 0:
            raise ValueError(f"declares an array of shape {shape}")
        self._begin = begin
        self.shape, self.dtype = shape, dtype
        self._row_size = dtype.itemsize * math.prod(shape[1:])
        check_size(path.stat().st_size, begin, shape[0], self._row_size)
        self._file = path.open("rb")
        self._by_columns = by_columns

    def read(self, number: int) -> NDArray[Any]:
        """Returns the row with this number, contiguous and in native byte order."""
        if self._by_columns:
            row = np.memmap(self._file, self.dtype, "r", self._begin, self.shape, "F")[number]
        else:
            place = self._begin + number * self._row_size
            row = np.memmap(self._file, self.dtype, "r", place, self.shape[1:])
        native = self.dtype.newbyteorder("=")
        return np.asarray(row).astype(native, order="C", copy=False)

    def close(self) -> None:
        """Closes the file."""
        self._file.close()
