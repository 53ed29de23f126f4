"""Arrays by name, in NumPy's own format, read and written row by row.

`vertices` and the attributes of vertices have one row per frame; all others exist once.

`.npy` holds the positions as one array (n, k, 3). The other arrays are in separate files:
`NAME.faces.npy` and, optionally, `NAME.known.npy`, `NAME.generation.npy`, `NAME.age.npy`,
`NAME.standard_error.npy` and, as a text, what the standard errors are of,
`NAME.standard_error_of.npy`. Frames per second, polygons, the up axis, the name of the mesh, the
unit and the number of the first frame cannot be stored.
"""

import contextlib
import math
import os
import warnings
from abc import abstractmethod
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy_lib
from numpy.typing import NDArray

from .._checks import native
from .._errors import InputError, naming, of_library
from ..frame import Frame, Indices
from ..header import ATTRIBUTES, Header, check_faces, check_needed, check_vertices
from ..polygons import Polygons
from ..stored import FileFrames
from .format import ARRAYS, Format, Template, find_template

per_frame = ("vertices", *ATTRIBUTES)
single = ("fps", "up_axis", "name", "start", "metres_per_unit", "standard_error_of")
once = ("faces", "polygon_sizes", "polygon_corners", "times", *single)


def header_of(
    names: Collection[str],
    kind_of: Callable[[str], tuple[tuple[int, ...], np.dtype[Any]]],
    array_of: Callable[[str], NDArray[Any]],
) -> Header:
    """Reads the header of a file with arrays of these names.

    `kind_of` returns the shape and the dtype of an array, and `array_of` one without a row per
    frame.
    """
    for needed in ("vertices", "faces"):
        if needed not in names:
            raise InputError(
                f"has no array '{needed}': a sequence holds vertices, faces and, "
                f"optionally, known and fps; this file holds {', '.join(sorted(names)) or 'none'}"
            )
    if ("polygon_sizes" in names) != ("polygon_corners" in names):
        raise InputError("polygon_sizes, polygon_corners: must be given both or neither")
    own = [name for name in ATTRIBUTES if name in names]
    check_needed(own)
    shape, dtype = kind_of("vertices")
    check_vertices(dtype, shape)
    faces = array_of("faces")
    if "polygon_sizes" in names:  # which tell what was cut into these triangles
        check_faces(faces.dtype, faces.shape)
    for name, row in ATTRIBUTES.items():
        if name in names:
            own_shape, own_dtype = kind_of(name)
            row.check(own_dtype, own_shape, shape[:2])

    values: dict[str, Any] = {name: array_of(name) for name in ("times", *single) if name in names}
    for name, array in values.items():
        is_number, is_single = array.dtype.kind in "fiu", name != "times"
        if name in ("up_axis", "name", "standard_error_of"):
            values[name] = str(array)
        elif is_number and (not is_single or array.size == 1):
            values[name] = array.item() if is_single else array.astype(np.float64)
        else:
            what = "one number" if is_single else "numbers"
            kind = f"{array.dtype} of shape {array.shape}"
            raise InputError(f"must be {what}, not {kind}", argument=name)
    if "polygon_sizes" in names:
        values["polygons"] = Polygons(array_of("polygon_sizes"), array_of("polygon_corners"))
    n_frames, n_vertices, _ = shape
    dtype = dtype.newbyteorder("=")
    return Header(faces, n_frames, n_vertices, dtype, **values, attributes=own)


def kinds_per_frame(header: Header) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    """Returns the shape and the dtype of each array with one row per frame."""
    shape = (header.n_frames, header.n_vertices)
    attributes = {name: (shape, ATTRIBUTES[name].dtype) for name in header.attributes}
    return {"vertices": ((*shape, 3), header.dtype), **attributes}


def rows_of(frame: Frame) -> dict[str, NDArray[Any]]:
    """Returns the row that the frame adds to each of these arrays."""
    attributes = frame.attributes().items()
    return {
        "vertices": frame.points,
        **{name: values.astype(ATTRIBUTES[name].dtype) for name, values in attributes},
    }


