"""Meshes of VTK, for tests with VTK's own readers and writers."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from meshes import Array
from vtkmodules.util import numpy_support
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

_support: Any = numpy_support  # it has no type annotations


def as_array(values: Any, name: str = "") -> Any:
    """A VTK array."""
    array = _support.numpy_to_vtk(values, deep=True)
    array.SetName(name)
    return array


def as_cells(lists: Iterable[Sequence[int]]) -> Any:
    """Creates polygons, lines or other cells with these corners."""
    cells = vtkCellArray()
    for corners in lists:
        cells.InsertNextCell(len(corners), [int(corner) for corner in corners])
    return cells


def as_polydata(vertices: Array, faces: Array) -> Any:
    """A mesh."""
    points, mesh = vtkPoints(), vtkPolyData()
    points.SetData(as_array(vertices))
    mesh.SetPoints(points)
    mesh.SetPolys(as_cells(faces))
    return mesh


def parts(mesh: Any) -> tuple[Array, Array]:
    """Returns the vertices and the triangles of a mesh."""
    vertices = _support.vtk_to_numpy(mesh.GetPoints().GetData())
    return vertices, _support.vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)


def point_data(mesh: Any, name: str) -> Array:
    """Returns the point data with this name."""
    return np.asarray(_support.vtk_to_numpy(mesh.GetPointData().GetArray(name)))
