"""OBJ and PLY: every variant, damaged files, and what they hold beside positions and faces."""

import re
import struct
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import to_file
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from plain_files import FACE, POINTS, TRIANGLE, XYZ, ply
from sequences import assert_refused

import dynmesh
from dynmesh._core import parse_obj, parse_off, parse_ply
from dynmesh.polygons import as_polygons
from dynmesh.scans import read_points


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no vertices"),
        ("v 1e400 0 0\n", "line 1: '1e400' cannot be read"),
        ("v 0 0 0 red 0 0\n", "line 1: 'red' cannot be read"),
        ("v 0 0 0 2\n", "line 1: a vertex has a weight that is not 1"),
        ("v 0 0 0 1 1\n", "line 1: a vertex has 3 coordinates, not 5"),
        (TRIANGLE + "f 1 2 99999999999999999999\n", "line 5: there is no vertex 9"),
        (TRIANGLE + "f 1 2 -4\n", "line 5: there is no vertex -4, with 3 before"),
        (TRIANGLE + "vt 0 \\\nf 1 2 9\nf 1 2 4\n", "line 7: there is no vertex 4, only 3"),
        (TRIANGLE + "f 1 2 3.0\n", "line 5: '3.0' is not a corner"),
        (TRIANGLE + "f 1 2 3/x\n", "line 5: '3/x' is not a corner"),
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
    points, sizes, corners, _ = parse_obj(data)
    expected, faces = stated(data)
    np.testing.assert_array_equal(points, np.reshape(expected, (-1, 3)))
    np.testing.assert_array_equal(sizes, [len(face) for face in faces])
    np.testing.assert_array_equal(corners, [*chain.from_iterable(faces)])


@pytest.mark.parametrize(
    "text",
    [
        TRIANGLE,
        TRIANGLE.replace("\n", "\r"),
        "vt 0 0\n" + TRIANGLE.replace("f", "# in D:\\x\\\nf"),
        TRIANGLE.removesuffix("\n"),
        TRIANGLE.replace("v 0 1 0", "v  -0.1\t1e-3  nan "),
        TRIANGLE.replace("v 0 1 0", "v +INF -infinity -NaN"),
        TRIANGLE.replace("1 2 3", "-3 -2//-2 -1/"),
        TRIANGLE.replace("v 0", "v\t+0"),
        TRIANGLE.replace("f", "g a#1 # b\nf"),
        TRIANGLE.replace("v 1 0", "v\\ \r\n1 \\ # one\n0"),
        TRIANGLE.replace("f 1 2", "f +1 2"),
        TRIANGLE.replace("f 1", "f\x0b1"),
        TRIANGLE.replace("f", "g a \\\nf 9 9 9\nf"),
        TRIANGLE.replace("f", "g a\rf 3 2 1\nf"),
        "f 3 2 1\n" + TRIANGLE,
        "# caf\xe9\r\nmtllib a.mtl\r\no body\r\nv 0 0 0 0.5 0.5 0.5\r\n  v\t1 0 0 1.0\r\n"
        "v nan NaN -nan # lost\r\nv 1e-3 \\\r\n 2 3\r\nvt 0 0\r\nvn 0 0 1\r\ng top\r\ns off\r\n"
        "usemtl red\r\nl 1 2\r\nf 1/1 2/1/1 3//1 -1\r\nf -4 -3 -2\r\nv 9 9 9\r\nf 5 -1 1\r\n",
    ],
)
def test_every_variant_of_obj_is_read_and_written_again(tmp_path: Path, text: str) -> None:
    data = text.encode("latin-1")
    check_as_stated(data)
    (tmp_path / "a.obj").write_bytes(b"g all\n" + data)  # which is kept
    with dynmesh.open(tmp_path / "a.obj") as reader:
        (frame,) = reader
        dynmesh.write(tmp_path / "b.obj", to_file.frames_of(reader.header, [frame.points + 1]))
    points, sizes, corners, _ = parse_obj(data)
    for one, other in zip(
        (points + 1, sizes, corners), parse_obj((tmp_path / "b.obj").read_bytes()), strict=False
    ):
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


