"""OBJ files, read fast and line by line, and damaged ones."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from meshes import Mesh
from plain_files import TRIANGLE
from vtk_meshes import as_polydata, parts
from vtkmodules.util import numpy_support
from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkOBJWriter

import dynmesh
from dynmesh._core import plain_obj
from dynmesh.files.obj import line_by_line

numpy_to_vtk: Any = numpy_support.numpy_to_vtk
vtk_to_numpy: Any = numpy_support.vtk_to_numpy


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
    vertices = np.stack([mesh.vertices, mesh.vertices + 1]).astype(np.float32)
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
