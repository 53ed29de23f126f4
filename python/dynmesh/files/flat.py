"""Files in which all frames lie one after another, each of the same size."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def check_size(size: int, begin: int, n_frames: int, row_size: int) -> None:
    """Refuses a file that is not as long as it says of itself.

    Args:
        size: of the file, in bytes.
        begin: how many bytes come before the rows.
        n_frames: how many rows there should be.
        row_size: of each, in bytes.
    """
    expected = begin + n_frames * row_size
    if size < begin:
        raise ValueError(f"ends in its header, after {size} of {begin} bytes")
    if size < expected:
        number, rest = divmod(size - begin, row_size)
        where = "in the middle of" if rest else "before"
        raise ValueError(
            f"ends {where} frame {number} of {n_frames}: "
            f"its header tells of {expected} bytes, but there are {size}"
        )
    if size > expected:
        raise ValueError(
            f"goes on after its {n_frames} frames: "
            f"its header tells of {expected} bytes, but there are {size}"
        )


class FlatRows:
    """The rows of an array in a file, mapped into memory one at a time.

    Mapping them all at once would need as much address space as the file is long.
    """

    def __init__(
        self, path: Path, begin: int, shape: tuple[int, ...], dtype: np.dtype[Any]
    ) -> None:
        """Opens the file and checks its size against what it says of itself.

        Args:
            path: of the file.
            begin: how many bytes come before the rows.
            shape: of the array; the rows are on its first axis.
            dtype: of the array.

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

    def read(self, number: int) -> NDArray[Any]:
        """The row of this number, in the machine's byte order."""
        place = self._begin + number * self._row_size
        row = np.memmap(self._file, self.dtype, "r", place, self.shape[1:])
        return np.asarray(row).astype(self.dtype.newbyteorder("="), copy=False)

    def close(self) -> None:
        """Closes the file."""
        self._file.close()