def triangle(face: bytes) -> bytes:
    """Three vertices and one face, which is given as the end of the file."""
    return ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + face)


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"solid cube\n", "line 1"),
        (ply(f"vertex 2: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 2\n"), "line 12: .* 'face'"),
        (triangle(b"3 0 1 2\n" * 2), "line 14"),
        (triangle(b"3 0 1 two\n"), "line 13: 'two'"),
        (triangle(b"3 0 1\n"), "line 13: .* 'face'"),
        (ply(f"vertex 3: {XYZ}", POINTS.replace(b"1", b"1e39")), "line 9: '1e39'"),
        (triangle(b"3 0 1 3\n"), "face 0 refers to vertex 3"),
        (triangle(b"3 0 1 -1\n"), "refers to vertex -1"),
        (triangle(b"2 0 1\n"), "polygon 0 has 2 corners"),
        (ply(f"vertex -3: {XYZ}", POINTS), "line 3: .*'-3'"),
        (ply(f"vertex 0: {XYZ}; face 0: {FACE}", b""), "has no vertices"),
        (ply(f"vertex {10**15}: {XYZ}; face 1: {FACE}", b""), f"record 0 of 'vertex', of {10**15}"),
        (ply(f"vertex {10**15}: {XYZ}", b"", format="binary_big_endian"), f"of {10**15}, needs"),
        (ply("vertex 3: float x, float y, int z", POINTS), "'z'"),
        (ply("vertex 3", POINTS).replace(b"property \n", b""), "'vertex' has no properties"),
        (ply("vertex 1: quad x", b"1\n"), "line 4: .*'quad'"),
        (ply("vertex 1: list float int x", b"1 1\n"), "line 4: .*'float'"),
        (ply("vertex 1: list int x", b"1\n"), "line 4: .*'list'"),
        (ply("vertex 1: float x, int x", b"1 1\n"), "line 5: .*'x'"),
        (ply("a 1: int x; a 1: int x", b"1\n1\n"), "line 5: .*'a'"),
        (ply("a 1: int x", b"1\n", format="binary"), "line 2: .*ascii"),
        (ply("a 1: int x", b"1\n", head="format ascii 1.0"), "line 3"),
        (b"ply\nelement a 1\nend_header\n", "line 2"),
        (b"ply\ncomment\nend_header\n", "names no format"),
        (b"ply\nformat ascii 1.0\nproperty int x\nend_header\n", "line 3"),
        (triangle(b"3 0 1 2\n").replace(b"uchar int", b"uchar float"), "corners .*integers"),
        (triangle(b"3 0 1 2\n").replace(b"vertex_indices", b"corners"), "'vertex_indices'"),
        (ply(f"vertex 1: {XYZ}, uchar known", b"0 0 0 2\n"), "known: .* vertex 0 has 2"),
        (ply(f"vertex 1: {XYZ}, float known", b"0 0 0 1\n"), "'known'"),
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


def test_ply_files_of_wrong_length_are_refused(tmp_path: Path) -> None:
    """Text and binary files with more than a mesh in them."""
    path = tmp_path / "a.ply"
    text = ply(
        f"material 2: list uchar float w, int id; vertex 4: {XYZ}, uchar known; face 2: {FACE}",
        b"2 0.5 1e3 4\n0 9\n0 0 0 1\n1 0 nan 1\n0 1 -1e-3 0\n4 4 4 0\n3 0 1 2\n4 0 1 2 3\n",
    )
    mixed = ply(
        f"vertex 3: {XYZ}; face 2: list int ushort vertex_index, list uchar char name, uchar flag",
        np.arange(9, dtype=">f4").tobytes()
        + b"\0\0\0\3\0\0\0\1\0\2\2ab\7"
        + b"\0\0\0\4\0\0\0\1\0\2\0\0\0\7",
        format="binary_big_endian",
    )
    for whole in (text, text.replace(b"\n", b"\r\n"), mixed):
        path.write_bytes(whole)
        dynmesh.read(path)
        lengths = range(len(whole.rstrip(b"\r\n")))  # the last line needs no end
        for data in [*(whole[:n] for n in lengths), whole + b"\0"]:
            path.write_bytes(data)
            assert_refused(path)


