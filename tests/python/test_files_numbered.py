"""Sequences with one file per frame: names, PLY and OBJ."""

import struct
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from meshes import Array, Mesh
from vtk_meshes import as_cells, as_polydata, parts
from vtkmodules.util import numpy_support
from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkOBJWriter
from vtkmodules.vtkIOPLY import vtkPLYReader, vtkPLYWriter

import dynmesh
from dynmesh import files
from dynmesh._core import plain_obj
from dynmesh.files.obj import line_by_line
from dynmesh.polygons import Polygons, as_polygons, triangulate

numpy_to_vtk: Any = numpy_support.numpy_to_vtk
vtk_to_numpy: Any = numpy_support.vtk_to_numpy

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def sequence_of(mesh: Mesh, n: int = 3, dtype: Any = np.float32) -> dynmesh.Sequence:
    shift = np.arange(n).reshape(n, 1, 1) / 3
    return dynmesh.Sequence((mesh.vertices + shift).astype(dtype), mesh.faces)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def interrupt(writer: files.Writer, frames: Array) -> None:
    """Writes the first frames and stops."""
    with pytest.raises(KeyboardInterrupt), writer:  # noqa: PT012
        for points in frames:
            writer.append(points)
        raise KeyboardInterrupt


def ply(elements: str, body: bytes, *, format: str = "ascii", head: str = "") -> bytes:
    """Builds a PLY file from elements: `vertex 3: float x, float y, float z; face 1: ...`."""
    lines = ["ply", f"format {format} 1.0", *head.splitlines()]
    for element in elements.split("; "):
        name, _, properties = element.partition(": ")
        lines.append(f"element {name}")
        lines += [f"property {one}" for one in properties.split(", ")]
    return "\n".join([*lines, "end_header\n"]).encode() + body


XYZ = "float x, float y, float z"
FACE = "list uchar int vertex_indices"
POINTS = b"0 0 0\n1 0 0\n0 1 0\n"


# Names


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_every_way_to_name_the_files(tmp_path: Path, mesh: Mesh, suffix: str) -> None:
    sequence = sequence_of(mesh, 12, np.float64)
    folder = tmp_path / "frames"
    dynmesh.write(folder / f"f%d{suffix}", sequence)
    assert names(folder) == sorted(f"f{i}{suffix}" for i in range(12))
    for path in (folder / f"f%d{suffix}", folder / f"*{suffix}", folder / f"f[0-9]*{suffix}"):
        np.testing.assert_array_equal(dynmesh.read(path).vertices, sequence.vertices)
    (folder / "notes.txt").touch()
    (folder / f"._f3{suffix}").touch()  # like the hidden files of macOS
    np.testing.assert_array_equal(dynmesh.read(folder).vertices, sequence.vertices)
    one = dynmesh.read(folder / f"f10{suffix}")
    np.testing.assert_array_equal(one.vertices, sequence.vertices[10:11])


def test_a_folder_is_written_and_read(tmp_path: Path, mesh: Mesh) -> None:
    sequence = sequence_of(mesh)
    folder = tmp_path / "walk"
    dynmesh.write(folder, sequence, format="ply")
    assert names(folder) == ["frame_0000.ply", "frame_0001.ply", "frame_0002.ply"]
    dynmesh.write(folder, sequence_of(mesh, 2))  # the existing files determine the format
    assert names(folder) == ["frame_0000.ply", "frame_0001.ply"]
    assert names(tmp_path) == ["walk"]

    (folder / "scan.ply").touch()
    with pytest.raises(
        ValueError, match=r"walk: contains scan\.ply, which does not match frame_%04d"
    ):
        dynmesh.write(folder, sequence)
    (folder / "scan.ply").rename(folder / "scan.obj")
    with pytest.raises(ValueError, match=r"both \.ply and \.obj files; name the format: --form"):
        dynmesh.open(folder)
    assert dynmesh.open(folder, format="ply").n_frames == 2
    (tmp_path / "none").mkdir()
    with pytest.raises(ValueError, match=r"none: is a folder with no \.ply or \.obj files"):
        dynmesh.open(tmp_path / "none")
    with pytest.raises(ValueError, match=r"none: holds no \.obj file"):
        dynmesh.open(tmp_path / "none", format="obj")


