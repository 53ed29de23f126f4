"""Meshes of any polygons, and the triangles that stand for them."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError, KindError


class Polygons(NamedTuple):
    """The faces of a mesh as its file has them, where some are no triangles."""

    sizes: NDArray[np.integer[Any]]
    """(p,) how many corners each polygon has, at least 3."""
    corners: NDArray[np.integer[Any]]
    """(sum of sizes,) the vertices of all corners, polygon after polygon."""


def check_polygons(polygons: Polygons) -> None:
    """Refuses what cannot be polygons."""
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
            f"{polygons.sizes.sum()} corners are announced, but there are {len(polygons.corners)}",
            argument="polygons",
        )


def triangulate(polygons: Polygons) -> NDArray[np.integer[Any]]:
    """Cuts every polygon into a fan of triangles around its first corner.

    Returns:
        (m, 3) in the order of the polygons; the winding stays.

    Raises:
        TypeError, ValueError: these are no polygons.
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
    """The triangles, and the polygons themselves only where they say more than the triangles."""
    faces = triangulate(polygons)
    return faces, None if len(faces) == len(polygons.sizes) else polygons


def as_polygons(faces: NDArray[np.integer[Any]], polygons: Polygons | None = None) -> Polygons:
    """What a file shall hold: the polygons, or else the triangles as polygons."""
    if polygons is not None:
        return polygons
    return Polygons(np.full(len(faces), 3, np.int32), faces.reshape(-1))
