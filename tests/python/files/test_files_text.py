"""OBJ and PLY: every variant, and damaged files."""

import re
import struct
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import to_file
from hypothesis import given
from hypothesis import strategies as st
from plain_files import FACE, POINTS, TRIANGLE, XYZ, ply, triangle
from sequences import assert_refused

import dynmesh
from dynmesh._core import parse_obj, parse_ply
from dynmesh.polygons import as_polygons


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no vertices"),
        ("v 1e400 0 0\n", "line 1: '1e400' cannot be read"),
        ("v 0 0 0 2\n", "line 1: a vertex has a weight that is not 1"),
        (TRIANGLE + "f 1 2 99999999999999999999\n", "line 5: there is no vertex 9"),
        (TRIANGLE + "vt 0 \\\nf 1 2 9\nf 1 2 4\n", "line 7: there is no vertex 4, only 3"),
        (TRIANGLE + "f 1 2 3.0\n", "line 5: '3.0' is not a corner"),
        (TRIANGLE + "f 1 2 \\", "line 5: continues after the end of the file"),
    ],
)
def test_damaged_obj_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.obj"
    path.write_text(text, "latin-1")
    assert_refused(path, message)


def stated(data: bytes) -> tuple[list[list[float]], list[list[int]]]:
    """Reads a valid OBJ a second time, as the format is described, without regard to speed."""
    text = data.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
    text = re.sub(r"(?m)(^|(?<=[ \t\v\f]))#.*$", "", text.removeprefix("\xef\xbb\xbf"))
    joined = re.sub(r"\\[ \t\v\f]*\n", " ", text)
    points: list[list[float]] = []
    faces: list[list[int]] = []
    for line in joined.split("\n"):
        keyword, *words = re.findall(r"[^ \t\v\f]+", line) or [""]
        if keyword == "v":
            points.append([float(word) for word in words[:3]])
        elif keyword == "f":
            numbers = [int(word.partition("/")[0]) for word in words]
            faces.append([n - 1 if n > 0 else len(points) + n for n in numbers])
    return points, faces


def check_as_stated(data: bytes) -> None:
    points, sizes, corners, *_ = parse_obj(data)
    expected, faces = stated(data)
    np.testing.assert_array_equal(points, np.reshape(expected, (-1, 3)))
    np.testing.assert_array_equal(sizes, [len(face) for face in faces])
    np.testing.assert_array_equal(corners, [*chain.from_iterable(faces)])


VARIANTS = [
    TRIANGLE.replace("\n", "\r"),
    "vt 0 0\n" + TRIANGLE.replace("f", "# in D:\\x\\\nf"),
    TRIANGLE.replace("v 0 1 0", "v +INF -infinity -NaN"),
    TRIANGLE.replace("1 2 3", "-3 -2//-2 -1/"),
    TRIANGLE.replace("v 1 0", "v\\ \r\n1 \\ # one\n0"),
    TRIANGLE.replace("f", "g a \\\nf 9 9 9\nf"),
    "f 3 2 1\n" + TRIANGLE,
    "# caf\xe9\r\nmtllib a.mtl\r\no body\r\nv 0 0 0 0.5 0.5 0.5\r\n  v\t1 0 0 1.0\r\n"
    "v nan NaN -nan # lost\r\nv 1e-3 \\\r\n 2 3\r\nvt 0 0\r\nvn 0 0 1\r\ng top\r\ns off\r\n"
    "usemtl red\r\nl 1 2\r\nf 1/1 2/1/1 3//1 -1\r\nf -4 -3 -2\r\nv 9 9 9\r\nf 5 -1 1\r\n",
]


@pytest.mark.parametrize("text", VARIANTS)
def test_every_variant_of_obj_is_read_and_written_again(tmp_path: Path, text: str) -> None:
    data = text.encode("latin-1")
    check_as_stated(data)
    (tmp_path / "a.obj").write_bytes(b"g all\n" + data)  # which is kept
    with dynmesh.open(tmp_path / "a.obj") as reader:
        (frame,) = reader
        dynmesh.write(tmp_path / "b.obj", to_file.frames_of(reader.header, [frame.points + 1]))
    points, *faces = parse_obj(data)[:3]
    found = parse_obj((tmp_path / "b.obj").read_bytes())[:3]
    for one, other in zip((points + 1, *faces), found, strict=True):
        np.testing.assert_array_equal(one, other)


