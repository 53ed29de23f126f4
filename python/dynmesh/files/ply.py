"""PLY: one binary or text file per frame, as scanners and MeshLab write them.

The vertices have x, y and z and, where a sequence has them, the properties `known`, `generation`
and `age`. Other properties are not read.
"""

import contextlib
import io
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._extras import require
from ..polygons import Polygons, as_polygons
from .frame_files import FramesReader, FramesWriter
from .interface import Format, Frame, Template, refuse_mesh_name, refuse_template
from .numbered import find_files

corner_lists = ("vertex_indices", "vertex_index")


class PlyReader(FramesReader):
    """A sequence in PLY files."""

    def __init__(self, path: Path, template: Template | None, prim: str | None) -> None:
        """Finds the files and reads the first."""
        refuse_template(template)
        refuse_mesh_name(prim)
        self._corners = 3
        super().__init__(path, find_files(path, ".ply"))

    def _load(self, file: Path) -> tuple[Frame, Polygons]:
        plyfile = require("plyfile", extra="mesh")
        with _explaining(plyfile):
            data = self._read(plyfile, file)
        elements = {element.name: element for element in data.elements}
        if "vertex" not in elements:
            raise ValueError("has no vertices")
        frame = _frame(elements["vertex"].data)
        polygons = _polygons(plyfile, elements.get("face"))
        if len(polygons.sizes):
            self._corners = int(polygons.sizes[0])
        return frame, polygons

    def _read(self, plyfile: Any, file: Path) -> Any:
        """Is quick where all faces have as many corners as the first of the file before."""
        lengths = {"face": dict.fromkeys(corner_lists, self._corners)}
        with file.open("rb") as binary, warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of faces without corners
            is_text = re.search(rb"[\r\n]format ascii", binary.read(4096)) is not None
            binary.seek(0)
            stream: Any = io.TextIOWrapper(binary, "ascii") if is_text else binary
            try:
                data = plyfile.PlyData.read(stream, known_list_len=lengths)
            except plyfile.PlyElementParseError:
                if is_text:
                    raise
                stream.seek(0)
                data = plyfile.PlyData.read(stream)
            if stream.read().strip():
                raise ValueError("goes on after the last element that its header announces")
        return data


def _frame(vertices: NDArray[Any]) -> Frame:
    kinds = {name: vertices.dtype[name] for name in vertices.dtype.names or ()}
    for axis in "xyz":
        if axis not in kinds or kinds[axis].kind != "f":
            raise ValueError(f"its vertices need a property '{axis}', float or double")
    points = np.stack([vertices[axis] for axis in "xyz"], axis=1)
    known = generation = age = None
    if "known" in kinds:
        if kinds["known"].kind not in "iu" or not np.isin(vertices["known"], (0, 1)).all():
            raise ValueError("its property 'known' must be uchar, 0 or 1")
        known = np.array(vertices["known"], np.bool_)
    if "generation" in kinds and "age" in kinds:
        for name in ("generation", "age"):
            if not np.can_cast(kinds[name], np.int32) or kinds[name].kind not in "iu":
                raise ValueError(f"its property '{name}' must be int")
        generation, age = (np.array(vertices[name], np.int32) for name in ("generation", "age"))
    return Frame(points.astype(points.dtype.newbyteorder("=")), known, generation, age)


def _polygons(plyfile: Any, faces: Any) -> Polygons:
    names = [] if faces is None else [name for name in corner_lists if name in faces]
    if not names:
        if faces is not None and len(faces):
            raise ValueError(f"its faces need a list '{corner_lists[0]}'")
        return Polygons(np.empty(0, np.int64), np.empty(0, np.int64))
    kind = faces.ply_property(names[0])
    if not isinstance(kind, plyfile.PlyListProperty) or "f" in kind.val_dtype:
        raise ValueError(f"'{kind}' must be a list of integers")
    lists = faces[names[0]]
    if lists.dtype.kind == "O":  # one array per face
        corners = np.concatenate([np.empty(0, np.int64), *lists])
        return Polygons(np.array([len(one) for one in lists], np.int64), corners)
    sizes = np.full(len(lists), lists.shape[1], np.int64)
    return Polygons(sizes, np.array(lists, np.int64).reshape(-1))


class PlyWriter(FramesWriter):
    """A sequence of PLY files in the making, binary and little-endian."""

    suffix = ".ply"

    def _begin(self, kept: int) -> None:
        super()._begin(kept)
        plyfile = require("plyfile", extra="mesh")
        header = self.header
        columns = [(axis, f"<f{header.dtype.itemsize}") for axis in "xyz"]
        if header.has_known:
            columns.append(("known", "u1"))
        if header.has_provenance:
            columns += [("generation", "<i4"), ("age", "<i4")]
        self._vertices = np.zeros(header.n_vertices, columns)
        sizes, corners = as_polygons(header.faces, header.polygons)
        faces = np.empty(len(sizes), [(corner_lists[0], object)])
        for face, one in zip(faces, np.split(corners, np.cumsum(sizes)[:-1]), strict=True):
            face[0] = one
        elements = [
            plyfile.PlyElement.describe(self._vertices, "vertex"),
            plyfile.PlyElement.describe(
                faces,
                "face",
                len_types={corner_lists[0]: "u1" if sizes.max() < 256 else "i4"},
                val_types={corner_lists[0]: "i4"},
            ),
        ]
        file = io.BytesIO()
        plyfile.PlyData(elements, byte_order="<").write(file)
        # What stands before and after the vertices is the same in every frame.
        before, end, after = file.getvalue().partition(b"end_header\n")
        self._before, self._after = before + end, after[self._vertices.nbytes :]

    def _save(self, file: Path, frame: Frame) -> None:
        for i, axis in enumerate("xyz"):
            self._vertices[axis] = frame.points[:, i]
        for name in self._vertices.dtype.names[3:]:  # type: ignore[index]
            self._vertices[name] = getattr(frame, name)
        file.write_bytes(self._before + self._vertices.tobytes() + self._after)


@contextlib.contextmanager
def _explaining(plyfile: Any) -> Iterator[None]:
    try:
        yield
    except (plyfile.PlyParseError, OverflowError, UnicodeDecodeError) as error:
        raise ValueError(f"is damaged or no PLY file: {error}") from error
    except MemoryError as error:
        raise ValueError("is damaged: its header announces more than there can be") from error


ply = Format("ply", (".ply",), "Stanford's polygon files, one per frame", PlyReader, PlyWriter)
