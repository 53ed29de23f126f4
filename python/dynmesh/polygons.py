"""Meshes of arbitrary polygons, and the triangles that represent them."""

import contextlib
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ._checks import native, refuse_mask
from ._errors import InputError, KindError

__all__ = ["Faces", "Mesh", "Polygons"]


class Polygons(NamedTuple):
    """The faces of a mesh as its file holds them, if some of them are not triangles."""

    sizes: NDArray[np.integer[Any]]
    """(p,) the number of corners of each polygon, at least 3."""
    corners: NDArray[np.integer[Any]]
    """(sum of sizes,) the vertices of all corners, one polygon after another."""


class Mesh(Protocol):
    """A mesh of another library: a `trimesh.Trimesh`, or a `pyvista.PolyData`."""

    faces: Any
    """(m, 3) integers, or the faces as VTK pads them."""


Faces: TypeAlias = NDArray[np.integer[Any]] | Polygons | Sequence[Sequence[int]]
"""The faces of a mesh as functions take them: (m, 3) triangles, (m, 4) quads and so on, polygons or
a list of lists of vertices. They are cut into triangles, as those of files are."""


def check_polygons(polygons: Polygons) -> None:
    """Raises an error unless the polygons are consistent."""
    if not isinstance(polygons, Polygons):
        raise KindError(f"must be Polygons, not {type(polygons).__name__}", argument="polygons")
    for name, values in zip(("sizes", "corners"), polygons, strict=True):
        if values.dtype.kind not in "iu":
            raise KindError(f"{name} must be integers, not {values.dtype}", argument="polygons")
        if values.ndim != 1:
            raise InputError(
                f"{name} must have one axis, not shape {values.shape}", argument="polygons"
            )
    if len(polygons.sizes) and polygons.sizes.min() < 3:
        index = int(polygons.sizes.argmin())
        message = f"polygon {index} has {polygons.sizes[index]} corners, but needs at least 3"
        raise InputError(message, argument="faces")
    if polygons.sizes.sum() != len(polygons.corners):
        raise InputError(
            f"sizes announce {polygons.sizes.sum()} corners, "
            f"but corners holds {len(polygons.corners)}",
            argument="polygons",
        )


def split_polygons(
    polygons: Polygons,
) -> tuple[NDArray[np.integer[Any]], Polygons | None]:
    """Cuts every polygon into a fan of triangles around its first corner.

    Returns:
        (m, 3) in the order of the polygons, with the same winding, and also the polygons unless all
        of them are triangles.
    """
    check_polygons(polygons)
    sizes = polygons.sizes.astype(np.intp)
    n_triangles = sizes - 2
    first = np.repeat(np.cumsum(sizes) - sizes, n_triangles)  # where each fan's polygon begins
    begin = np.cumsum(n_triangles) - n_triangles
    step = np.arange(n_triangles.sum()) - np.repeat(begin, n_triangles)
    fans = np.stack([first, first + step + 1, first + step + 2], axis=1)
    return polygons.corners[fans], None if len(fans) == len(sizes) else polygons


def mesh_arrays(mesh: Any) -> tuple[Faces, NDArray[Any]] | None:
    """Returns the faces and positions of a mesh of another library; None if it is none."""
    points = getattr(mesh, "points", getattr(mesh, "vertices", None))
    if points is None or not hasattr(mesh, "faces"):
        return None
    faces = np.asarray(mesh.faces)
    if faces.ndim != 1:
        return faces, np.asarray(points)
    rows, begin = [], 0  # as VTK pads them: the number of corners, then the corners
    while begin < len(faces):
        end = begin + 1 + int(faces[begin])
        rows.append(faces[begin + 1 : end])
        begin = end
    sizes = np.array([len(row) for row in rows], np.int64)
    corners = np.concatenate(rows) if rows else np.empty(0, np.int64)
    return Polygons(sizes, corners), np.asarray(points)


def split_faces(
    faces: Faces, n_vertices: int | None = None
) -> tuple[NDArray[np.integer[Any]], Polygons | None]:
    """Returns the triangles of faces, and also the polygons unless all of them are triangles.

    Without `n_vertices`, corners may be any numbers from 0 on. (m, 3) integers, whose corners may
    be equal, and what cannot be polygons are returned as an array that is not checked.
    """
    refuse_mask("faces", faces)
    polygons = faces if isinstance(faces, Polygons) else _polygons_of(faces)
    if not isinstance(polygons, Polygons):
        return native(polygons), None
    polygons = Polygons(*map(native, map(np.asarray, polygons)))
    _check_corners(polygons, n_vertices)
    return split_polygons(polygons)


def _polygons_of(faces: Any) -> Polygons | NDArray[Any]:
    try:
        array = np.asarray(faces)
    except ValueError:  # their lengths differ
        rows = [_corners_of(index, polygon) for index, polygon in enumerate(faces)]
        return Polygons(np.array([len(row) for row in rows]), np.concatenate(rows))
    if array.ndim != 2 or array.shape[1] in (0, 3) or array.dtype.kind not in "iu":
        return array
    return Polygons(np.full(len(array), array.shape[1]), array.reshape(-1))


def _corners_of(index: int, polygon: Any) -> NDArray[np.integer[Any]]:
    with contextlib.suppress(ValueError):
        row = np.asarray(polygon)
        if row.ndim == 1 and (row.dtype.kind in "iu" or len(row) == 0):
            return row.astype(np.int64) if len(row) == 0 else row
    raise KindError(f"polygon {index} must be integers, not {polygon!r}", argument="faces")


def _check_corners(polygons: Polygons, n_vertices: int | None) -> None:
    check_polygons(polygons)
    sizes, corners = polygons
    owner = np.repeat(np.arange(len(sizes)), sizes)
    check_exist(corners, owner, n_vertices, "polygon")
    order = np.lexsort((corners, owner))
    twice = np.flatnonzero((np.diff(corners[order]) == 0) & (np.diff(owner[order]) == 0))
    if len(twice):
        corner = order[twice[0]]
        raise InputError(
            f"polygon {owner[corner]} has the corner {corners[corner]} twice", argument="faces"
        )


def check_exist(
    corners: NDArray[Any], owner: NDArray[np.intp], n_vertices: int | None, what: str = "face"
) -> None:
    """Raises an error if a corner, of the face with that number, is no vertex."""
    outside, vertices = corners < 0, "vertices are"
    if n_vertices is not None:
        outside |= corners >= n_vertices
        vertices = f"the mesh has {n_vertices} vertices,"
    if outside.any():
        message = f"{what} {owner[outside][0]} refers to vertex {corners[outside][0]}"
        message += f", but {vertices} counted from 0"
        raise InputError(message, argument="faces")


def as_polygons(faces: NDArray[np.integer[Any]], polygons: Polygons | None = None) -> Polygons:
    """Returns the polygons or, if there are none, the triangles as polygons."""
    if polygons is not None:
        return polygons
    return Polygons(np.full(len(faces), 3, np.int32), faces.reshape(-1))


def turned(polygons: Polygons) -> Polygons:
    """Returns the polygons with the corners in reverse order."""
    check_polygons(polygons)
    return Polygons(polygons.sizes, polygons.corners[reversal(polygons.sizes)])


def reversal(sizes: NDArray[np.integer[Any]]) -> NDArray[np.integer[Any]]:
    """Returns the places of the corners of polygons, each of which is turned."""
    last = np.repeat(2 * np.cumsum(sizes) - sizes - 1, sizes)
    return np.asarray(last - np.arange(len(last)))
