"""How the files that an interrupted run left are recognised as unchanged."""

import os
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from .._errors import InputError
from ..frames.naming import naming

Pieces = Mapping[str, Iterable[tuple[int, int, int]]]
"""Of each file, by its name, the pieces that are checked: where one begins, its size and crc32."""

_chunk = 1 << 20


class CannotResumeError(InputError):
    """What an interrupted run left is damaged, or of another version, and cannot be continued."""

    def __str__(self) -> str:
        """Adds what can be done."""
        return f"{super().__str__()}; run with --overwrite to start again"


class Sums:
    """Checksums of what is written, taken as it is written, so that nothing is read for them."""

    def __init__(self, pieces: Pieces | None = None) -> None:
        """Begins with those of an earlier run."""
        self._pieces: dict[str, dict[int, tuple[int, int]]] = {
            name: {begin: (size, crc) for begin, size, crc in of_file}
            for name, of_file in (pieces or {}).items()
        }

    def add(self, name: str, data: Any, begin: int = 0) -> None:
        """Appends bytes to the piece of a file that begins there."""
        of_file = self._pieces.setdefault(name, {})
        size, crc = of_file.get(begin, (0, 0))
        of_file[begin] = size + memoryview(data).nbytes, zlib.crc32(data, crc)

    def add_written(self, file: Path, begin: int = 0, end: int | None = None) -> None:
        """Adds bytes of a file that another library has written."""
        size = (file.stat().st_size if end is None else end) - begin
        self._pieces.setdefault(file.name, {})[begin] = size, _sum_of(file, begin, size)

    def pieces(self) -> dict[str, list[tuple[int, int, int]]]:
        """What :class:`Sums` takes again."""
        return {
            name: [(begin, *piece) for begin, piece in of_file.items()]
            for name, of_file in self._pieces.items()
        }


def check_unchanged(folder: Path, pieces: Pieces) -> None:
    """Refuses files that differ from what was written.

    Raises:
        CannotResumeError: a file is missing, too short, or has other bytes.
        OSError: a file cannot be read.
    """
    for name, of_file in pieces.items():
        file = folder / name
        try:
            with naming(file):
                for begin, size, crc in of_file:
                    if file.stat().st_size < begin + size:
                        raise CannotResumeError("is damaged: it is shorter than it was")
                    if _sum_of(file, begin, size) != crc:
                        raise CannotResumeError(
                            "is damaged: it is not what was written, which had another checksum"
                        )
        except (FileNotFoundError, NotADirectoryError) as error:
            raise CannotResumeError("is missing", file=file) from error
        except IsADirectoryError as error:
            raise CannotResumeError("is a folder", file=file) from error


def _sum_of(file: Path, begin: int, size: int) -> int:
    crc = 0
    with file.open("rb") as opened:
        os.lseek(opened.fileno(), begin, os.SEEK_SET)
        while size > 0 and (data := opened.read(min(size, _chunk))):
            crc = zlib.crc32(data, crc)
            size -= len(data)
    return crc
