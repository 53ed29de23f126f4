"""OBJ: one text file per frame, as modelling programs exchange them.

Positions and faces are read. Texture coordinates, colours, groups and materials, which dynmesh does
not interpret, are kept where the input is OBJ too; normals are not, as they follow from the
positions. Comments at the beginning state the up axis and the length of a unit.
"""

import os
import re
from pathlib import Path

import numpy as np

from .._core import parse_obj
from ..polygons import Polygons, as_polygons
from .format import Format
from .frame import Frame
from .frame_files import FramesReader, FramesWriter
from .header import Metadata, comments_of, metadata_in
from .new_output import seen_from

_KINDS = {
    b"vt": "texture coordinates",
    b"vn": "normals",
    b"usemtl": "materials",
    b"g": "groups",
    b"o": "groups",
}


class ObjReader(FramesReader):
    """A sequence in OBJ files."""

    suffix = ".obj"

    def _load(self, file: Path) -> tuple[Frame, Polygons, Metadata]:
        points, sizes, corners, comments = parse_obj(file.read_bytes())
        return Frame(points), Polygons(sizes, corners), metadata_in(comments)

    def _held_beside(self, file: Path) -> set[str]:
        lines = [words for line in _lines(file) if (words := line.split())]
        found = {_KINDS[words[0]] for words in lines if words[0] in _KINDS}
        if any(words[0] == b"v" and len(words) == 7 for words in lines):
            found.add("colours")
        return found


class ObjWriter(FramesWriter):
    """A sequence of OBJ files that is being written. Unknown vertices are written as NaN."""

    suffix = ".obj"
    keeps_known = False
    keeps_provenance = False
    keeps_texture = True

    def _begin(self) -> None:
        super()._begin()
        if self.mesh_file is not None:
            self._before, self._after = _around(self.mesh_file, self._names.folder)
            self._lost &= {"normals"}
        else:
            sizes, corners = as_polygons(self.header.faces, self.header.polygons)
            names, texture = (corners + 1).astype(str).astype(object), self.header.texture
            lines = ["\n"]
            if texture is not None:
                places, own = np.unique(texture, axis=0, return_inverse=True)
                lines += [f"vt {u!r} {v!r}\n" for u, v in places.tolist()]
                names += "/" + (own.reshape(-1) + 1).astype(str).astype(object)
            faces = np.split(names, np.cumsum(sizes)[:-1])
            self._before = ["", *["\n"] * (self.header.n_vertices - 1)]
            self._after = "".join([*lines, *(f"f {' '.join(face)}\n" for face in faces)])
        comments = "".join(f"# {line}\n" for line in comments_of(self.header))
        self._before[0] = comments + self._before[0]

    def _save(self, file: Path, frame: Frame) -> None:
        with file.open("w", encoding="latin-1", newline="") as lines:
            lines.writelines(
                f"{before}v {x!r} {y!r} {z!r}"  # whose digits read back the same double
                for before, (x, y, z) in zip(self._before, frame.points.tolist(), strict=True)
            )
            lines.write(self._after)


def _around(file: Path, folder: Path) -> tuple[list[str], str]:
    """Returns what stands before each vertex of a file, and what follows the last.

    Normals are left out, and files of materials are named as seen from another folder.
    """
    before: list[str] = []
    text: list[bytes] = []
    for line in _lines(file):
        keyword, *words = line.split() or [b""]
        if keyword == b"v":
            before.append(b"".join(text).decode("latin-1"))
            text = [b" ".join([b"", *words[3:]]), b"\n"]  # such as its colour
        elif keyword == b"f":
            corners = (b"/".join(filter(None, word.split(b"/")[:2])) for word in words)
            text += [b" ".join([keyword, *corners]), b"\n"]
        elif keyword == b"mtllib" and words:
            rest = line.split(None, 1)[1].strip()
            # Several names, or one with spaces.
            names = [rest] if (file.parent / os.fsdecode(rest)).is_file() else words
            paths = [seen_from(folder, file.parent / os.fsdecode(name)) for name in names]
            text.append(b"mtllib %s\n" % b" ".join(map(os.fsencode, paths)))
        elif keyword != b"vn" and not _states_metadata(line):
            text += [line, b"\n"]
    return before, b"".join(text).decode("latin-1")


def _lines(file: Path) -> list[bytes]:
    """The lines of a file; those that continue the line before are joined to it."""
    content = file.read_bytes().removeprefix(b"\xef\xbb\xbf")
    content = re.sub(rb"\r\n?", b"\n", content)
    # A comment that ends in a backslash is not continued.
    continued = rb"\\(?:[ \t\v\f]+#.*|[ \t\v\f]*)\n|((?:^|(?<=[ \t\v\f]))#.*)"
    return re.sub(continued, lambda found: found[1] or b" ", content, flags=re.M).splitlines()


def _states_metadata(line: bytes) -> bool:
    """Whether it is a comment that the writer makes itself."""
    comment = line.lstrip(b"# ").decode("latin-1")
    return line.startswith(b"#") and metadata_in([comment]) != Metadata()


obj = Format("obj", (".obj",), ObjReader, ObjWriter, frozenset({"faces", "gaps"}))
