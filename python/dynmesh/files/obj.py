"""OBJ: one text file per frame, as modelling programs exchange them.

Positions and faces are read. Texture coordinates, colours, groups and materials are kept where the
input is OBJ too, and normals follow from the positions. Comments at the beginning state the up axis
and the length of a unit.
"""

from pathlib import Path

import numpy as np

from .._core import parse_obj
from ..frames.frame import Frame
from ..polygons import Polygons, as_polygons
from .comments import Metadata, comments_of, metadata_in
from .format import Format
from .frame_files import FramesWriter, NumberedReader
from .obj_surroundings import ObjSurroundings, held_by_obj


class ObjReader(NumberedReader):
    """A sequence in OBJ files."""

    suffix = ".obj"

    def _load(self, file: Path) -> tuple[Frame, Polygons, Metadata]:
        points, sizes, corners, comments = parse_obj(file.read_bytes())
        return Frame(points), Polygons(sizes, corners), metadata_in(comments)

    def _held_beside(self, file: Path) -> set[str]:
        return held_by_obj(file)


class ObjWriter(FramesWriter):
    """A sequence of OBJ files that is being written. Unknown vertices are written as NaN."""

    suffix = ".obj"
    keeps_known = False
    keeps_provenance = False
    keeps_mesh_of = ".obj"

    def _begin(self, kept: int) -> None:
        super()._begin(kept)
        self._comments = "".join(f"# {line}\n" for line in comments_of(self.header))
        self._around = None
        if self.mesh_file is not None:
            self._around = ObjSurroundings(self.mesh_file, self._names.folder)
            return
        sizes, corners = as_polygons(self.header.faces, self.header.polygons)
        faces = np.split(corners + 1, np.cumsum(sizes)[:-1])
        self._faces = "".join(f"f {' '.join(map(str, face))}\n" for face in faces)

    def _save(self, file: Path, frame: Frame) -> None:
        if self._around is not None:
            with file.open("wb") as lines:
                lines.write(self._comments.encode())
                lines.writelines(self._around.lines(frame.points))
            return
        with file.open("w", encoding="ascii", newline="\n") as lines:
            lines.write(self._comments)
            # The digits of `repr` read back the same double.
            lines.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in frame.points.tolist())
            lines.write(self._faces)


obj = Format(
    "obj",
    (".obj",),
    "Wavefront's text files, one per frame",
    ObjReader,
    ObjWriter,
    per_frame=True,
)
