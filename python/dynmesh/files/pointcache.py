"""Point caches, PC2 and MDD: a short header, then the positions of every frame as float32.

They hold neither faces nor masks nor provenance. The faces, the up axis and the unit come from a
mesh beside the file, `NAME.obj` or `NAME.ply`, to which an animation program applies the cache;
the writer writes frame 0 as `NAME.obj`. Unknown positions are written as NaN, and float64 is
rounded.
"""

import contextlib
from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import IO, ClassVar

import numpy as np

from ..frames.frame import Frame
from ..frames.header import Header
from ..frames.naming import naming
from ..frames.reader import Reader
from ..polygons import as_polygons
from .flat import FlatRows
from .format import Template, template_of
from .frame_names import FrameNames, single
from .obj import ObjReader, ObjWriter
from .ply import PlyReader
from .rows import FlatWriter
from .template import find_template

largest_count = 2**31 - 1

_MESHES = {".obj": ObjReader, ".ply": PlyReader}
"""What reads the mesh beside a file; the preferred kind comes first."""


class PointCacheReader(Reader):
    """A sequence in a point cache.

    Attributes:
        dtype_in_file: float32 in the byte order of the format.
    """

    dtype_in_file: ClassVar[np.dtype[np.float32]]

    def __init__(self, path: Path, template: Template | None) -> None:
        """Opens the file and finds its faces."""
        with path.open("rb") as file, contextlib.ExitStack() as stack:
            shape, begin = self._read_shape(file)
            self._rows = FlatRows(path, begin, shape, self.dtype_in_file)
            stack.callback(self._rows.close)
            n_frames, n_vertices, _ = shape
            beside = dict.fromkeys(map(path.with_suffix, _MESHES), _mesh)
            template = find_template(template, n_vertices, beside)
            self._files = [path, *template.files]
            fps, start = self._read_timing(file, n_frames)
            header = Header(
                faces=template.faces,
                n_frames=n_frames,
                n_vertices=n_vertices,
                dtype=np.dtype(np.float32),
                fps=fps,
                polygons=template.polygons,
                **template.metadata._asdict(),
                start=start,
            )
            super().__init__(path, header)
            stack.pop_all()  # the rows stay open

    @abstractmethod
    def _read_shape(self, file: IO[bytes]) -> tuple[tuple[int, int, int], int]:
        """Returns (n, k, 3), unchecked, and the number of bytes before the first frame."""

    @abstractmethod
    def _read_timing(self, file: IO[bytes], n_frames: int) -> tuple[float | None, float]:
        """Returns the frames per second, if stored, and the number of the first frame.

        `file` is positioned after the shape.
        """

    @property
    def files(self) -> list[Path]:
        """The files that are read."""
        return self._files

    def _frames(self, numbers: range) -> Iterator[Frame]:
        for number in numbers:
            yield Frame(self._rows.read(number))

    def close(self) -> None:
        """Closes the file."""
        self._rows.close()


def _mesh(path: Path) -> Template:
    """Reads a mesh beside the file."""
    with _MESHES[path.suffix](path) as reader:
        return template_of(reader)


class PointCacheWriter(FlatWriter):
    """A point cache that is being written, and the mesh beside it.

    An existing `NAME.obj` with the same faces is kept, since it may contain more, such as texture
    coordinates. It is replaced if it has other faces or states another up axis or another length of
    a unit.

    Attributes:
        dtype_in_file: float32 in the byte order of the format.
    """

    keeps_known = False
    keeps_provenance = False
    keeps_float64 = False
    dtype_in_file: ClassVar[np.dtype[np.float32]]

    @abstractmethod
    def _header_bytes(self) -> bytes:
        """Returns the header of the file."""

    def _begin(self, kept: int) -> None:
        super()._begin(kept)
        header = self.header
        for what, count in (("frames", header.n_frames), ("vertices", header.n_vertices)):
            if count > largest_count:
                raise ValueError(f"can hold at most {largest_count} {what}, not {count}")
        self._mesh_writer: ObjWriter | None = None
        mesh = self.path.with_suffix(".obj")
        if kept == 0 and not (mesh.exists() and self._fits(mesh)):
            own = self.folder / mesh.name
            single = replace(
                header, n_frames=1, times=None, dtype=np.dtype(np.float32), has_known=False
            )
            self._mesh_writer = ObjWriter(own, single, folder=self.folder / "mesh")
        row_size = header.n_vertices * 3 * self.dtype_in_file.itemsize
        path = self.folder / self.path.name
        self._open_rows("vertices", path, self._header_bytes(), row_size, kept)

    @classmethod
    def names(cls, path: Path) -> list[FrameNames]:
        """Returns the names of the cache and of the mesh beside it."""
        return [single(path), single(path.with_suffix(".obj"))]

    def _fits(self, path: Path) -> bool:
        header = self.header
        with naming(Path(path.name)):
            mesh = _mesh(path)
        there, wanted = (as_polygons(m.faces, m.polygons) for m in (mesh, header))
        return (
            mesh.n_vertices == header.n_vertices
            and all(map(np.array_equal, there, wanted))
            and mesh.metadata.up_axis in (None, header.up_axis)
            and mesh.metadata.metres_per_unit in (None, header.metres_per_unit)
        )

    def _append(self, frame: Frame) -> None:
        if self._frame == 0 and self._mesh_writer is not None:
            with self._mesh_writer:
                self._mesh_writer.append(frame.points)
            self._add_written(self._mesh_writer.path)
        self._add_row("vertices", frame.points.astype(self.dtype_in_file, copy=False))
