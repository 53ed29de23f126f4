"""Sequences with one file per frame: names, PLY and OBJ."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array, Mesh
from vtk_meshes import as_polydata, parts
from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkOBJWriter
from vtkmodules.vtkIOPLY import vtkPLYReader, vtkPLYWriter

import dynmesh
from dynmesh import files
from dynmesh.polygons import Polygons, triangulate

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def sequence_of(mesh: Mesh, n: int = 3, dtype: Any = np.float32) -> dynmesh.Sequence:
    shift = np.arange(n).reshape(n, 1, 1) / 3
    return dynmesh.Sequence((mesh.vertices + shift).astype(dtype), mesh.faces)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def interrupt(writer: files.Writer, frames: Array) -> None:
    """Writes some frames and no more."""
    with pytest.raises(KeyboardInterrupt), writer:  # noqa: PT012
        for points in frames:
            writer.append(points)
        raise KeyboardInterrupt


def ply(elements: str, body: bytes, *, format: str = "ascii", head: str = "") -> bytes:
    """A PLY file; the elements as `vertex 3: float x, float y, float z; face 1: ...`."""
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
    (folder / f"._f3{suffix}").touch()  # as macOS leaves beside its files
    np.testing.assert_array_equal(dynmesh.read(folder).vertices, sequence.vertices)
    one = dynmesh.read(folder / f"f10{suffix}")
    np.testing.assert_array_equal(one.vertices, sequence.vertices[10:11])


def test_a_folder_is_written_and_read(tmp_path: Path, mesh: Mesh) -> None:
    sequence = sequence_of(mesh)
    folder = tmp_path / "walk"
    dynmesh.write(folder, sequence, format="ply")
    assert names(folder) == ["frame_0000.ply", "frame_0001.ply", "frame_0002.ply"]
    dynmesh.write(folder, sequence_of(mesh, 2))  # its format shows
    assert names(folder) == ["frame_0000.ply", "frame_0001.ply"]
    assert names(tmp_path) == ["walk"]

    (folder / "scan.ply").touch()
    with pytest.raises(ValueError, match=r"walk: holds scan\.ply, which is not called frame_%04d"):
        dynmesh.write(folder, sequence)
    (folder / "scan.ply").rename(folder / "scan.obj")
    with pytest.raises(
        ValueError, match=r"both \.ply and \.obj files: name the format with --form"
    ):
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
    assert dynmesh.open(tmp_path / "f_%04d.obj").n_frames == 4  # from any number on
    for path in ("g_%04d.obj", "g*.obj", "g.obj", "nowhere/f_%d.obj"):
        with pytest.raises(FileNotFoundError):
            dynmesh.open(tmp_path / path)


def test_a_shorter_sequence_replaces_a_longer_one(tmp_path: Path, mesh: Mesh) -> None:
    path = tmp_path / "f_%03d.ply"
    dynmesh.write(path, sequence_of(mesh, 1002))
    (tmp_path / "f_12.ply").touch()
    (tmp_path / "g_001.ply").touch()
    assert len(files.existing(path)) == 1002
    assert files.existing(path)[-1].name == "f_1001.ply"
    dynmesh.write(path, sequence_of(mesh, 2))
    assert names(tmp_path) == ["f_000.ply", "f_001.ply", "f_12.ply", "g_001.ply"]
    assert dynmesh.read(path).vertices.shape == (2, 49, 3)


def test_what_cannot_be_written_leaves_nothing(tmp_path: Path, mesh: Mesh) -> None:
    sequence = sequence_of(mesh)
    for path, message in (
        ("body.ply", r"one file holds one frame, not 3: write body_%04d\.ply"),
        ("a*.ply", r"a glob is only read; write frame_%04d\.ply"),
    ):
        with pytest.raises(ValueError, match=message):
            dynmesh.write(tmp_path / path, sequence)
    traced = np.zeros((3, 49), np.int32)
    with pytest.raises(ValueError, match="holds no generation and age"):
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
        interrupt(files.begin(tmp_path / folder / "f%d.ply", header), sequence.vertices[:1])
    assert names(tmp_path) == ["old"]
    assert names(tmp_path / "old") == []


def test_an_interrupted_sequence_goes_on(tmp_path: Path, mesh: Mesh) -> None:
    sequence = sequence_of(mesh, 5)
    path, folder = tmp_path / "f_%04d.ply", tmp_path / "work"
    header = files.Header(mesh.faces, 5, 49, np.dtype(np.float32))
    again = sequence.vertices[[0, 1, 1, 1]]  # the last two are not to count
    interrupt(files.begin(path, header, folder=folder), again)
    assert len(names(folder)) == 4
    with pytest.raises(ValueError, match=r"the unfinished f_0004\.ply is missing"):
        files.begin(path, header, folder=folder, resume_at=5)
    with files.begin(path, header, folder=folder, resume_at=2) as writer:
        assert len(names(folder)) == 2
        for points in sequence.vertices[2:]:
            writer.append(points)
    np.testing.assert_array_equal(dynmesh.read(path).vertices, sequence.vertices)
    assert names(tmp_path) == [f"f_000{i}.ply" for i in range(5)]


# Frames that fit together


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


def test_later_frames_may_be_points_alone(tmp_path: Path) -> None:
    (tmp_path / "f0.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    with pytest.raises(ValueError, match="has points alone, but the first frame needs faces"):
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
        (b"ply", "no PLY file"),
        (b"solid cube\n", "no PLY file: line 1: expected 'ply'"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS), "face.*early end-of-file"),
        (
            ply(f"vertex 2: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 2\n"),
            "face.*expected end-of-line",
        ),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 2\n" * 2), "goes on after"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 two\n"), "malformed input"),
        (
            ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 3\n"),
            "face 0: has the vertex 3",
        ),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 -1\n"), "has the vertex -1"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"2 0 1\n"), "face 0: has 2 corners"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"0\n"), "face 0: has 0 corners"),
        (ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"300 0 1 2\n"), "out of bounds"),
        (ply(f"vertex -3: {XYZ}", POINTS), "negative"),
        (ply(f"vertex 0: {XYZ}; face 0: {FACE}", b""), "has no vertices"),
        (ply(f"vertex 999999999999999: {XYZ}; face 1: {FACE}", b""), "more than there can be"),
        (ply("face 0: list uchar int a", b""), "has no vertices"),
        (ply("vertex 1: float x, float y", b"0 0\n"), "need a property 'z', float or double"),
        (ply("vertex 3: float x, float y, int z", POINTS), "need a property 'z'"),
        (ply("vertex 1: quad x", b"1\n"), "line 4"),
        (
            ply(f"vertex 3: {XYZ}; face 1: list uchar float vertex_indices", POINTS + b"3 0 1 2\n"),
            "list uchar float vertex_indices' must be a list of integers",
        ),
        (
            ply(f"vertex 3: {XYZ}; face 1: int vertex_indices", POINTS + b"3\n"),
            "'property int vertex_indices' must be a list",
        ),
        (
            ply(f"vertex 3: {XYZ}; face 1: list uchar int corners", POINTS + b"3 0 1 2\n"),
            "its faces need a list 'vertex_indices'",
        ),
        (ply(f"vertex 1: {XYZ}, uchar known", b"0 0 0 2\n"), "'known' must be uchar, 0 or 1"),
        (ply(f"vertex 1: {XYZ}, float known", b"0 0 0 1\n"), "'known' must be uchar, 0 or 1"),
        (
            ply(f"vertex 1: {XYZ}, float generation, int age", b"0 0 0 1 1\n"),
            "'generation' must be int",
        ),
        (binary_ply("<", "vertex_index", "float")[:-1], "face.*early end-of-file"),
        (binary_ply("<", "vertex_index", "float")[:-20], "vertex.*early end-of-file"),
        (binary_ply(">", "vertex_index", "float") + b"\1", "goes on after"),
    ],
)
def test_damaged_ply_is_refused(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(data)
    with pytest.raises(ValueError, match=message) as caught:
        dynmesh.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("binary", [True, False])
def test_ply_goes_to_and_from_vtk(tmp_path: Path, mesh: Mesh, binary: bool) -> None:
    path = str(tmp_path / "a.ply")
    writer = vtkPLYWriter()
    writer.SetInputData(as_polydata(mesh.vertices.astype(np.float32), mesh.faces))
    writer.SetFileName(path)
    writer.SetFileTypeToBinary() if binary else writer.SetFileTypeToASCII()
    writer.Write()
    sequence = dynmesh.read(path)
    np.testing.assert_array_equal(sequence.faces, mesh.faces)
    expected = mesh.vertices.astype(np.float32)
    if binary:
        np.testing.assert_array_equal(sequence.vertices[0], expected)
    else:  # VTK writes six digits
        np.testing.assert_allclose(sequence.vertices[0], expected, rtol=1e-5)

    known = np.ones((1, 49), np.bool_)
    dynmesh.write(path, dynmesh.Sequence(expected[None], mesh.faces, known))
    reader = vtkPLYReader()
    reader.SetFileName(path)
    reader.Update()
    points, faces = parts(reader.GetOutput())
    np.testing.assert_array_equal(points, expected)
    np.testing.assert_array_equal(faces, mesh.faces)


# OBJ


def test_obj_as_others_write_it(tmp_path: Path) -> None:
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
        ("v 0 0 0 2\n", "line 1: a vertex has a weight of 1, not 2"),
        (TRIANGLE + "f 1 2\n", "line 5: a face has 2 corners, but needs 3"),
        (TRIANGLE + "f 1 2 0\n", "line 5: there is no vertex 0"),
        (TRIANGLE + "f 1 2 4\n", "line 5: there is no vertex 4, only 3"),
        (TRIANGLE + "f 1 2 99999999999999999999\n", "line 5: there is no vertex 9"),
        (TRIANGLE + "f 1 2 -4\n", "line 5: there is no vertex -4, with 3 before"),
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
