"""OBJ: one text file per frame, as modelling programs exchange them.

Positions and faces are read; texture coordinates, normals, colours, groups and materials are
ignored. Comments at the beginning state the up axis and the length of a unit.
"""

import io
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from .._core import plain_obj
from ..polygons import Polygons, as_polygons
from .comments import Metadata, comments_of, metadata_in
from .format import Format
from .frame_files import FramesWriter, NumberedReader
from .header import Frame


class ObjReader(NumberedReader):
    """A sequence in OBJ files."""

    suffix = ".obj"

    def _load(self, file: Path) -> tuple[Frame, Polygons, Metadata]:
        data = file.read_bytes()
        plain = plain_obj(data)
        if plain is None:
            frame, polygons = line_by_line(data)
        else:
            points, sizes, corners = plain
            frame, polygons = Frame(points), Polygons(sizes, corners)
        return frame, polygons, metadata_in(_first_comments(data))


def _first_comments(data: bytes) -> Iterator[str]:
    """Yields the comments before anything else."""
    for line in map(str.strip, io.TextIOWrapper(io.BytesIO(data), encoding="latin-1")):
        if line and not line.startswith("#"):
            break
        yield line.removeprefix("#")


def line_by_line(data: bytes) -> tuple[Frame, Polygons]:
    """Parses any valid OBJ text; slower than the reader in C++.

    Raises:
        ValueError: the text is invalid; the message names the line and the problem.
    """
    points: list[list[float]] = []
    sizes: list[int] = []
    corners: list[int] = []
    largest, at_line = -1, 0
    for line, (keyword, *values) in _statements(data):
        try:
            if keyword == "v":
                points.append(_position(values))
            elif keyword == "f":
                if len(values) < 3:
                    raise ValueError(f"a face has {len(values)} corners, but needs 3")
                sizes.append(len(values))
                vertices = [_vertex(value, len(points)) for value in values]
                if max(vertices) > largest:
                    largest, at_line = max(vertices), line
                corners += vertices
        except ValueError as error:
            raise ValueError(f"line {line}: {error}") from error
    if largest >= len(points):
        raise ValueError(f"line {at_line}: there is no vertex {largest + 1}, only {len(points)}")
    polygons = Polygons(np.array(sizes, np.int64), np.array(corners, np.int64))
    return Frame(np.array(points, np.float64).reshape(-1, 3)), polygons


def _statements(data: bytes) -> Iterator[tuple[int, list[str]]]:
    """Yields the words of each line that is not empty, with its number."""
    statement = ""
    lines = io.TextIOWrapper(io.BytesIO(data), encoding="latin-1")  # names may be in any encoding
    for number, line in enumerate(lines, start=1):
        statement += line.partition("#")[0].rstrip()
        if statement.endswith("\\"):
            statement = f"{statement[:-1]} "
        elif statement:
            yield number, statement.split()
            statement = ""
    if statement:
        raise ValueError("ends in the middle of a line")


def _position(values: list[str]) -> list[float]:
    if len(values) not in (3, 4, 6, 7):  # colours may follow
        raise ValueError(f"a vertex has 3 coordinates, not {len(values)}")
    if len(values) == 4 and float(values[3]) != 1:
        raise ValueError(f"a vertex has a weight of 1, not {values[3]}")
    return [float(value) for value in values[:3]]


def _vertex(value: str, n_before: int) -> int:
    """Returns the vertex of a corner, counted from 0; negative numbers count from the last."""
    number = int(value.partition("/")[0])
    vertex = number - 1 if number > 0 else n_before + number
    if number == 0 or vertex < 0:
        raise ValueError(f"there is no vertex {number}, with {n_before} before this line")
    return vertex


class ObjWriter(FramesWriter):
    """A sequence of OBJ files that is being written. Unknown vertices are written as NaN."""

    suffix = ".obj"
    keeps_known = False
    keeps_provenance = False

    def _begin(self, kept: int) -> None:
        super()._begin(kept)
        sizes, corners = as_polygons(self.header.faces, self.header.polygons)
        faces = np.split(corners + 1, np.cumsum(sizes)[:-1])
        self._comments = "".join(f"# {line}\n" for line in comments_of(self.header))
        self._faces = "".join(f"f {' '.join(map(str, face))}\n" for face in faces)

    def _save(self, file: Path, frame: Frame) -> None:
        numbers = iter(
            map(repr, frame.points.ravel().tolist())
        )  # digits that read back the same double
        with file.open("w", encoding="ascii", newline="\n") as lines:
            lines.write(self._comments)
            lines.writelines(
                f"v {x} {y} {z}\n" for x, y, z in zip(numbers, numbers, numbers, strict=True)
            )
            lines.write(self._faces)


obj = Format(
    "obj",
    (".obj",),
    "Wavefront's text files, one per frame",
    ObjReader,
    ObjWriter,
    reader_with_gaps=partial(ObjReader, gaps="lost"),
)