NAN = [
    "nan",
    "NaN",
    "NAN",
    "-nan",
    "+nan",
    "nan(ind)",
    "-nan(ind)",
    "nan(snan)",
    "1.#QNAN",
    "-1.#IND",
    "1.#SNAN",
    "1.#QNAN0",
]
INFINITY = ["inf", "Inf", "-INF", "infinity", "Infinity", "1.#INF", "-1.#INF", "1.#INF00"]
NO_NUMBERS = ["nan(", "nanx", "1.#X", "1.#0", "1.#", "#", "1_0", "0x1", "1,5", "-", "infinite"]

TEXTS: dict[str, str] = {
    "obj": "v 0 0 0\nv 1 0 {}\nv 0 1 0\nf 1 2 3\n",
    "off": "OFF\n3 1 0\n0 0 0\n1 0 {}\n0 1 0\n3 0 1 2\n",
    "ply": triangle(b"3 0 1 2\n").decode().replace("1 0 0\n", "1 0 {}\n"),
    "xyz": "0 0 0\n1 0 {}\n0 1 0\n",
    "txt": "0 0\n0 {}\n* 1\n",
}
"""A file of each format with text, in which a number may be chosen."""


def number_in(folder: Path, suffix: str, word: str, change: Any = lambda text: text) -> float:
    """Writes this file, after a change of its bytes, and returns the number that is read."""
    path = folder / f"a.{suffix}"
    path.write_bytes(change(TEXTS[suffix].format(word).encode()))
    if suffix == "obj":
        return float(parse_obj(path.read_bytes())[0][1, 2])
    if suffix == "off":
        return float(parse_off(path.read_bytes())[0][1, 2])
    if suffix == "xyz":
        return float(read_points(path).scan.points[1, 2])
    if suffix == "txt":
        whole = dynmesh.synth.ocean(1, grid=4)
        dynmesh.write(folder / "whole.npz", whole)
        known = dynmesh.read(folder / "whole.npz", known=path).known
        assert known is not None
        return float(np.flatnonzero(~known[0])[-1])
    return float(dynmesh.read(path).vertices[0, 1, 2])


@pytest.mark.parametrize("suffix", ["obj", "off", "ply"])
@pytest.mark.parametrize("word", [*NAN, *INFINITY])
def test_every_spelling_of_no_number_is_a_missing_vertex(
    tmp_path: Path, suffix: str, word: str
) -> None:
    expected = np.nan if word in NAN else np.copysign(np.inf, -1.0 if word[0] == "-" else 1.0)
    np.testing.assert_equal(number_in(tmp_path, suffix, word), expected)


@pytest.mark.parametrize("suffix", TEXTS)
@pytest.mark.parametrize("word", NO_NUMBERS)
def test_what_is_no_number_is_refused(tmp_path: Path, suffix: str, word: str) -> None:
    if (suffix, word) in {("xyz", "1,5"), ("txt", "#")}:
        return  # in one, commas separate; in the other, a frame without vertices is none
    with pytest.raises(ValueError, match="line "):
        number_in(tmp_path, suffix, word)


ALIKE: dict[str, Any] = {
    "a byte-order mark": lambda text: b"\xef\xbb\xbf" + text,
    "a last line without its end": lambda text: text.removesuffix(b"\n"),
    "line ends of Windows": lambda text: text.replace(b"\n", b"\r\n"),
    "line ends of old Macs": lambda text: text.replace(b"\n", b"\r"),
    "empty lines": lambda text: text.replace(b"0\n", b"0\n \n\n") + b"\n\n",
    "tabs": lambda text: text.replace(b"0 3\n", b"\t0\t3 \n"),
    "comments": lambda text: text.replace(b"3\n", b"3\t# 4 5\n"),
}


