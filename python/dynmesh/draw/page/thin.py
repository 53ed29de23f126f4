"""Fewer vertices, each of them one of the original ones."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._extras import require
from ...sequence import Positions


def thin(
    faces: NDArray[np.integer[Any]], points: Positions, max_vertices: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Chooses vertices and triangles that show a mesh.

    Edges are collapsed where the surface is flat, always onto one of their ends, so what is known
    of the kept vertices in other frames holds for them exactly.

    Args:
        faces: (m, 3) integers.
        points: (k, 3) positions; all finite if there are more than `max_vertices`.
        max_vertices: about as many are kept; more where triangles meet in ways that no collapse can
            keep. Vertices of no triangle go first.

    Returns:
        (v,) the numbers of the kept vertices and (t, 3) triangles of these v.
    """
    if len(points) <= max_vertices:
        return np.arange(len(points)), np.asarray(faces, np.intp)
    if not np.isfinite(points).all():
        vertex = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise ValueError(f"frame 0 lacks vertex {vertex}, but large meshes are thinned by frame 0")
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
