"""`.npz`: an archive of numpy arrays, dynmesh's own format.

It holds `vertices`, `faces` and, optionally, the other attributes of a :class:`dynmesh.Sequence`,
with the same names; polygons are `polygon_sizes` and `polygon_corners`. A folder or a pattern of
several archives is a sequence with a frame in each, which can only be read.
"""

import contextlib
import shutil
import struct
import tempfile
import weakref
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from threading import Lock
from typing import IO, Any
from zipfile import ZIP_STORED, ZipFile

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from .._errors import InputError, of_library
from .._report import listed
from ..frame import Frame, Indices
from ..header import ATTRIBUTES, Header, check_vertices, with_all_needed
from ..polygons import as_polygons, split_faces
from .format import ARRAYS, STATED, Format
from .frame_files import IN_FILES, FilePerFrame, Loaded
from .rows import (
    Rows,
    RowsFrames,
    arrays_once,
    header_of,
    kinds_per_frame,
    per_frame,
    read_at,
    write_rows,
)
from .text import Metadata

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


_TRIED = "is damaged or not an .npz archive"

most_deflated = 1032
"""Largest ratio of the size of an uncompressed member to the size of the archive."""


class NpzFrames(RowsFrames):
    """A sequence in an archive of arrays."""

    def __init__(self, path: Path) -> None:
        with contextlib.ExitStack() as stack, of_library(_TRIED):
            file = stack.enter_context(path.open("rb"))
            self._archive = stack.enter_context(zipfile.ZipFile(path))
            check_members(self._archive, path)
            lock = Lock()
            self._members = {
                name.removesuffix(".npy"): Member(self._archive, name, file, lock)
                for name in self._archive.namelist()
            }
            super().__init__(path, self._header())
            for member in self._members.values():
                stack.callback(member.close)
            self._closing = weakref.finalize(self, stack.pop_all().close)

    def _header(self) -> Header:
        names = self._members.keys()
        self._arrays = [name for name in per_frame if name in names]
        return header_of(names, self._kind, self._array)

    def _kind(self, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
        with self._open_rows(name) as rows:
            return rows.shape, rows.dtype

    def _array(self, name: str) -> NDArray[Any]:
        with self._open_rows(name) as rows:
            return rows.whole()

    @contextlib.contextmanager
    def _open_rows(self, name: str) -> Iterator[Rows]:
        """Opens the array with that name, whose size must be as its header declares."""
        member = self._members[name]
        with member.open() as file:
            try:
                rows = Rows(file, member.size, member.read_at)
            except ValueError as error:
                raise InputError(f"{error}", argument=name) from error
            yield rows

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        with of_library(_TRIED):
            yield from super()._frames(numbers)

    def _close(self) -> None:
        self._closing()


def write_npz(path: Path, header: Header, frames: Iterable[Frame]) -> None:
    """Writes an archive of arrays.

    The members of an archive are written one after another. Therefore each array with a row per
    frame is kept in its own file until the end.
    """
    files = {name: path.with_name(f"{name}.npy") for name in kinds_per_frame(header)}
    write_rows(files, header, frames)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays_once(header).items():
            with archive.open(f"{name}.npy", "w") as member:
                npy.write_array(member, np.asanyarray(array), allow_pickle=False)
        for name, file in files.items():
            # Unlike archive.write, this stores no time, so equal sequences give equal bytes.
            member = archive.open(f"{name}.npy", "w", force_zip64=True)
            with file.open("rb") as rows, member:
                shutil.copyfileobj(rows, member, 1 << 20)
            file.unlink()


def check_members(archive: zipfile.ZipFile, file: Path) -> None:
    """Refuses members that are misnamed by damage, or would be larger than the archive."""
    size = file.stat().st_size
    for member in archive.infolist():
        archive.open(member).close()  # compares its two names
        known = member.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
        if known and member.file_size > most_deflated * size:
            raise InputError(
                f"is damaged: {member.filename} would have {member.file_size} bytes, "
                f"but the archive has {size}"
            )


def arrays_in(path: Path, needed: str, *others: str) -> dict[str, NDArray[Any]]:
    """Reads some arrays of an archive, by name."""
    with of_library(_TRIED), zipfile.ZipFile(path) as archive:
        check_members(archive, path)
        members = {one.filename.removesuffix(".npy"): one for one in archive.infolist()}
        if needed not in members:
            raise InputError(f"has no array {needed!r}, but {listed(members) or 'none'}")
        result = {}
        for name in (needed, *(other for other in others if other in members)):
            with archive.open(members[name]) as file:
                result[name] = Rows(file, members[name].file_size).whole()
        return result


class NpzPerFrame(FilePerFrame):
    """A sequence in one archive per frame, of arrays without a first axis, or one of length 1."""

    suffix = ".npz"

    def _load(self, file: Path) -> Loaded:
        arrays = arrays_in(file, "vertices", "faces", *ATTRIBUTES, *Metadata._fields)
        points = arrays.pop("vertices")
        if points.ndim == 3 and len(points) != 1:
            raise InputError(
                f"holds {len(points)} frames, but is one of several files that hold one each; name "
                "one file, or a pattern of others"
            )
        points = points.reshape(points.shape[-2:])
        check_vertices(points.dtype, (1, *points.shape))
        faces = as_polygons(*split_faces(arrays.pop("faces", _NO_FACES), len(points)))
        said = Metadata(**{n: arrays.pop(n).item() for n in Metadata._fields if n in arrays})
        names = with_all_needed(arrays)
        for name in names:
            arrays[name] = arrays[name].reshape(arrays[name].shape[-1:])
            ATTRIBUTES[name].check(arrays[name].dtype, arrays[name].shape, (len(points),))
        return Loaded(Frame(points, **{name: arrays[name] for name in names}), faces, said, set())


_NO_FACES = np.zeros((0, 3), np.int32)

npz_frames = Format(
    "npz_frames",
    (".npz",),
    NpzPerFrame,
    keeps=ARRAYS | IN_FILES,
    takes=frozenset({"faces", "gaps"}),
)

npz = Format("npz", (".npz",), NpzFrames, write_npz, ARRAYS | {*STATED} - {"subdivision"})
