"""The members of an archive, of which any part can be read without unpacking all before it."""

import contextlib
import shutil
import struct
import tempfile
from threading import Lock
from typing import IO
from zipfile import ZIP_STORED, ZipFile

from .rows import read_at

_LENGTHS = struct.Struct("<26xHH")
"""Of the name and of the extra field, in the header before a member."""


class Member:
    """A member of an archive.

    An archive gives its bytes in order, and compares their checksum at the end. Once more than half
    of them were skipped, the checksum is compared, and they are unpacked into a temporary file; if
    they are not compressed, they are then read where they are.

    Attributes:
        size: in bytes, when it is unpacked.
    """

    def __init__(self, archive: ZipFile, name: str, file: IO[bytes], lock: Lock) -> None:
        self._archive, self._info = archive, archive.getinfo(name)
        self._file, self._lock = file, lock
        self.size = self._info.file_size
        self._left_to_skip = self.size / 2
        self._plain: IO[bytes] | None = None
        self._begin = 0

    def open(self) -> IO[bytes]:
        """Opens it to be read in order, or by `read_at`."""
        return self._archive.open(self._info)

    def read_at(self, packed: IO[bytes], place: int, size: int) -> bytes:
        """Reads some bytes, of what `open` returned."""
        if self._plain is None:
            ahead = place - packed.tell()
            self._left_to_skip -= ahead if ahead >= 0 else place
            if self._left_to_skip < 0:
                with contextlib.suppress(OSError):  # no space: it is read in order, as before
                    self._unpack()
        if self._plain is None:
            return read_at(packed, place, size)
        with self._lock:
            return read_at(self._plain, self._begin + place, size)

    def _unpack(self) -> None:
        with self.open() as packed:
            if self._info.compress_type != ZIP_STORED:
                self._plain = _copied(packed)
                return
            while packed.read(1 << 18):
                pass
        with self._lock:
            header = read_at(self._file, self._info.header_offset, _LENGTHS.size)
            self._begin = self._info.header_offset + len(header) + sum(_LENGTHS.unpack(header))
            self._plain = self._file

    def close(self) -> None:
        """Removes the temporary file."""
        if self._plain is not None:
            self._plain.close()


def _copied(packed: IO[bytes]) -> IO[bytes]:
    """Returns a temporary file with the same content."""
    with contextlib.ExitStack() as stack:
        plain = stack.enter_context(tempfile.TemporaryFile())
        shutil.copyfileobj(packed, plain)
        stack.pop_all()  # it stays open
    return plain
