"""OBJ files of other programs, and damaged ones."""

import re
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_files import TRIANGLE
from sequences import assert_refused

import dynmesh
from dynmesh._core import parse_obj


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no vertices"),
        ("v nan(1) 0 0\n", r"line 1: 'nan\(1\)' cannot be read"),
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
    path.write_text(text)
    assert_refused(path, message)


def stated(data: bytes) -> tuple[list[list[float]], list[list[int]]]:
    """Reads a valid OBJ a second time, as the format is described, without regard to speed."""
    text = data.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
    joined = re.sub(r"\\[ \t\v\f]*(#.*)?\n", " ", re.sub(r"(?m)#.*$", "", text))
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
        TRIANGLE.replace("\n", "\r\n"),
        TRIANGLE.replace("\n", "\r"),
        "vt 0 0\n" + TRIANGLE.replace("f", "# in D:\\x\\\nf"),
        TRIANGLE.removesuffix("\n"),
        f"# by hand, in D:\\x\nmtllib a.mtl\no body\n\n{TRIANGLE}",
        TRIANGLE.replace("0\nv", "0\nvt 0 1\nvn 0 0 1\nv").replace("1 2 3", "1/1/1 2/1/1 3/1/1"),
        TRIANGLE.replace("v 0 1 0", "v  -0.1\t1e-3  nan "),
        TRIANGLE.replace("v 0 1 0", "v +INF -infinity -NaN"),
        TRIANGLE.replace("0\n", "0 0.1 0.2 0.3\n"),
        TRIANGLE.replace("0\n", "0 1.0\n"),
        TRIANGLE.replace("1 2 3", "-3 -2//-2 -1/"),
        TRIANGLE.replace("v 0", " v 0"),
        TRIANGLE.replace("v 0", "v\t+0"),
        TRIANGLE.replace("v 1 0", "v 1 \\\n0"),
        TRIANGLE.replace("v 1 0", "v\\ \r\n1 \\# one\n0"),
        TRIANGLE.replace("v 1 0 0", "v 1 0 0 # one"),
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
        with dynmesh.create(tmp_path / "b.obj", reader.header) as writer:
            writer.append(frame.points + 1)
    points, sizes, corners, _ = parse_obj(data)
    for one, other in zip(
        (points + 1, sizes, corners), parse_obj((tmp_path / "b.obj").read_bytes()), strict=False
    ):
        np.testing.assert_array_equal(one, other)


obj_pieces = st.sampled_from(
    [
        *"vf123 #/\\\t\r\n-+._e(\x0b\x1c\x85",
        "v 1 2 3\n",
        "f 1 2 3\n",
        "f -1 -1 -2\n",
        "nan",
        "vt 0\n",
    ]
)


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