@pytest.mark.parametrize("suffix", TEXTS)
@pytest.mark.parametrize("how", ALIKE)
def test_text_is_read_alike_in_all_formats(tmp_path: Path, suffix: str, how: str) -> None:
    if suffix == "ply" and how == "comments":
        return  # it has them in its header alone
    assert number_in(tmp_path, suffix, "3", ALIKE[how]) == 3


@pytest.mark.parametrize("suffix", TEXTS)
def test_a_comment_begins_after_white_space_and_text_is_not_in_utf_16(
    tmp_path: Path, suffix: str
) -> None:
    with pytest.raises(ValueError, match="line "):
        number_in(tmp_path, suffix, "3#4")
    with pytest.raises(ValueError, match=r"line 1.*(UTF-16|'ply')"):
        number_in(tmp_path, suffix, "3", lambda text: text.decode().encode("utf-16"))


OBJ = """# made by hand
# up_axis z
mtllib skins/my body.mtl
o body
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 1 1 0 0 0 1
v 0 1 0 1 1 1
v 0.5 0.5 1 0 0 0
vt 0 0
vt 1 0
vt 0.5 1
vn 0 0 -1
vn 0 0 1
vn 1 0 0
vn 0 1 0
g base
usemtl skin
f 4/1/1 3/2/1 2/3/1 1/1/1
g sides
s off
f 1/1/2 2/2/2 5/3/2
f 2/1/3 \\
 3/2/3 5/3/3
f -3/1/4 -2/2/4 -1/3/4
f 4/1 1/2 5/3
"""
TURN = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])


def words_of(file: Path, *without: str) -> list[list[str]]:
    """The words of every line, except of those that begin with one of some."""
    content = file.read_text().replace("\\\n", " ")
    lines = [line.split() for line in content.splitlines()]
    return [words for words in lines if words and words[0] not in without]


def coordinates(file: Path) -> NDArray[np.float64]:
    """The positions and the colours."""
    return np.array([words[1:] for words in words_of(file) if words[0] == "v"], np.float64)


def check_kept(made: Path, source: Path) -> None:
    """Everything is there but positions and normals, to which faces no longer refer."""
    moving = "v", "vn", "mtllib", "#"
    expected = [
        [word.rpartition("/")[0] if word.count("/") == 2 else word for word in words]
        for words in words_of(source, *moving)
    ]
    assert words_of(made, *moving) == expected
    np.testing.assert_array_equal(coordinates(made)[:, 3:], coordinates(source)[:, 3:])


def test_obj_keeps_everything_but_normals(tmp_path: Path) -> None:
    source = tmp_path / "in" / "body_0001.obj"
    source.parent.mkdir()
    source.write_text(OBJ)
    (source.parent / "skins").mkdir()
    (source.parent / "skins" / "my body.mtl").write_text("newmtl skin\nmap_Kd skin.png\n")
    (source.parent / "skins" / "skin.png").touch()
    (tmp_path / "out").mkdir()
    with dynmesh.open(source.with_name("body_%04d.obj")) as reader:
        (frame,) = reader
        frames = to_file.frames_of(reader.header, [frame.points @ TURN.T + 5])
        written = dynmesh.write(tmp_path / "out" / "a_%04d.obj", frames)
    made = tmp_path / "out" / "a_0001.obj"
    check_kept(made, source)
    (library,) = (words for words in words_of(made) if words[0] == "mtllib")
    assert library == ["mtllib", "./../in/skins/my", "body.mtl"]
    np.testing.assert_array_equal(coordinates(made)[:, :3], coordinates(source)[:, :3] @ TURN.T + 5)
    assert written.remarks == ("normals of body_0001.obj are not written",)
    again: Any = trimesh.load(made, process=False, group_material=False)  # another reader
    assert len(again.faces) == 6


VERTEX = "float nx, float x, float y, float z, uchar red, double quality, list uchar int near"
ROWS = b"""1 0 0 0 10 0.25 0
1 1 0 0 11 0.5 1 2
1 0 1 0 12 0.75 0
1 1 1 0 13 1e-300 0
3 0 1 2 7
3 2 1 3 -9
"""


