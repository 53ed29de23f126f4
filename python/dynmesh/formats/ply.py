"""PLY: one binary or text file per frame, as scanners and MeshLab write them.

The vertices have x, y and z and, if the sequence has them, the properties `known`, `generation`,
`age` and `standard_error`. Other properties of one number are kept where the input is PLY too, but
not normals, which follow from the positions. Comments state the up axis and the length of a unit.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Integers, Positions
from .._core import parse_ply
from .._errors import InputError
from ..frame import Frame, Frames
from ..header import ATTRIBUTES, Attribute, Header, with_all_needed
from ..polygons import Polygons, as_polygons
from .format import ARRAYS, Format, not_written
from .frame_files import IN_FILES, FilePerFrame, Loaded, mesh_file_of, write_frames
from .text import comments_of, metadata_in

corner_lists = ("vertex_indices", "vertex_index")

_STORED = {"b": "u1", "i": "i4", "f": "f4"}
"""How attributes are written, by the kind of their dtype."""

_NAMES = {
    "i1": "char",
    "u1": "uchar",
    "i2": "short",
    "u2": "ushort",
    "i4": "int",
    "u4": "uint",
    "f4": "float",
    "f8": "double",
}

Columns = dict[str, NDArray[Any] | tuple[NDArray[np.int64], NDArray[Any]]]
"""The n records of an element, by the name of the property: (n,) numbers; or, of a list, (n,)
lengths, and the numbers of one list after another."""


class PlyFrames(FilePerFrame):
    """A sequence in PLY files."""

    suffix = ".ply"

    def _load(self, file: Path) -> Loaded:
        elements, comments = read_elements(file)
        own = {"vertex": {*"xyz", *ATTRIBUTES}, "face": set(corner_lists)}
        further = {
            f"{name}.{column}"
            for name, columns in elements.items()
            for column in columns.keys() - own.get(name, set())
        }
        polygons = _polygons(elements.get("face", {}))
        return Loaded(_frame(elements["vertex"]), polygons, metadata_in(comments), further)


def read_elements(file: Path) -> tuple[dict[str, Columns], list[str]]:
    """Reads all elements of a file, of which one is "vertex", and the comments of its header."""
    elements, comments = parse_ply(file.read_bytes())
    if "vertex" not in elements:
        raise InputError("has no vertices")
    return elements, comments


def coordinates(vertices: Columns, axes: tuple[str, str, str]) -> Positions:
    """Returns the (k, 3) values of three properties of the vertices, float or double."""
    return np.stack([_floats(vertices, axis) for axis in axes], axis=1)


def _frame(vertices: Columns) -> Frame:
    points = coordinates(vertices, ("x", "y", "z"))
    rows = [ATTRIBUTES[name] for name in with_all_needed(vertices)]
    attributes: dict[str, Any] = {row.name: _attribute(vertices, row) for row in rows}
    return Frame(points, **attributes)


def _attribute(vertices: Columns, row: Attribute) -> NDArray[Any]:
    if row.dtype.kind == "f":
        return _floats(vertices, row.name)
    if row.dtype.kind == "i":
        return _integers(vertices, row.name, row.dtype)
    column = vertices[row.name]
    if not isinstance(column, np.ndarray):
        raise InputError(f"its property '{row.name}' must be numbers")
    return column


def _floats(vertices: Columns, name: str) -> NDArray[np.floating[Any]]:
    column = vertices.get(name)
    if not isinstance(column, np.ndarray) or column.dtype.kind != "f":
        raise InputError(f"its vertices need a property '{name}', float or double")
    return column


def _integers(vertices: Columns, name: str, dtype: np.dtype[Any]) -> Integers:
    column = vertices[name]
    if not isinstance(column, np.ndarray) or not np.can_cast(column.dtype, dtype):
        raise InputError(f"its property '{name}' must be integers that fit in {dtype}")
    return column.astype(dtype)


def _polygons(faces: Columns) -> Polygons:
    lists = [faces[name] for name in corner_lists if name in faces]
    if not lists:
        if faces:
            raise InputError(f"its faces need a list '{corner_lists[0]}'")
        return Polygons(np.empty(0, np.int64), np.empty(0, np.int64))
    if not isinstance(lists[0], tuple) or lists[0][1].dtype.kind == "f":
        raise InputError("the corners of its faces must be a list of integers")
    sizes, corners = lists[0]
    return Polygons(sizes, corners.astype(np.int64))


def write_ply(path: Path, header: Header, frames: Frames) -> list[str]:
    """Writes a sequence of PLY files, binary and little-endian."""
    source = mesh_file_of(frames, ".ply")
    further = {} if source is None else _further(read_elements(source)[0])
    kinds = dict.fromkeys("xyz", header.dtype.str[1:])
    kinds |= {name: _STORED[ATTRIBUTES[name].dtype.kind] for name in header.attributes}
    kinds |= {name: column.dtype.str[1:] for name, column in further.items()}
    columns = [(name, np.dtype(f"<{kind}")) for name, kind in kinds.items()]
    vertices = np.zeros(header.n_vertices, columns)
    for name, column in further.items():
        vertices[name] = column
    # The bytes before and after the vertices are the same in every frame.
    sizes, corners = as_polygons(header.faces, header.polygons)
    count = "u1" if sizes.max(initial=0) < 256 else "i4"
    before = ply_header(
        comments_of(header),
        header.n_vertices,
        {name: _NAMES[kind] for name, kind in kinds.items()},
        f"element face {len(sizes)}",
        f"property list {_NAMES[count]} int {corner_lists[0]}",
    )
    numbers = corners.astype("<i4").view(f"<{count}")
    begins = (np.cumsum(sizes) - sizes) * (4 // np.dtype(count).itemsize)
    after = np.insert(numbers, begins, sizes.astype(count)).tobytes()

    def save(file: Path, frame: Frame) -> None:
        for i, axis in enumerate("xyz"):
            vertices[axis] = frame.points[:, i]
        for name in header.attributes:
            vertices[name] = getattr(frame, name)
        file.write_bytes(before + vertices.tobytes() + after)

    held = {f"vertex.{name}" for name in further}
    return [*write_frames(path, header, frames, save), *not_written(frames, held)]


def _further(elements: dict[str, Columns]) -> dict[str, NDArray[Any]]:
    """The properties of vertices that files keep beside those of dynmesh, in their order."""
    own = {*"xyz", *ATTRIBUTES, "nx", "ny", "nz"}
    vertices = elements["vertex"].items()
    return {
        name: column
        for name, column in vertices
        if name not in own and isinstance(column, np.ndarray)
    }


def ply_header(
    comments: Iterable[str], n_vertices: int, kinds: Mapping[str, str], *faces: str
) -> bytes:
    """Returns the header of a file whose vertices have properties of these kinds, by name."""
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {line}" for line in comments),
        f"element vertex {n_vertices}",
        *(f"property {kind} {name}" for name, kind in kinds.items()),
        *faces,
        "end_header\n",
    ]
    return "\n".join(lines).encode("ascii")


ply = Format(
    "ply",
    (".ply",),
    PlyFrames,
    write_ply,
    ARRAYS | IN_FILES,
    frozenset({"faces", "gaps"}),
)
