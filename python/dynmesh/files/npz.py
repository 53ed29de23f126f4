"""`.npz`: an archive of numpy arrays, dynmesh's own format.

It holds `vertices`, `faces` and, optionally, the other attributes of a :class:`dynmesh.Sequence`,
with the same names; polygons are `polygon_sizes` and `polygon_corners`.
"""

import contextlib
import errno
import io
import lzma
import math
import shutil
import struct
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from .._errors import InputError
from ..frames.frame import Frame
from ..frames.header import Header
from ..frames.reader import Reader
from .flat import check_size
from .format import Format
from .named import arrays_once, header_of, per_frame
from .rows import RowFilesWriter, native, read_array, read_header

_END = struct.Struct("<4s6xH10x")
"""The end of an archive: its signature, and the number of members."""

most_deflated = 1032
"""Largest ratio of the size of an uncompressed member to the size of the archive."""


class _Rows:
    """The rows of one member of an archive, read in order."""

    def __init__(self, archive: zipfile.ZipFile, name: str) -> None:
        self._whole: NDArray[Any] | None = None
        with contextlib.ExitStack() as stack:
            self._file = stack.enter_context(archive.open(f"{name}.npy"))
            size = archive.getinfo(f"{name}.npy").file_size
            try:
                self.shape, by_columns, self.dtype = read_header(self._file)
                self._begin = self._file.tell()
                self._row_size = math.prod(self.shape[1:]) * self.dtype.itemsize
                n_frames = self.shape[0] if self.shape else 1
                check_size(size, self._begin, n_frames, self._row_size)
            except ValueError as error:
                raise InputError(f"{error}", argument=name) from error
            if by_columns:  # no row is contiguous
                self._whole = read_member(archive, name)
            stack.pop_all()

    def read(self, number: int) -> NDArray[Any]:
        if self._whole is not None:
            return native(np.ascontiguousarray(self._whole[number]))
        place = self._begin + number * self._row_size
        if self._file.tell() != place:
            self._file.seek(place)
        data = self._file.read(self._row_size)
        if len(data) < self._row_size:
            raise ValueError(f"ends in the middle of frame {number} of {self.shape[0]}")
        return native(np.frombuffer(data, self.dtype).reshape(self.shape[1:]))

    def close(self) -> None:
        self._file.close()


def read_member(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    """Reads a whole array, whose size must be as its header declares."""
    member = archive.getinfo(f"{name}.npy")
    with archive.open(member) as file:
        return read_array(file, member.file_size)


class NpzReader(Reader):
    """A sequence in an archive of arrays."""

    def __init__(self, path: Path) -> None:
        """Opens the archive and reads everything except the frames."""
        with contextlib.ExitStack() as stack, explaining():
            self._archive = stack.enter_context(zipfile.ZipFile(path))
            check_members(self._archive, path)
            super().__init__(path, self._header())
            stack.pop_all()  # the archive stays open

    def _header(self) -> Header:
        names = {name.removesuffix(".npy") for name in self._archive.namelist()}
        self._per_frame = [name for name in per_frame if name in names]
        return header_of(names, self._kind, self._array)

    def _kind(self, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
        with contextlib.closing(_Rows(self._archive, name)) as rows:
            return rows.shape, rows.dtype

    def _array(self, name: str) -> NDArray[Any]:
        try:
            return read_member(self._archive, name)
        except ValueError as error:
            raise InputError(f"{error}", argument=name) from error

    def _frames(self, numbers: range) -> Iterator[Frame]:
        with contextlib.ExitStack() as stack, explaining():
            rows = {
                name: stack.enter_context(contextlib.closing(_Rows(self._archive, name)))
                for name in self._per_frame
            }
            for number in numbers:
                arrays = {name: row.read(number) for name, row in rows.items()}
                yield Frame(arrays.pop("vertices"), **arrays)

    def close(self) -> None:
        """Closes the archive."""
        self._archive.close()


class NpzWriter(RowFilesWriter):
    """An archive of arrays that is being written.

    The members of an archive are written one after another. Therefore each array with a row per
    frame is kept in its own file until the end, which also allows an interrupted writer to be
    continued.
    """

    def _row_file(self, name: str) -> Path:
        return self.folder / f"{name}.npy"

    def _finish(self) -> None:
        self._close()
        target = self.folder / self.path.name
        with zipfile.ZipFile(target, "w", zipfile.ZIP_STORED) as archive:
            for name, array in arrays_once(self.header).items():
                with archive.open(f"{name}.npy", "w") as file:
                    npy.write_array(file, np.asanyarray(array), allow_pickle=False)
            for name, path in self._paths.items():
                # Unlike archive.write, this stores no time, so equal sequences give equal bytes.
                member = archive.open(f"{name}.npy", "w", force_zip64=True)
                with path.open("rb") as source, member:
                    shutil.copyfileobj(source, member, 1 << 20)

    def _destinations(self) -> dict[str, Path]:
        return {self.path.name: self.path}  # without the arrays it was made from


def check_members(archive: zipfile.ZipFile, file: Path) -> None:
    """Refuses members that are lost or misnamed by damage, or would be larger than the archive."""
    size = file.stat().st_size
    with file.open("rb") as opened:
        opened.seek(-_END.size - len(archive.comment), io.SEEK_END)
        signature, count = _END.unpack(opened.read(_END.size))
    # A large count, or that of an archive with another end, is elsewhere.
    if signature == b"PK\5\6" and len(archive.infolist()) != count < 0xFFFF:
        raise ValueError(
            f"is damaged: it lists {len(archive.infolist())} arrays, but should hold {count}"
        )
    for member in archive.infolist():
        archive.open(member).close()  # compares its two names
        known = member.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
        if known and member.file_size > most_deflated * size:
            raise ValueError(
                f"is damaged: {member.filename} would have {member.file_size} bytes, "
                f"but the archive has {size}"
            )


@contextlib.contextmanager
def explaining() -> Iterator[None]:
    """Reports what a damaged archive makes Python raise as a ValueError."""
    try:
        yield
    except OSError as error:
        # EINVAL is raised for an offset before the start, none for what is not bzip2.
        if error.errno not in (None, errno.EINVAL):
            raise
        raise ValueError(f"is damaged or not an .npz archive: {error}") from error
    except (
        zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, EOFError, KeyError,
        NotImplementedError, OverflowError, RuntimeError,
    ) as error:  # fmt: skip
        raise ValueError(f"is damaged or not an .npz archive: {error}") from error


npz = Format("npz", (".npz",), "numpy's archive of arrays", NpzReader, NpzWriter)