LINES = ["v 1 2 3\n", "f 1 2 3\n", "f -1 -1 -2\n", "nan", "vt 0\n"]
obj_pieces = st.sampled_from([*"vf123 #/\\\t\r\n-+._e(\x0b\x1c\x85", *LINES])


@given(st.lists(obj_pieces, max_size=12).map("".join))
def test_any_obj_is_read_as_stated_or_refused(text: str) -> None:
    data = f"{TRIANGLE}{text}".encode("latin-1")
    refusal = ""
    try:
        parse_obj(data)
    except ValueError as error:
        refusal = str(error)
    if refusal:
        assert re.fullmatch(r"line \d+: [ -~]+", refusal)
    else:
        check_as_stated(data)


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"solid cube\n", "line 1"),
        (ply(f"vertex 2: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 2\n"), "line 12: .* 'face'"),
        (triangle(b"3 0 1 2\n" * 2), "line 14"),
        (ply(f"vertex 3: {XYZ}", POINTS.replace(b"1", b"1e39")), "line 9: '1e39'"),
        (triangle(b"3 0 1 3\n"), "face 0 refers to vertex 3"),
        (triangle(b"2 0 1\n"), "polygon 0 has 2 corners"),
        (ply(f"vertex 0: {XYZ}; face 0: {FACE}", b""), "has no vertices"),
        (ply(f"vertex {10**15}: {XYZ}; face 1: {FACE}", b""), f"record 0 of 'vertex', of {10**15}"),
        (ply(f"vertex {10**15}: {XYZ}", b"", format="binary_big_endian"), f"of {10**15}, needs"),
        (ply("vertex 1: quad x", b"1\n"), "line 4: .*'quad'"),
        (ply("vertex 1: float x, int x", b"1 1\n"), "line 5: .*'x'"),
        (ply("a 1: int x", b"1\n", format="binary"), "line 2: .*ascii"),
        (b"ply\ncomment\nend_header\n", "names no format"),
        (triangle(b"3 0 1 2\n").replace(b"uchar int", b"uchar float"), "corners .*integers"),
        (
            ply(
                f"vertex 3: {XYZ}, uchar known; face 1: {FACE}",
                b"0 0 0 1\n1 0 0 0\n0 1 0 2\n3 0 1 2\n",
            ),
            "known: .* vertex 2 has 2",
        ),
        (ply(f"vertex 1: {XYZ}, float generation, int age", b"0 0 0 1 1\n"), "'generation'"),
        (
            ply("a 2: list short char b", b"\1\0\7\xff\xff", format="binary_little_endian"),
            "record 1 of 'a', of 2, .* -1",
        ),
    ],
)
def test_damaged_ply_is_refused(tmp_path: Path, data: bytes, told: str) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(data)
    assert_refused(path, told)


TYPES = {
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
    "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
    "float": "f", "double": "d", "float32": "f", "float64": "d",
}  # fmt: skip
INTEGERS = [name for name, code in TYPES.items() if code not in "fd"]
REALS = [name for name, code in TYPES.items() if code in "fd"]


def numbers(kind: str) -> st.SearchStrategy[Any]:
    """Draws values of a PLY type."""
    if kind in REALS:
        return st.floats(width=32 if TYPES[kind] == "f" else 64)
    limits = np.iinfo(TYPES[kind])
    return st.integers(int(limits.min), int(limits.max))


class Table(NamedTuple):
    """An element of a PLY file."""

    name: str
    properties: list[tuple[str, str]]
    """Type and name; two types for a list."""
    records: list[list[Any]]
    """A number or a list for each property."""

    def encoded(self, order: str | None, newline: str) -> bytes:
        """The records, as text if there is no byte order."""
        body = b""
        for record in self.records:
            pairs = []
            for (kind, _), value in zip(self.properties, record, strict=True):
                types = kind.split()
                if len(types) > 1:
                    pairs += [(types[1], len(value)), *((types[2], one) for one in value)]
                else:
                    pairs.append((kind, value))
            if order is None:
                body += " ".join(repr(value) for _, value in pairs).encode() + newline.encode()
            else:
                body += b"".join(struct.pack(order + TYPES[kind], value) for kind, value in pairs)
        return body