def test_ply_keeps_properties_of_vertices(tmp_path: Path) -> None:
    content = ply(f"vertex 4: {VERTEX}; face 2: {FACE}, short label", ROWS)
    (tmp_path / "in_0007.ply").write_bytes(content)
    with dynmesh.open(tmp_path / "in_%04d.ply") as reader:
        (frame,) = reader
        frames = to_file.frames_of(reader.header, [frame.points[:, [2, 0, 1]]])
        (remark,) = dynmesh.write(tmp_path / "out_%04d.ply", frames).remarks
    assert remark == "face.label, vertex.near and vertex.nx of in_0007.ply are not written"
    again: Any = trimesh.load(tmp_path / "out_0007.ply", process=False)  # another reader
    written = again.metadata["_ply_raw"]["vertex"]["data"]
    assert written["red"].tolist() == [10, 11, 12, 13]
    assert written["quality"].tolist() == [0.25, 0.5, 0.75, 1e-300]
    np.testing.assert_array_equal(again.vertices, frame.points[:, [2, 0, 1]])
    np.testing.assert_array_equal(again.faces, [[0, 1, 2], [2, 1, 3]])


def test_a_completed_sequence_keeps_what_its_template_holds(tmp_path: Path) -> None:
    template = tmp_path / "body.obj"
    template.write_text(OBJ)
    whole = dynmesh.read(template)
    frames = np.stack([whole.vertices[0] @ TURN.T + t for t in range(3)])
    known = np.array([[True, True, t > 0, False, True] for t in range(3)])
    partial = dynmesh.Sequence(frames, whole.faces, known, start=7)
    dynmesh.write(tmp_path / "partial.npz", partial)
    output = tmp_path / "made_%04d.obj"
    report = to_file.complete(tmp_path / "partial.npz", output, template=template)
    for number in (7, 8, 9):
        check_kept(tmp_path / f"made_{number:04}.obj", template)
    made_polygons: Any = dynmesh.read(output).polygons
    polygons: Any = whole.polygons
    np.testing.assert_array_equal(made_polygons.sizes, polygons.sizes)
    lost = [remark for remark in report.remarks if "of body.obj" in remark]
    assert lost == ["normals of body.obj are not written"]
    output = tmp_path / "made.h5"
    report = to_file.complete(tmp_path / "partial.npz", output, template=template)
    (told,) = (remark for remark in report.remarks if "of body.obj" in remark)
    assert "colours" in told
    assert "materials" in told
    kept: Any = dynmesh.read(output).polygons
    np.testing.assert_array_equal(kept.corners, polygons.corners)


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["up_axis z"], ("z", None)),
        (["Made by hand", "  up_axis   y  ", "metres_per_unit 1e-2"], ("y", 0.01)),
        (["up_axis x"], ("x", None)),
        # comments of other programs, which are ignored
        (["up_axis w"], (None, None)),
        (["up_axis"], (None, None)),
        (["the up_axis z"], (None, None)),
        (["up_axis z or y"], (None, None)),
        (["metres_per_unit much", "metres_per_unit -1", "metres_per_unit nan"], (None, None)),
        (["metres_per_unit inf", "metres_per_unit 0"], (None, None)),
    ],
)
def test_other_comments_are_ignored(
    tmp_path: Path, suffix: str, words: list[str], expected: tuple[str | None, float | None]
) -> None:
    path = tmp_path / f"a{suffix}"
    if suffix == ".ply":
        head = "\n".join(f"comment {line}" for line in words)
        mesh = ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 2\n", head=head)
    else:
        head = "".join(f"# {line}\n" for line in words)
        mesh = f"{head}{TRIANGLE}# up_axis x\n".encode()  # of which the beginning alone counts
    path.write_bytes(mesh)
    sequence = dynmesh.read(path)
    assert (sequence.up_axis, sequence.metres_per_unit) == expected