def test_gaps_are_refused(tmp_path: Path) -> None:
    for number in (8, 9, 11):
        (tmp_path / f"f_{number:04d}.obj").write_text(TRIANGLE)
    with pytest.raises(ValueError, match=r"f_%04d\.obj: f_0010\.obj is missing"):
        dynmesh.open(tmp_path / "f_%04d.obj")
    (tmp_path / "f_10.obj").write_text(TRIANGLE)  # of another pattern
    with pytest.raises(ValueError, match=r"f_0010\.obj is missing"):
        dynmesh.open(tmp_path / "f_%04d.obj")
    (tmp_path / "f_0010.obj").write_text(TRIANGLE)
    assert dynmesh.open(tmp_path / "f_%04d.obj").n_frames == 4  # may start at any number
    for path in ("g_%04d.obj", "g*.obj", "g.obj", "nowhere/f_%d.obj"):
        with pytest.raises(FileNotFoundError):
            dynmesh.open(tmp_path / path)


@pytest.mark.parametrize(
    ("numbers", "missing"),
    [
        (["0018", "0019", "0021"], "0020"),
        (["8", "9", "11"], "10"),
        (["0", "2", "4", "8"], "6"),
        (["0", "2", "4"], None),
        (["1000", "1033", "1067"], None),  # milliseconds
        (["1", "01", "3"], None),
    ],
)
def test_gaps_in_a_folder_and_a_glob_are_refused(
    tmp_path: Path, numbers: list[str], missing: str | None
) -> None:
    for number in numbers:
        (tmp_path / f"f2_{number}.obj").write_text(TRIANGLE)
    for path in (tmp_path, tmp_path / "f*.obj"):
        if missing is None:
            with dynmesh.open(path) as reader:
                assert reader.n_frames == len(numbers)
                assert reader.header.start == int(numbers[0])
        else:
            with pytest.raises(ValueError, match=rf": f2_{missing}\.obj is missing: add it"):
                dynmesh.open(path)


def test_a_shorter_sequence_replaces_a_longer_one(tmp_path: Path, mesh: Mesh) -> None:
    path = tmp_path / "f_%03d.ply"
    dynmesh.write(path, sequence_of(mesh, 1002))
    (tmp_path / "f_12.ply").touch()
    (tmp_path / "g_001.ply").touch()
    assert len(files.target_of(path).existing()) == 1002
    assert files.target_of(path).existing()[-1].name == "f_1001.ply"
    dynmesh.write(path, sequence_of(mesh, 2))
    assert names(tmp_path) == ["f_000.ply", "f_001.ply", "f_12.ply", "g_001.ply"]
    assert dynmesh.read(path).vertices.shape == (2, 49, 3)


@pytest.mark.parametrize(
    ("names", "path", "start"),
    [
        (["f_0999", "f_1000", "f_1001"], "f_%04d.obj", 999),
        (["f.7", "f.8"], "f.%d.obj", 7),
        (["take2_0998", "take2_1003"], ".", 998),
        (["take2_0998", "take2_1003"], "take*.obj", 998),
        (["0031"], "*.obj", 31),
        (["2_left", "10_left"], ".", 2),
        (["f_7"], "f_7.obj", 0),
        (["a7", "b8"], ".", 0),
        (["take1_0001", "take2_0001"], ".", 0),
        (["f_0001", "last"], ".", 0),
        (["last"], ".", 0),
        (["f_20250101120000000"], ".", 0),
        (["f_20250101120000000"], "f_%d.obj", 0),
        (["a1/f_7", "a2/f_8"], "a1/f_7.obj", 0),
    ],
)
def test_the_first_number_is_where_it_starts(
    tmp_path: Path, names: list[str], path: str, start: int
) -> None:
    folder = tmp_path / "shot5"
    for name in names:
        file = folder / f"{name}.obj"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(TRIANGLE)
    with dynmesh.open(folder / path) as reader:
        assert reader.header.start == start


def test_files_are_numbered_from_the_start(tmp_path: Path, mesh: Mesh) -> None:
    sequence = sequence_of(mesh)
    path, folder = tmp_path / "f_%03d.ply", tmp_path / "frames"
    for start, first in ((998, 998), (7.0, 7), (0, 0), (-2, 0), (7.5, 0)):
        dynmesh.write(path, replace(sequence, start=start))
        assert files.target_of(path).existing() == [
            tmp_path / f"f_{first + i:03d}.ply" for i in range(3)
        ]
        dynmesh.write(folder, replace(sequence, start=start), format="ply")
        assert names(folder) == [f"frame_{first + i:04d}.ply" for i in range(3)]
        assert dynmesh.read(folder).start == dynmesh.read(path).start == first
    one = dynmesh.Sequence(sequence.vertices[:1], sequence.faces, start=1001)
    dynmesh.write(tmp_path / "one.ply", one)
    assert dynmesh.read(tmp_path / "one.ply").start == 0


