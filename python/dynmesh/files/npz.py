"""`.npz`: an archive of numpy arrays, dynmesh's own format.

It holds `vertices`, `faces` and, optionally, what else a :class:`dynmesh.Sequence` has, under the
same names; polygons are `polygon_sizes` and `polygon_corners`.
"""

import contextlib
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from .format import Format, Template, refuse_mesh_name, refuse_template
from .header import Frame, Header
from .named import arrays_once, header_of, per_frame
from .reader import Reader
from .rows import RowFilesWriter, read_header


class _Rows:
    """The rows of one member of an archive, read one after another."""

    def __init__(self, archive: zipfile.ZipFile, name: str) -> None:
        self._whole: NDArray[Any] | None = None
        with contextlib.ExitStack() as stack:
            self._file = stack.enter_context(archive.open(f"{name}.npy"))
            try:
                self.shape, by_columns, self.dtype = read_header(self._file)
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from error
            self._begin = self._file.tell()
            if by_columns:  # no row lies in one piece
                with archive.open(f"{name}.npy") as file:
                    self._whole = npy.read_array(file)
            stack.pop_all()

    def read(self, number: int) -> NDArray[Any]:
        row_shape = self.shape[1:]
        if self._whole is not None:
            row = np.ascontiguousarray(self._whole[number])
        else:
            size = self.dtype.itemsize * int(np.prod(row_shape))
            place = self._begin + number * size
            if self._file.tell() != place:
                self._file.seek(place)
            data = self._file.read(size)
            if len(data) < size:
                raise ValueError(f"ends in the middle of frame {number} of {self.shape[0]}")
            row = np.frombuffer(data, self.dtype).reshape(row_shape)
        return row.astype(self.dtype.newbyteorder("="), copy=False)

    def close(self) -> None:
        self._file.close()


class NpzReader(Reader):
    """A sequence in an archive of arrays."""

    def __init__(self, path: Path, template: Template | None, prim: str | None) -> None:
        """Opens the archive and reads everything but the frames."""
        refuse_template(template)
        refuse_mesh_name(prim)
        with contextlib.ExitStack() as stack, _explaining():
            self._archive = stack.enter_context(zipfile.ZipFile(path))
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
        with self._archive.open(f"{name}.npy") as file:
            return npy.read_array(file, allow_pickle=False)

    def _frames(self, numbers: range) -> Iterator[Frame]:
        with contextlib.ExitStack() as stack, _explaining():
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
    """An archive of arrays in the making.

    An archive is written one member after another, so until the end each array that has a row per
    frame waits in a file of its own, which is also what makes an interrupted writer go on.
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
            for name, rows in self._rows.items():
                # Not archive.write, which notes the time: equal sequences give equal bytes.
                member = archive.open(f"{name}.npy", "w", force_zip64=True)
                with rows.path.open("rb") as source, member:
                    shutil.copyfileobj(source, member, 1 << 20)
                rows.path.unlink()


@contextlib.contextmanager
def _explaining() -> Iterator[None]:
    try:
        yield
    except zipfile.BadZipFile as error:
        raise ValueError(f"is damaged or no .npz archive: {error}") from error


npz = Format("npz", (".npz",), "numpy's archive of arrays", NpzReader, NpzWriter)