def arrays_once(header: Header) -> dict[str, Any]:
    """Returns the arrays that exist once."""
    arrays = {"faces": header.faces, **header.stated}
    if polygons := arrays.pop("polygons", None):
        arrays["polygon_sizes"], arrays["polygon_corners"] = polygons
    return arrays


longest_header = 10_000
"""In bytes; NumPy refuses to read a longer header."""

_TRIED = "is not an array or a mask of NumPy, or its header is damaged"


def read_header(file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Reads the header, up to the first number: the shape, whether it is by columns, the dtype."""
    with of_library(_TRIED):
        version = npy_lib.read_magic(file)
    length = int.from_bytes(file.read(4 if version > (1, 0) else 2), "little")
    if length > longest_header:  # NumPy allocates memory before it checks
        raise InputError(f"is damaged: its header would have {length} bytes")
    file.seek(npy_lib.MAGIC_LEN)
    read = npy_lib.read_array_header_1_0 if version == (1, 0) else npy_lib.read_array_header_2_0
    with warnings.catch_warnings(action="ignore", category=UserWarning), of_library(_TRIED):
        shape, by_columns, dtype = read(file)  # the warning is of Python 2
    if dtype.hasobject:
        raise InputError("holds Python objects, not numbers")
    return shape, by_columns, dtype


class Rows:
    """An array in a file or in a member of an archive, whose rows are read one at a time."""

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file = file
        self.shape, self.by_columns, self.dtype = read_header(file)
        if min(self.shape, default=0) < 0:
            raise InputError(f"declares an array of shape {self.shape}")
        self._begin = file.tell()
        self._row_size = math.prod(self.shape[1:]) * self.dtype.itemsize
        expected = self._begin + math.prod(self.shape) * self.dtype.itemsize
        if size != expected:
            raise InputError(f"its header declares {expected} bytes, but the file has {size}")

    def whole(self) -> NDArray[Any]:
        """Returns the whole array, as it is stored."""
        self._file.seek(self._begin)
        numbers = np.frombuffer(bytearray(self._file.read()), self.dtype)
        return numbers.reshape(self.shape, order="F" if self.by_columns else "C")

    @cached_property
    def _whole(self) -> NDArray[Any]:
        """An array by columns, in Fortran order, in which no row is contiguous."""
        return self.whole()

    def read(self, number: int) -> NDArray[Any]:
        """Returns the row with this number, contiguous and in native byte order."""
        if self.by_columns:
            return native(np.ascontiguousarray(self._whole[number]))
        place = self._begin + number * self._row_size
        if self._file.tell() != place:
            self._file.seek(place)
        data = self._file.read(self._row_size)
        if len(data) < self._row_size:
            raise InputError(f"ends in the middle of frame {number} of {self.shape[0]}")
        return native(np.frombuffer(data, self.dtype).reshape(self.shape[1:]))


@contextlib.contextmanager
def open_rows(path: Path) -> Iterator[Rows]:
    """Opens the array of a `.npy` file."""
    with path.open("rb") as file:
        yield Rows(file, os.fstat(file.fileno()).st_size)


def load_array(path: Path) -> NDArray[Any]:
    """Reads the whole array of a `.npy` file."""
    with open_rows(path) as rows:
        return rows.whole()


class RowsFrames(FileFrames):
    """A sequence of which each array with a row per frame is read from a place of its own."""

    _arrays: Collection[str]
    """Which of these arrays there are."""

    def __init__(self, path: Path, header: Header, files: Sequence[Path] | None = None) -> None:
        super().__init__(path, header, files)
        self._by_columns: dict[str, Rows] = {}

    @abstractmethod
    def _open_rows(self, name: str) -> contextlib.AbstractContextManager[Rows]:
        """Opens the array with that name."""

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        with contextlib.ExitStack() as stack:
            rows = {name: self._rows(name, stack) for name in self._arrays}
            for number in numbers:
                arrays = {name: row.read(number) for name, row in rows.items()}
                yield Frame(arrays.pop("vertices"), **arrays)

    def _rows(self, name: str, stack: contextlib.ExitStack) -> Rows:
        if name in self._by_columns:
            return self._by_columns[name]
        rows = stack.enter_context(self._open_rows(name))
        if rows.by_columns:  # it is read as a whole, once
            rows.read(0)
            self._by_columns[name] = rows
        return rows


def write_rows(files: Mapping[str, Path], header: Header, frames: Iterable[Frame]) -> None:
    """Writes each array that has a row per frame to its own file."""
    with contextlib.ExitStack() as stack:
        opened: dict[str, IO[bytes]] = {}
        for name, (shape, dtype) in kinds_per_frame(header).items():
            opened[name] = stack.enter_context(files[name].open("wb"))
            kind = npy_lib.dtype_to_descr(dtype)
            described = {"descr": kind, "fortran_order": False, "shape": shape}
            npy_lib.write_array_header_1_0(opened[name], described)
        for frame in frames:
            for name, row in rows_of(frame).items():
                opened[name].write(np.ascontiguousarray(row).data)


def _path_of(name: str, path: Path) -> Path:
    """Returns the path of the array with that name if the positions are at `path`."""
    return path if name == "vertices" else path.with_name(f"{path.stem}.{name}.npy")


class NpyFrames(RowsFrames):
    """A sequence in an array of positions, with other arrays beside it."""

    def __init__(self, path: Path, faces: Template | None) -> None:
        self._positions = path
        with self._open_rows("vertices") as vertices:
            check_vertices(vertices.dtype, vertices.shape)
        self._arrays = [name for name in per_frame if _path_of(name, path).exists()]
        for name in self._arrays[1:]:
            with naming(_path_of(name, path)), self._open_rows(name) as rows:
                ATTRIBUTES[name].check(rows.dtype, rows.shape, vertices.shape[:2])
        check_needed(self._arrays)
        n_frames, n_vertices, _ = vertices.shape
        template = find_template(faces, n_vertices, {_path_of("faces", path): _load_faces})
        read = [*(_path_of(name, path) for name in self._arrays), *template.files]
        errors: Any = "position"
        if (beside := _path_of("standard_error_of", path)).exists():
            read.append(beside)
            with naming(beside):
                errors = str(load_array(beside))
        header = Header(
            faces=template.faces,
            n_frames=n_frames,
            n_vertices=n_vertices,
            dtype=vertices.dtype.newbyteorder("="),
            polygons=template.polygons,
            up_axis=template.metadata.up_axis,
            metres_per_unit=template.metadata.metres_per_unit,
            attributes=self._arrays[1:],
            standard_error_of=errors,
        )
        super().__init__(path, header, read)

    def _open_rows(self, name: str) -> contextlib.AbstractContextManager[Rows]:
        return open_rows(_path_of(name, self._positions))


def _load_faces(path: Path) -> Template:
    faces = load_array(path)
    check_faces(faces.dtype, faces.shape)
    return Template(faces, None, None, files=(path,))


def write_npy(path: Path, header: Header, frames: Iterable[Frame]) -> None:
    """Writes the arrays of a sequence beside one another."""
    np.save(_path_of("faces", path), header.faces)
    if header.has_standard_error:
        np.save(_path_of("standard_error_of", path), header.standard_error_of)
    write_rows({name: _path_of(name, path) for name in per_frame}, header, frames)


def _existing(path: Path, _: Header) -> list[Path]:
    arrays = (*per_frame, "faces", "standard_error_of")
    return [file for name in arrays if (file := _path_of(name, path)).exists()]


npy = Format(
    "npy",
    (".npy",),
    NpyFrames,
    write_npy,
    ARRAYS,
    frozenset({"faces"}),
    existing=_existing,
)