def test_a_failed_write_leaves_nothing(tmp_path: Path, mesh: Mesh) -> None:
    sequence = sequence_of(mesh)
    for path, message in (
        ("body.ply", r"one file holds one frame, not 3: write body_%04d\.ply"),
        ("a*.ply", r"a glob can only be read; write to frame_%04d\.ply"),
    ):
        with pytest.raises(ValueError, match=message):
            dynmesh.write(tmp_path / path, sequence)
    traced = np.zeros((3, 49), np.int32)
    with pytest.raises(ValueError, match="cannot hold generation and age"):
        dynmesh.write(
            tmp_path / "new" / "f_%04d.obj",
            dynmesh.Sequence(sequence.vertices, mesh.faces, generation=traced, age=traced),
        )
    with pytest.raises(ValueError, match="the sequence has no faces"):
        dynmesh.write(tmp_path / "a%d.ply", dynmesh.Sequence(sequence.vertices, mesh.faces[:0]))
    with pytest.raises(FileNotFoundError):
        dynmesh.write(tmp_path / "no" / "where" / "f%d.ply", sequence)
    assert names(tmp_path) == []

    (tmp_path / "old").mkdir()
    header = files.Header(mesh.faces, 3, 49, np.dtype(np.float32))
    for folder in ("old", "new"):
        interrupt(files.create(tmp_path / folder / "f%d.ply", header), sequence.vertices[:1])
    assert names(tmp_path) == ["old"]
    assert names(tmp_path / "old") == []


@pytest.mark.parametrize("start", [0, 3, 1001])
def test_an_interrupted_sequence_can_be_resumed(tmp_path: Path, mesh: Mesh, start: int) -> None:
    sequence = sequence_of(mesh, 5)
    path, folder = tmp_path / "f_%04d.ply", tmp_path / "work"
    (tmp_path / "f_0002.ply").touch()  # of an older sequence
    header = files.Header(mesh.faces, 5, 49, np.dtype(np.float32), start=start)
    again = sequence.vertices[[0, 1, 1, 1]]  # the last two are not to count
    interrupt(files.target_of(path).create(header, folder=folder), again)
    assert len(names(folder)) == 4
    with pytest.raises(ValueError, match=rf"the unfinished f_{start + 4:04d}\.ply is missing"):
        files.target_of(path).create(header, folder=folder, resume_at=5)
    with files.target_of(path).create(header, folder=folder, resume_at=2) as writer:
        assert len(names(folder)) == 2
        for points in sequence.vertices[2:]:
            writer.append(points)
    np.testing.assert_array_equal(dynmesh.read(path).vertices, sequence.vertices)
    assert names(tmp_path) == [f"f_{start + i:04d}.ply" for i in range(5)]


# Consistency of frames


@pytest.mark.parametrize(
    ("second", "message"),
    [
        (TRIANGLE.replace("f", "v 2 2 2\nf"), "has 4 vertices, but f0.obj has 3"),
        (TRIANGLE + "f 1 2 3\n", "has 2 faces, but f0.obj has 1"),
        (TRIANGLE.replace("1 2 3", "1 3 2"), "its 1 faces are not those of f0.obj"),
    ],
)
def test_frames_of_another_mesh_are_refused(tmp_path: Path, second: str, message: str) -> None:
    (tmp_path / "f0.obj").write_text(TRIANGLE)
    (tmp_path / "f1.obj").write_text(second)
    with pytest.raises(ValueError, match=message) as caught:
        dynmesh.read(tmp_path / "f%d.obj")
    assert str(tmp_path / "f1.obj") in str(caught.value)


