"""`.npz`: an archive of numpy arrays, dynmesh's own format.

It holds `vertices`, `faces` and, optionally, the other attributes of a :class:`dynmesh.Sequence`,
with the same names; polygons are `polygon_sizes` and `polygon_corners`. A folder or a pattern of
several archives is a sequence with a frame in each, which can only be read.

An archive gives the bytes of an array in order; a frame before the last one that was read is found
from the beginning again.
"""

import contextlib
import shutil
import weakref
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

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
    write_rows,
)
from .text import Metadata

_TRIED = "is damaged or not an .npz archive"

most_deflated = 1032
"""Largest ratio of the size of an uncompressed member to the size of the archive."""


class NpzFrames(RowsFrames):
    """A sequence in an archive of arrays."""

    def __init__(self, path: Path) -> None:
        with contextlib.ExitStack() as stack, of_library(_TRIED):
            self._archive = stack.enter_context(zipfile.ZipFile(path))
            check_members(self._archive, path)
            every = self._archive.infolist()
            self._members = {one.filename.removesuffix(".npy"): one for one in every}
            super().__init__(path, self._header())
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
        with self._archive.open(member) as file:
            try:
                rows = Rows(file, member.file_size)
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