@st.composite
def tables(draw: st.DrawFn, name: str, n: int, own: dict[str, tuple[str, list[Any]]]) -> Table:
    """Draws a table that contains these properties and others."""
    columns = dict(own)
    for number in range(draw(st.integers(0 if own else 1, 2))):
        kind = draw(st.sampled_from([*TYPES]))
        values = numbers(kind)
        if draw(st.booleans()):
            values = st.lists(values, max_size=3)
            kind = f"list {draw(st.sampled_from(INTEGERS))} {kind}"
        columns[f"other{number}"] = kind, draw(st.lists(values, min_size=n, max_size=n))
    order = draw(st.permutations([*columns]))
    records = [[columns[one][1][i] for one in order] for i in range(n)]
    return Table(name, [(columns[one][0], one) for one in order], records)


@given(st.data())
def test_any_ply_is_read(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    k = data.draw(st.integers(1, 6))
    vertices = {}
    for axis in "xyz":
        kind = data.draw(st.sampled_from(REALS))
        vertices[axis] = kind, data.draw(st.lists(numbers(kind), min_size=k, max_size=k))
    if data.draw(st.booleans()):
        ones = st.lists(st.integers(0, 1), min_size=k, max_size=k)
        vertices["known"] = data.draw(st.sampled_from(INTEGERS)), data.draw(ones)
    sizes = st.integers(3, 3 if data.draw(st.booleans()) else 5)
    face = sizes.flatmap(lambda n: st.lists(st.integers(0, k - 1), min_size=n, max_size=n))
    faces = data.draw(st.lists(face, min_size=1, max_size=4))
    kind = f"list {data.draw(st.sampled_from(INTEGERS))} {data.draw(st.sampled_from(INTEGERS))}"
    corners = data.draw(st.sampled_from(["vertex_indices", "vertex_index"]))
    elements = [
        data.draw(tables("vertex", k, vertices)),
        data.draw(tables("face", len(faces), {corners: (kind, faces)})),
        data.draw(tables("edge", data.draw(st.integers(0, 3)), {})),
    ]
    elements = data.draw(st.permutations(elements))
    order = data.draw(st.sampled_from([None, "<", ">"]))
    newline = data.draw(st.sampled_from(["\n", "\r\n", "\r"]))
    format = {None: "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    header = ["ply", f"format {format} 1.0", "comment by Zo\xeb", "obj_info end_header"]
    for element in elements:
        header.append(f"element {element.name} {len(element.records)}")
        header += [f"property {kind} {name}" for kind, name in element.properties]
    text = newline.join([*header, "end_header", ""]).encode("latin-1")
    path = tmp_path_factory.getbasetemp() / "any.ply"
    path.write_bytes(text + b"".join(element.encoded(order, newline) for element in elements))

    columns, comments = parse_ply(path.read_bytes())
    assert comments == ["by Zo\xeb", "end_header"]
    for element in elements:
        assert [*columns[element.name]] == [name for _, name in element.properties]
        for i, (kind, name) in enumerate(element.properties):
            column: Any = columns[element.name][name]
            values = [record[i] for record in element.records]
            if kind.startswith("list"):
                sizes, column = column
                np.testing.assert_array_equal(sizes, [len(one) for one in values])
                values = [*chain.from_iterable(values)]
            assert column.dtype == np.dtype(TYPES[kind.split()[-1]])
            np.testing.assert_array_equal(column, values)

    again = dynmesh.read(path)
    double = any(TYPES[vertices[axis][0]] == "d" for axis in "xyz")
    assert again.vertices.dtype == (np.float64 if double else np.float32)
    np.testing.assert_array_equal(again.vertices[0], np.transpose([vertices[a][1] for a in "xyz"]))
    polygons = as_polygons(again.faces, again.polygons)
    np.testing.assert_array_equal(polygons.sizes, [len(one) for one in faces])
    np.testing.assert_array_equal(polygons.corners, [*chain.from_iterable(faces)])
    assert (again.known is not None) == ("known" in vertices)
    if again.known is not None:
        np.testing.assert_array_equal(again.known[0], vertices["known"][1])
