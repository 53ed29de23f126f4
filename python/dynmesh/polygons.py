"""Meshes of arbitrary polygons, and the triangles that represent them."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError, KindError


class Polygons(NamedTuple):
    """The faces of a mesh as its file holds them, if some of them are not triangles."""

    sizes: NDArray[np.integer[Any]]
    """(p,) the number of corners of each polygon, at least 3."""
    corners: NDArray[np.integer[Any]]
    """(sum of sizes,) the vertices of all corners, one polygon after another."""


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
        raise ValueError(f"face {index}: has {polygons.sizes[index]} corners, but needs 3")
    if polygons.sizes.sum() != len(polygons.corners):
        raise InputError(
            f"sizes announce {polygons.sizes.sum()} corners, "
            f"but corners holds {len(polygons.corners)}",
            argument="polygons",
        )


def triangulate(polygons: Polygons) -> NDArray[np.integer[Any]]:
    """Cuts every polygon into a fan of triangles around its first corner.

    Returns:
        (m, 3) in the order of the polygons, with the same winding.

    Raises:
        TypeError, ValueError: the polygons are inconsistent.
    """
    check_polygons(polygons)
    sizes = polygons.sizes.astype(np.intp)
    n_triangles = sizes - 2
    first = np.repeat(np.cumsum(sizes) - sizes, n_triangles)  # where each fan's polygon begins
    begin = np.cumsum(n_triangles) - n_triangles
    step = np.arange(n_triangles.sum()) - np.repeat(begin, n_triangles)
    fans = np.stack([first, first + step + 1, first + step + 2], axis=1)
    return np.asarray(polygons.corners[fans])


def split_polygons(
    polygons: Polygons,
) -> tuple[NDArray[np.integer[Any]], Polygons | None]:
    """Returns the triangles, and also the polygons unless all of them are triangles."""
    faces = triangulate(polygons)
    return faces, None if len(faces) == len(polygons.sizes) else polygons


def as_polygons(faces: NDArray[np.integer[Any]], polygons: Polygons | None = None) -> Polygons:
    """Returns the polygons or, if there are none, the triangles as polygons."""
    if polygons is not None:
        return polygons
    return Polygons(np.full(len(faces), 3, np.int32), faces.reshape(-1))
