"""`.npy`: positions as one numpy array (n, k, 3).

The other arrays are in separate files: `NAME.faces.npy` and, optionally, `NAME.known.npy`,
`NAME.generation.npy`, `NAME.age.npy`, `NAME.standard_error.npy` and, as a text, what the standard
errors are of, `NAME.standard_error_of.npy`. Frames per second, polygons, the up axis, the name of
the mesh, the unit and the number of the first frame cannot be stored.
"""

import contextlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from .._errors import naming
from ..frame import Frame
from ..header import ATTRIBUTES, Header, check_faces, check_needed, check_vertices
from .format import ARRAYS, Format, Template, find_template
from .rows import Rows, RowsFrames, load_array, open_rows, per_frame, write_rows


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