def test_later_frames_may_have_only_points(tmp_path: Path) -> None:
    (tmp_path / "f0.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    with pytest.raises(ValueError, match="has only points, but the first frame needs faces"):
        dynmesh.open(tmp_path / "f%d.obj")
    (tmp_path / "f0.obj").rename(tmp_path / "f1.obj")
    (tmp_path / "f0.obj").write_text(TRIANGLE)
    sequence = dynmesh.read(tmp_path / "f%d.obj")
    np.testing.assert_array_equal(sequence.vertices[1], sequence.vertices[0])

    body = POINTS + b"3 0 1 2\n"
    (tmp_path / "f0.ply").write_bytes(ply(f"vertex 3: {XYZ}; face 1: {FACE}", body))
    (tmp_path / "f1.ply").write_bytes(ply(f"vertex 3: {XYZ}", POINTS))
    (tmp_path / "f2.ply").write_bytes(ply(f"vertex 3: {XYZ}; face 0: {FACE}", POINTS))
    assert dynmesh.read(tmp_path / "f%d.ply").vertices.shape == (3, 3, 3)


def test_precision_is_widened_and_never_lost(tmp_path: Path, mesh: Mesh) -> None:
    for number, dtype in enumerate((np.float64, np.float32)):
        dynmesh.write(tmp_path / f"f{number}.ply", sequence_of(mesh, 1, dtype))
    again = dynmesh.read(tmp_path / "f%d.ply").vertices
    assert again.dtype == np.float64
    np.testing.assert_array_equal(again[1], mesh.vertices.astype(np.float32))
    (tmp_path / "f0.ply").rename(tmp_path / "f2.ply")
    message = r"f2\.ply: its positions are float64, but float32 in f1\.ply"
    with pytest.raises(ValueError, match=message):
        dynmesh.read(tmp_path / "f%d.ply")


def test_masks_come_with_every_frame_or_none(tmp_path: Path, mesh: Mesh) -> None:
    plain = sequence_of(mesh, 1)
    dynmesh.write(tmp_path / "f0.ply", plain)
    known = np.ones((1, 49), np.bool_)
    dynmesh.write(tmp_path / "f1.ply", dynmesh.Sequence(plain.vertices, mesh.faces, known))
    with pytest.raises(ValueError, match=r"f1\.ply: has known masks, unlike f0\.ply"):
        dynmesh.read(tmp_path / "f%d.ply")
    (tmp_path / "f0.ply").rename(tmp_path / "f2.ply")
    with pytest.raises(ValueError, match=r"f2\.ply: has no known masks, unlike f1\.ply"):
        dynmesh.read(tmp_path / "f%d.ply")


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
@pytest.mark.parametrize("size", [300, 3, 4])
def test_polygons_survive(tmp_path: Path, suffix: str, size: int) -> None:
    rng = np.random.default_rng(1)
    sizes = np.array([size, 3, 5] if size != 4 else [4, 4, 4], np.int32)
    polygons = Polygons(sizes, rng.integers(0, 300, sizes.sum()).astype(np.int32))
    vertices = rng.normal(size=(2, 300, 3))
    path = tmp_path / f"f%d{suffix}"
    dynmesh.write(path, dynmesh.Sequence(vertices, triangulate(polygons), polygons=polygons))
    again = dynmesh.read(path)
    assert again.polygons is not None
    for one, other in zip(again.polygons, polygons, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(again.faces, triangulate(polygons))


# PLY


def binary_ply(order: str, name: str, kind: str) -> bytes:
    """Three vertices with a normal and colours between the coordinates, a triangle and a pair."""
    letter = {"float": "f4", "double": "f8"}[kind]
    columns = [("red", "u1"), ("z", letter), ("nx", "f4"), ("x", letter), ("y", letter)]
    vertices = np.zeros(3, [(name, order + type) for name, type in columns])
    vertices["x"], vertices["y"], vertices["z"] = [0, 1, np.nan], [2, 3, np.nan], [4, 5, np.nan]
    corners = np.array([(3, (2, 0, 1), 7)], [("n", "u1"), ("v", f"{order}u4", 3), ("flag", "u1")])
    kinds = f"uchar red, {kind} z, float nx, {kind} x, {kind} y"
    return ply(
        f"camera 1: float f; vertex 3: {kinds}; face 1: list uchar uint {name}, uchar flag",
        np.zeros(1, "f4").tobytes() + vertices.tobytes() + corners.tobytes(),
        format=f"binary_{'little' if order == '<' else 'big'}_endian",
        head="comment made by hand\nobj_info none\n",
    )


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index"])
@pytest.mark.parametrize("kind", ["float", "double"])
def test_every_kind_of_binary_ply_is_read(tmp_path: Path, order: str, name: str, kind: str) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(binary_ply(order, name, kind))
    sequence = dynmesh.read(path)
    dtype = np.dtype(np.float32 if kind == "float" else np.float64)
    assert sequence.vertices.dtype == dtype
    expected = [[[0, 2, 4], [1, 3, 5], [np.nan] * 3]]
    np.testing.assert_array_equal(sequence.vertices, expected)
    np.testing.assert_array_equal(sequence.faces, [[2, 0, 1]])


def test_text_ply_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    body = b"0 0 7 0\n1 0 7 nan\n0 1 7 1e-3\n0 0 7 0\n4 0 1 2 3\n3 0 1 2\n"
    kinds = "double x, double y, uchar red, double z"
    text = ply(f"vertex 4: {kinds}; face 2: {FACE}", body)
    for data in (text, text.replace(b"\n", b"\r\n"), text + b"\n"):
        path.write_bytes(data)
        sequence = dynmesh.read(path)
        np.testing.assert_array_equal(sequence.vertices[0, :, 2], [0, np.nan, 1e-3, 0])
        assert sequence.polygons is not None
        np.testing.assert_array_equal(sequence.polygons.sizes, [4, 3])


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"ply", "not a PLY file"),
        (b"solid cube\n", "not a PLY file: line 1 is not 'ply'"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS)[:60], "header is cut or damaged"),
        (
            ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS),
            "cut or damaged: its 1 records of 'face' need 1 lines or more, but 0 follow",
        ),
        (
            ply(f"vertex 2: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 2\n"),
            "line 12: has 3 words, but 'face' needs 1",
        ),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 2\n" * 2), "14: continues after"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 two\n"), "13: .* b'two'"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1\n"), "13: has 3 words.* 4"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 1_0\n"), "13: .* '_'"),
        (
            ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 0.5\n"),
            "13: 0.5 is not a value of int32",
        ),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 2"), "is cut in line 13"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"\n"), "13: has too few words"),
        (
            ply(f"vertex 3: {XYZ}", POINTS.replace(b"1", b"1e39")),
            "line 9: 1e\\+39 is not a value of float32",
        ),
        (
            ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 3\n"),
            "face 0: refers to vertex 3",
        ),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 -1\n"), "refers to vertex -1"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"2 0 1\n"), "face 0: has 2 corners"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"0\n"), "face 0: has 0 corners"),
        (
            ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"300 0 1 2\n"),
            "13: the list length 300",
        ),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"-1\n"), "13: the list length -1"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"nan\n"), "13: the list length nan"),
        (
            ply(f"vertex -3: {XYZ}", POINTS),
            "line 3: the number of records must be an integer, not '-3'",
        ),
        (ply(f"vertex 0: {XYZ}; face 0: {FACE}", b""), "has no vertices"),
        (ply(f"vertex 999999999999999: {XYZ}; face 1: {FACE}", b""), "need 999999999999999 lines"),
        (
            ply(f"vertex 999999999999999: {XYZ}", b"", format="binary_big_endian"),
            "'vertex' need 11999999999999988 bytes or more, but 0 follow",
        ),
        (ply("face 0: list uchar int a", b""), "has no vertices"),
        (ply("vertex 1: float x, float y", b"0 0\n"), "need a property 'z', float or double"),
        (ply("vertex 3: float x, float y, int z", POINTS), "need a property 'z'"),
        (ply("vertex 3", POINTS).replace(b"property \n", b""), "'vertex' has no properties"),
        (ply("vertex 1: quad x", b"1\n"), "line 4: unknown type 'quad'"),
        (ply("vertex 1: list float int x", b"1 1\n"), "line 4: .* integer type, not float"),
        (ply("vertex 1: list int x", b"1\n"), "line 4: a property needs a type, or 'list'"),
        (ply("vertex 1: float x, int x", b"1 1\n"), "line 5: there is a second property 'x'"),
        (ply("a 1: int x; a 1: int x", b"1\n1\n"), "line 5: there is a second element 'a'"),
        (ply("a 1: int x", b"1\n", format="binary"), "line 2: the format must be one of ascii"),
        (ply("a 1: int x", b"1\n", head="format ascii 1.0"), "line 3: .* is not valid here"),
        (b"ply\nelement a 1\nend_header\n", "line 2: .* is not valid here"),
        (b"ply\ncomment\nend_header\n", "names no format"),
        (b"ply\nformat ascii 1.0\nproperty int x\nend_header\n", "line 3: .* is not valid"),
        (
            ply(f"vertex 3: {XYZ}; face 1: list uchar float vertex_indices", POINTS + b"3 0 1 2\n"),
            "the corners of its faces must be a list of integers",
        ),
        (
            ply(f"vertex 3: {XYZ}; face 1: int vertex_indices", POINTS + b"3\n"),
            "the corners of its faces must be a list of integers",
        ),
        (
            ply(f"vertex 3: {XYZ}; face 1: list uchar int corners", POINTS + b"3 0 1 2\n"),
            "its faces need a list 'vertex_indices'",
        ),
        (ply(f"vertex 1: {XYZ}, uchar known", b"0 0 0 2\n"), "'known' must be 0 or 1"),
        (ply(f"vertex 1: {XYZ}, float known", b"0 0 0 1\n"), "'known' must be integers"),
        (
            ply(f"vertex 1: {XYZ}, float generation, int age", b"0 0 0 1 1\n"),
            "'generation' must be integers that fit in int32",
        ),
        (
            binary_ply("<", "vertex_index", "float")[:-1],
            "record 0 of 'face' ends at byte 363, but the file ends at byte 362",
        ),
        (
            binary_ply("<", "vertex_index", "float")[:-20],
            "its 3 records of 'vertex' need 51 bytes or more, but 45 follow",
        ),
        (binary_ply(">", "vertex_index", "float") + b"\n", "continues for 1 bytes"),
        (
            ply("a 2: list short char b", b"\1\0\7\xff\xff", format="binary_little_endian"),
            "record 1 of 'a': has a list of length -1",
        ),
    ],
)
def test_damaged_ply_is_refused(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(data)
    with pytest.raises(ValueError, match=message) as caught:
        dynmesh.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


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
    bits = 8 * struct.calcsize("<" + TYPES[kind])
    signed = TYPES[kind].islower()
    return (
        st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        if signed
        else st.integers(0, 2**bits - 1)
    )


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


def whole_ply_files() -> list[bytes]:
    """Draws text and binary files with more than a mesh in them."""
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
    return [text, text.replace(b"\n", b"\r\n"), mixed, binary_ply("<", "vertex_index", "double")]


def test_ply_files_of_wrong_length_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    for whole in whole_ply_files():
        path.write_bytes(whole)
        dynmesh.read(path)
        lengths = range(len(whole) - whole.endswith(b"\r\n"))  # since \r also ends a line
        for data in [*(whole[:n] for n in lengths), whole + b"\0"]:
            path.write_bytes(data)
            with pytest.raises(ValueError, match=r"a\.ply: "):
                dynmesh.read(path)


def test_damaged_ply_files_are_read_or_refused_in_one_line(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    path = tmp_path / "a.ply"
    pieces = [b"\n", b"\r", b" ", b"9", b"-", b"nan", b"1e400", b"\xff" * 4, b"\x85", b"list "]
    messages = []
    for whole in whole_ply_files() * 300:
        data = bytearray(whole)
        place = int(rng.integers(len(data)))
        match rng.integers(3):
            case 0:
                data[place] ^= 1 << int(rng.integers(8))
            case 1:
                data[place:place] = pieces[rng.integers(len(pieces))]
            case 2:
                del data[place : place + int(rng.integers(1, 9))]
        path.write_bytes(data)
        try:
            dynmesh.read(path)
        except ValueError as error:
            messages.append(str(error))
    assert 300 < len(messages) < 1100  # some are refused and some are read
    assert [message for message in messages if len(message.splitlines()) > 1] == []


@pytest.mark.parametrize("order", ["text", "little", "big"])
def test_ply_comes_from_vtk(tmp_path: Path, mesh: Mesh, order: str) -> None:
    path = tmp_path / "a.ply"
    faces = [*mesh.faces.tolist(), [0, 1, 8, 7], [0, 1, 2, 10, 9]]
    expected = mesh.vertices.astype(np.float32)
    writer = vtkPLYWriter()
    surface = as_polydata(expected, mesh.faces)
    surface.SetPolys(as_cells(faces))
    writer.SetInputData(surface)
    writer.SetFileName(str(path))
    writer.SetFileTypeToASCII() if order == "text" else writer.SetFileTypeToBinary()
    writer.SetDataByteOrder(1 if order == "little" else 0)
    writer.Write()
    sequence = dynmesh.read(path)
    assert sequence.polygons is not None
    np.testing.assert_array_equal(sequence.polygons.sizes, [len(face) for face in faces])
    np.testing.assert_array_equal(sequence.polygons.corners, [*chain.from_iterable(faces)])
    if order == "text":  # VTK writes six digits
        np.testing.assert_allclose(sequence.vertices[0], expected, rtol=1e-5)
    else:
        np.testing.assert_array_equal(sequence.vertices[0], expected)


def test_ply_goes_to_vtk(tmp_path: Path, mesh: Mesh) -> None:
    path = tmp_path / "a.ply"
    expected = mesh.vertices.astype(np.float32)
    known = np.ones((1, 49), np.bool_)
    sizes = np.array([4, *[3] * 72, 5])
    corners = np.array([0, 1, 8, 7, *mesh.faces.ravel(), 0, 1, 2, 10, 9])
    faces = triangulate(Polygons(sizes, corners))
    sequence = dynmesh.Sequence(expected[None], faces, known, polygons=Polygons(sizes, corners))
    dynmesh.write(path, sequence)
    reader = vtkPLYReader()
    reader.SetFileName(str(path))
    reader.Update()
    points, cells = reader.GetOutput().GetPoints(), reader.GetOutput().GetPolys()
    np.testing.assert_array_equal(vtk_to_numpy(points.GetData()), expected)
    np.testing.assert_array_equal(np.diff(vtk_to_numpy(cells.GetOffsetsArray())), sizes)
    np.testing.assert_array_equal(vtk_to_numpy(cells.GetConnectivityArray()), corners)


# OBJ


def test_obj_of_other_programs_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_bytes(
        b"# caf\xe9\r\nmtllib a.mtl\r\no body\r\n"
        b"v 0 0 0 0.5 0.5 0.5\r\n  v\t1 0 0 1.0\r\nv nan NaN -nan # lost\r\nv 1e-3 \\\r\n 2 3\r\n"
        b"vt 0 0\r\nvn 0 0 1\r\ng top\r\ns off\r\nusemtl red\r\nl 1 2\r\n"
        b"f 1/1 2/1/1 3//1 -1\r\nf -4 -3 -2\r\nv 9 9 9\r\nf 5 -1 1\r\n"
    )
    sequence = dynmesh.read(path)
    nan = np.nan
    expected = [[[0, 0, 0], [1, 0, 0], [nan, nan, nan], [1e-3, 2, 3], [9, 9, 9]]]
    np.testing.assert_array_equal(sequence.vertices, expected)
    assert sequence.polygons is not None
    np.testing.assert_array_equal(sequence.polygons.sizes, [4, 3, 3])
    np.testing.assert_array_equal(sequence.polygons.corners, [0, 1, 2, 3, 0, 1, 2, 4, 4, 0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no vertices"),
        ("v 0 0\n", "line 1: a vertex has 3 coordinates, not 2"),
        ("\nv 0 x 0\n", "line 2: could not convert string to float: 'x'"),
        ("v nan(1) 0 0\n", r"line 1: could not convert string to float: 'nan\(1\)'"),
        ("v 0 0 0 2\n", "line 1: a vertex has a weight of 1, not 2"),
        (TRIANGLE + "f 1 2\n", "line 5: a face has 2 corners, but needs 3"),
        (TRIANGLE + "f 1 2 0\n", "line 5: there is no vertex 0"),
        (TRIANGLE + "f 1 2 4\n", "line 5: there is no vertex 4, only 3"),
        (TRIANGLE + "f 1 2 99999999999999999999\n", "line 5: there is no vertex 9"),
        (TRIANGLE + "f 1 2 -4\n", "line 5: there is no vertex -4, with 3 before"),
        (TRIANGLE + "vt 0 \\\nf 1 2 9\nf 1 2 4\n", "line 7: there is no vertex 4, only 3"),
        (TRIANGLE + "f 1 2 3.0\n", "line 5: invalid literal"),
        (TRIANGLE + "f 1 2 \\", "ends in the middle of a line"),
    ],
)
def test_damaged_obj_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.obj"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        dynmesh.read(path)
    assert str(caught.value).startswith(f"{path}: ")


ORDINARY_OBJ = [
    TRIANGLE,
    TRIANGLE.replace("\n", "\r\n"),
    TRIANGLE.removesuffix("\n"),
    f"# by hand, in D:\\x\nmtllib a.mtl\no body\n\n{TRIANGLE}",
    TRIANGLE.replace("0\nv", "0\nvt 0 1\nvn 0 0 1\nv").replace("1 2 3", "1/1/1 2/1/1 3/1/1"),
    TRIANGLE.replace("v 0 1 0", "v  -0.1\t1e-3  nan "),
    TRIANGLE.replace("0\n", "0 0.1 0.2 0.3\n"),
    TRIANGLE.replace("0\n", "0 1.0\n"),
    TRIANGLE.replace("1 2 3", "-3 -2//-2 -1/"),
]
UNUSUAL_OBJ = [
    TRIANGLE.replace("v 0", " v 0"),
    TRIANGLE.replace("v 0", "v\t0"),
    TRIANGLE.replace("v 0", "v +0"),
    TRIANGLE.replace("v 1 0", "v 1 \\\n0"),
    TRIANGLE.replace("v 1 0 0", "v 1 0 0 # one"),
    TRIANGLE.replace("\n", "\r"),
    TRIANGLE.replace("f 1 2", "f +1 2"),
    TRIANGLE.replace("f 1", "f\x0b1"),
    TRIANGLE.replace("f", "g a \\\nf 9 9 9\nf"),
    TRIANGLE.replace("f", "g a\rf 3 2 1\nf"),
    TRIANGLE.replace("1 0 0", "1e-999 0 0"),
]


@pytest.mark.parametrize("text", ORDINARY_OBJ + UNUSUAL_OBJ)
def test_both_obj_readers_agree(tmp_path: Path, text: str) -> None:
    data = text.encode()
    fast = plain_obj(data)
    assert (fast is not None) == (text in ORDINARY_OBJ)
    frame, polygons = line_by_line(data)
    if fast is not None:
        for one, other in zip(fast, (frame.points, *polygons), strict=True):
            np.testing.assert_array_equal(one, other)
            assert one.dtype == other.dtype
    (tmp_path / "a.obj").write_bytes(data)
    np.testing.assert_array_equal(dynmesh.read(tmp_path / "a.obj").vertices, [frame.points])


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
def test_both_obj_readers_agree_on_any_text(text: str) -> None:
    data = f"{TRIANGLE}{text}".encode("latin-1")
    fast = plain_obj(data)
    if fast is not None:
        frame, polygons = line_by_line(data)
        for one, other in zip(fast, (frame.points, *polygons), strict=True):
            np.testing.assert_array_equal(one, other)


def test_obj_of_dynmesh_and_vtk_is_read_fast(tmp_path: Path, mesh: Mesh) -> None:
    vertices = np.random.default_rng(0).normal(size=mesh.vertices.shape)
    vertices[::2] = np.nan
    dynmesh.write(tmp_path / "a.obj", dynmesh.Sequence(vertices[None], mesh.faces))
    writer = vtkOBJWriter()
    surface = as_polydata(mesh.vertices.astype(np.float32), mesh.faces)
    surface.GetPointData().SetNormals(numpy_to_vtk(np.ones((49, 3), np.float32)))
    writer.SetInputData(surface)
    writer.SetFileName(str(tmp_path / "b.obj"))
    writer.Write()
    assert b"\nvn " in (tmp_path / "b.obj").read_bytes()
    for name in ("a.obj", "b.obj"):
        assert plain_obj((tmp_path / name).read_bytes()) is not None


def test_unknown_vertices_become_nan_in_obj(tmp_path: Path, mesh: Mesh) -> None:
    vertices = sequence_of(mesh, 2).vertices
    known = np.random.default_rng(0).random((2, 49)) < 0.5
    dynmesh.write(tmp_path / "f%d.obj", dynmesh.Sequence(vertices, mesh.faces, known))
    again = dynmesh.read(tmp_path / "f%d.obj").vertices
    np.testing.assert_array_equal(again, np.where(known[..., None], vertices, np.nan))


def test_obj_goes_to_and_from_vtk(tmp_path: Path, mesh: Mesh) -> None:
    path = str(tmp_path / "a.obj")
    writer = vtkOBJWriter()
    writer.SetInputData(as_polydata(mesh.vertices.astype(np.float32), mesh.faces))
    writer.SetFileName(path)
    writer.Write()
    sequence = dynmesh.read(path)
    np.testing.assert_allclose(sequence.vertices[0], mesh.vertices, rtol=1e-5)  # six digits
    np.testing.assert_array_equal(sequence.faces, mesh.faces)

    vertices = mesh.vertices.astype(np.float32)
    dynmesh.write(path, dynmesh.Sequence(vertices[None], mesh.faces))
    reader = vtkOBJReader()
    reader.SetFileName(path)
    reader.Update()
    points, faces = parts(reader.GetOutput())
    np.testing.assert_array_equal(points, vertices)
    np.testing.assert_array_equal(faces, mesh.faces)
