"""What an OBJ file holds beside positions and faces: texture coordinates, materials and so on.

dynmesh does not interpret it. A sequence of OBJ files keeps that of the file it came from.
"""

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..polygons import Polygons
from ..sequence import Positions
from .comments import Metadata, metadata_in
from .derivatives import Normals

_KINDS = {
    b"vt": "texture coordinates",
    b"vn": "normals",
    b"usemtl": "materials",
    b"g": "groups",
    b"o": "groups",
}


def held_by_obj(file: Path) -> set[str]:
    """Returns what a file holds that is not read, in words."""
    lines = [line.split() for line in _lines(file)]
    found = {_KINDS[words[0]] for words in lines if words and words[0] in _KINDS}
    if any(words and words[0] == b"v" and len(words) == 7 for words in lines):
        found.add("colours")
    return found


class ObjSurroundings:
    """A file that is written again with other positions, and the normals that follow from them."""

    def __init__(self, file: Path, folder: Path) -> None:
        """Reads a file; those of materials are named relative to `folder`."""
        self._parts: list[bytes | tuple[bytes, int, int]] = []
        """Bytes that stay, and lines that are written anew: their keyword, from and to."""
        self._after: list[bytes] = []
        """What follows the position of each vertex, such as its colour."""
        self._given: list[bytes] = []
        """The normals of the file."""
        sizes: list[int] = []
        corners: list[int] = []
        shared: list[int] = []
        for line in _lines(file):
            words = line.split()
            keyword = words[0] if words else b""
            if keyword == b"v":
                self._renew(keyword, len(self._after))
                self._after.append(b" ".join([b"", *words[4:]]))
            elif keyword == b"vn":
                self._renew(keyword, len(self._given))
                self._given.append(line)
            elif keyword == b"mtllib":
                rest = os.fsdecode(line.split(None, 1)[1].strip()) if words[1:] else ""
                # Several names, or one with spaces.
                names = [rest] if (file.parent / rest).is_file() else rest.split()
                found = (os.path.relpath(file.parent / name, folder) for name in names)
                self._parts.append(b"mtllib %s\n" % b" ".join(map(os.fsencode, found)))
            elif not _is_written_anew(line):
                self._parts.append(line)
            if keyword == b"f":
                references = [word.split(b"/") for word in words[1:]]
                if all(len(parts) == 3 for parts in references):
                    sizes.append(len(references))
                    corners += [_counted(parts[0], len(self._after)) for parts in references]
                    shared += [_counted(parts[2], len(self._given)) for parts in references]
        self._normals = None
        if sizes:
            polygons = Polygons(np.array(sizes), np.array(corners))
            self._normals = Normals(polygons, "vertex", np.array(shared))

    def _renew(self, keyword: bytes, number: int) -> None:
        last = self._parts[-1] if self._parts else b""
        if isinstance(last, tuple) and last[0] == keyword:
            self._parts[-1] = keyword, last[1], number + 1
        else:
            self._parts.append((keyword, number, number + 1))

    def lines(self, points: Positions) -> Iterator[bytes]:
        """Yields the file with these positions, (k, 3)."""
        normals = self._given.copy()
        if self._normals is not None:
            for number, normal in enumerate(self._normals.of(points).tolist()):
                if any(normal):  # as no face says which it is
                    normals[number] = "vn {:.6g} {:.6g} {:.6g}\n".format(*normal).encode()
        for part in self._parts:
            if isinstance(part, bytes):
                yield part
                continue
            keyword, begin, end = part
            if keyword == b"vn":
                yield from normals[begin:end]
                continue
            for place, after in zip(
                points[begin:end].tolist(), self._after[begin:end], strict=True
            ):
                # The digits of `repr` read back the same double.
                yield "v {!r} {!r} {!r}".format(*place).encode() + after + b"\n"


def _lines(file: Path) -> list[bytes]:
    """The lines of a file; those that continue the line before are joined to it."""
    content = file.read_bytes().replace(b"\r\n", b"\n").replace(b"\\\n", b" ")
    return [line + b"\n" for line in content.splitlines()]


def _counted(number: bytes, so_far: int) -> int:
    """Counted from 0; the file counts from 1, or backwards from the last so far."""
    return int(number) - 1 if int(number) > 0 else so_far + int(number)


def _is_written_anew(line: bytes) -> bool:
    """Whether it is a comment that the writer makes itself."""
    comment = line.lstrip(b"# ").decode("utf-8", "replace")
    return line.startswith(b"#") and metadata_in([comment]) != Metadata()
