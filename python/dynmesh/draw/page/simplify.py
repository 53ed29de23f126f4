"""Simplification of a mesh to a subset of its vertices."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._arrays import Positions
from ..._errors import InputError, require


def thin(
    faces: NDArray[np.integer[Any]], points: Positions, max_vertices: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Chooses vertices and triangles that represent a mesh.

    Edges are collapsed where the surface is flat, always onto one of their ends, so that the values
    of the kept vertices remain valid in all other frames. More than `max_vertices` are kept if
    non-manifold triangles prevent collapses, and those in no triangle are removed first.

    Returns:
        (v,) the numbers of the kept vertices and (t, 3) triangles of these v.
    """
    if len(points) <= max_vertices:
        return np.arange(len(points)), np.asarray(faces, np.intp)
    if not np.isfinite(points).all():
        vertex = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise InputError(
            f"the first frame lacks vertex {vertex}, but is needed to simplify a large mesh"
        )
    pyvista = require("pyvista", extra="view")
    a, b, c = faces.T
    proper = faces[(a != b) & (b != c) & (c != a)]
    used = np.unique(proper)
    if len(used) <= max_vertices:
        return used, np.searchsorted(used, proper)
    surface = pyvista.PolyData.from_regular_faces(points[used], np.searchsorted(used, proper))
    surface["vertex"] = used
    with pyvista.vtk_verbosity("off"):
        thinned = surface.decimate_pro(
            1 - max_vertices / len(used), preserve_topology=True, splitting=False
        )
    return np.asarray(thinned["vertex"], np.intp), np.asarray(thinned.regular_faces, np.intp)
