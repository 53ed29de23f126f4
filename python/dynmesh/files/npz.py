"""`.npz`: an archive of numpy arrays, dynmesh's own format.

It holds `vertices`, `faces` and, optionally, what else a :class:`dynmesh.Sequence` has, under the
same names; polygons are `polygon_sizes` and `polygon_corners`.
"""

import contextlib
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ..polygons import Polygons
from ..sequence import check_faces, check_known, check_provenance, check_vertices
from .interface import (
    Format,
    Frame,
    Header,
    Reader,
    Template,
    Writer,
    refuse_mesh_name,
    refuse_template,
)
from .rows import RowFile, read_header

per_frame = ("vertices", "known", "generation", "age")


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
        for needed in ("vertices", "faces"):
            if needed not in names:
                raise ValueError(
                    f"has no array '{needed}': a sequence holds vertices, faces and, "
                    f"optionally, known and fps; this file holds {', '.join(sorted(names))}"
                )
        self._per_frame = [name for name in per_frame if name in names]
        shape, dtype = self._shape("vertices")
        check_vertices(dtype, shape)
        faces = self._array("faces")
        check_faces(faces.dtype, faces.shape)
        if "known" in names:
            known_shape, known_dtype = self._shape("known")
            check_known(known_dtype, known_shape, shape[:2])
        for name in ("generation", "age"):
            if name in names:
                own_shape, own_dtype = self._shape(name)
                check_provenance(name, own_dtype, own_shape, shape[:2])
        polygons = None
        if "polygon_sizes" in names and "polygon_corners" in names:
            polygons = Polygons(self._array("polygon_sizes"), self._array("polygon_corners"))
        return Header(
            faces=faces,
            n_frames=shape[0],
            n_vertices=shape[1],
            dtype=dtype.newbyteorder("="),
            fps=self._fps() if "fps" in names else None,
            polygons=polygons,
            up_axis=str(self._array("up_axis")) if "up_axis" in names else None,
            name=str(self._array("name")) if "name" in names else None,
            has_known="known" in names,
            has_provenance="generation" in names and "age" in names,
        )

    def _shape(self, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
        with contextlib.closing(_Rows(self._archive, name)) as rows:
            return rows.shape, rows.dtype

    def _array(self, name: str) -> NDArray[Any]:
        with self._archive.open(f"{name}.npy") as file:
            return npy.read_array(file, allow_pickle=False)

    def _fps(self) -> float:
        fps = self._array("fps")
        if fps.size != 1 or fps.dtype.kind not in "fiu":
            raise ValueError(f"fps: must be one number, not {fps.dtype} of shape {fps.shape}")
        return float(fps.reshape(()))

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


class NpzWriter(Writer):
    """An archive of arrays in the making.

    An archive is written one member after another, so until the end each array that has a row per
    frame waits in a file of its own, which is also what makes an interrupted writer go on.
    """

    resumable = True

    def _begin(self, kept: int) -> None:
        header = self.header
        kinds: dict[str, Any] = {"vertices": (header.dtype, (3,))}
        if header.has_known:
            kinds["known"] = (np.bool_, ())
        if header.has_provenance:
            kinds |= {"generation": (np.int32, ()), "age": (np.int32, ())}
        self._rows: dict[str, RowFile] = {}
        for name, (dtype, row_shape) in kinds.items():
            shape = (header.n_frames, header.n_vertices, *row_shape)
            file = self.folder / f"{name}.npy"
            self._rows[name] = RowFile(file, np.dtype(dtype), shape, kept)

    def _append(self, frame: Frame) -> None:
        for name, rows in self._rows.items():
            row = frame.points if name == "vertices" else getattr(frame, name)
            rows.append(row if name in ("vertices", "known") else row.astype(np.int32))

    def _flush(self) -> None:
        for rows in self._rows.values():
            rows.flush()

    def _finish(self) -> None:
        self._close()
        header = self.header
        arrays: dict[str, Any] = {"faces": header.faces}
        if header.fps is not None:
            arrays["fps"] = np.float64(header.fps)
        if header.polygons is not None:
            arrays["polygon_sizes"], arrays["polygon_corners"] = header.polygons
        if header.up_axis is not None:
            arrays["up_axis"] = header.up_axis
        if header.name is not None:
            arrays["name"] = header.name
        target = self.folder / self.path.name
        with zipfile.ZipFile(target, "w", zipfile.ZIP_STORED) as archive:
            for name, array in arrays.items():
                with archive.open(f"{name}.npy", "w") as file:
                    npy.write_array(file, np.asanyarray(array), allow_pickle=False)
            for name, rows in self._rows.items():
                archive.write(rows.path, f"{name}.npy")
                rows.path.unlink()

    def _close(self) -> None:
        for rows in self._rows.values():
            rows.close()


@contextlib.contextmanager
def _explaining() -> Iterator[None]:
    try:
        yield
    except zipfile.BadZipFile as error:
        raise ValueError(f"is damaged or no .npz archive: {error}") from error


npz = Format("npz", (".npz",), "numpy's archive of arrays", NpzReader, NpzWriter)
