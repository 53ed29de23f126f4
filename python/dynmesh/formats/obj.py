"""OBJ: one text file per frame, as modelling programs exchange them.

Positions and faces are read. Texture coordinates, colours, groups and materials, which dynmesh does
not interpret, are kept where the input is OBJ too; normals are not, as they follow from the
positions. Comments at the beginning state the up axis and the length of a unit.
"""

import os
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .._core import parse_obj
from ..frame import Frame, Frames
from ..header import TEXTURE, Header
from ..polygons import Polygons, as_polygons
from .format import Format, not_written
from .frame_files import IN_FILES, FilePerFrame, Loaded, mesh_file_of, write_frames
from .output import destination_of, seen_from
from .text import Metadata, comments_of, metadata_in

_KINDS = {
    "vt": TEXTURE,
    "vn": "normals",
    "usemtl": "materials",
    "g": "groups",
    "o": "groups",
}


class ObjFrames(FilePerFrame):
    """A sequence in OBJ files."""

    suffix = ".obj"

    def _load(self, file: Path) -> Loaded:
        points, sizes, corners, comments, keywords, coloured = parse_obj(file.read_bytes())
        further = {_KINDS[word] for word in keywords} | ({"colours"} if coloured else set())
        return Loaded(Frame(points), Polygons(sizes, corners), metadata_in(comments), further)


def write_obj(path: Path, header: Header, frames: Frames) -> list[str]:
    """Writes a sequence of OBJ files. Unknown vertices are written as NaN."""
    source = mesh_file_of(frames, ".obj")
    if source is not None:
        before, after = _around(source, destination_of(path).parent)
        held = {*frames.origin.holds} - {"normals"} if frames.origin else set()
    else:
        before, after = ["", *["\n"] * (header.n_vertices - 1)], _faces_of(header, frames.texture)
        held = set() if frames.texture is None else {TEXTURE}
    comments = "".join(f"# {line}\n" for line in comments_of(header))
    before[0] = comments + before[0]

    def save(file: Path, frame: Frame) -> None:
        with file.open("w", encoding="latin-1", newline="") as lines:
            lines.writelines(
                f"{text}v {x!r} {y!r} {z!r}"  # whose digits read back the same double
                for text, (x, y, z) in zip(before, frame.points.tolist(), strict=True)
            )
            lines.write(after)

    return [*write_frames(path, header, frames, save), *not_written(frames, held)]


def _faces_of(header: Header, texture: NDArray[np.float32] | None) -> str:
    sizes, corners = as_polygons(header.faces, header.polygons)
    names, lines = (corners + 1).astype(str).astype(object), ["\n"]
    if texture is not None:
        places, own = np.unique(texture, axis=0, return_inverse=True)
        lines += [f"vt {u!r} {v!r}\n" for u, v in places.tolist()]
        names += "/" + (own.reshape(-1) + 1).astype(str).astype(object)
    faces = np.split(names, np.cumsum(sizes)[:-1])
    return "".join([*lines, *(f"f {' '.join(face)}\n" for face in faces)])


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


obj = Format(
    "obj",
    (".obj",),
    ObjFrames,
    write_obj,
    frozenset({"texture", "float64"}) | IN_FILES,
    frozenset({"faces", "gaps"}),
)
