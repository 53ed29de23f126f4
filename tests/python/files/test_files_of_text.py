"""What text formats share: numbers, lines and comments; and what OBJ and PLY keep."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
import trimesh
from numpy.typing import NDArray
from plain_files import FACE, POINTS, TRIANGLE, XYZ, ply, triangle

import dynmesh
from dynmesh._core import parse_obj
from dynmesh.scans import read_points

NAN = [
    "nan",
    "NaN",
    "nan(ind)",
    "1.#QNAN",
    "-1.#IND",
    "1.#QNAN0",
]
INFINITY = ["inf", "-INF", "Infinity", "-1.#INF", "1.#INF00"]
NO_NUMBERS = ["nan(", "nanx", "1.#X", "1.#", "#", "1_0", "0x1", "1,5", "-", "infinite"]

TEXTS: dict[str, str] = {
    "obj": "v 0 0 0\nv 1 0 {}\nv 0 1 0\nf 1 2 3\n",
    "ply": triangle(b"3 0 1 2\n").decode().replace("1 0 0\n", "1 0 {}\n"),
    "xyz": "0 0 0\n1 0 {}\n0 1 0\n",
}
"""A file of each format with text, in which a number may be chosen."""


def number_in(folder: Path, suffix: str, word: str, change: Any = lambda text: text) -> float:
    """Writes this file, after a change of its bytes, and returns the number that is read."""
    path = folder / f"a.{suffix}"
    path.write_bytes(change(TEXTS[suffix].format(word).encode()))
    if suffix == "obj":
        return float(parse_obj(path.read_bytes())[0][1, 2])
    if suffix == "xyz":
        return float(read_points(path).scan.points[1, 2])
    return float(dynmesh.read(path).vertices[0, 1, 2])


@pytest.mark.parametrize("suffix", ["obj", "ply"])
@pytest.mark.parametrize("word", [*NAN, *INFINITY])
def test_every_spelling_of_no_number_is_a_missing_vertex(
    tmp_path: Path, suffix: str, word: str
) -> None:
    expected = np.nan if word in NAN else np.copysign(np.inf, -1.0 if word[0] == "-" else 1.0)
    np.testing.assert_equal(number_in(tmp_path, suffix, word), expected)


@pytest.mark.parametrize("suffix", TEXTS)
@pytest.mark.parametrize("word", NO_NUMBERS)
def test_what_is_no_number_is_refused(tmp_path: Path, suffix: str, word: str) -> None:
    if (suffix, word) == ("xyz", "1,5"):
        return  # commas separate
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
        turned = [frame.points @ TURN.T + 5]
        frames = to_file.frames_of(reader.header, turned, reader.origin)
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
        turned = [frame.points[:, [2, 0, 1]]]
        frames = to_file.frames_of(reader.header, turned, reader.origin)
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
        (["up_axis w", "the up_axis z", "metres_per_unit much"], (None, None)),
        (["metres_per_unit -1", "metres_per_unit nan", "up_axis z or y"], (None, None)),
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
