"""Points on the surface that cameras see, spread evenly."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .scene import EDGE_ON, Scene
from .shared import unit
from .visibility import visible

_Integers = NDArray[np.integer[Any]]
_Floats = NDArray[np.float64]

_CANDIDATES = 100_000
_ROUNDS = 20
"""At most so many points are tried at a time, and so many times, until enough of them are seen."""


def sampled(scene: Scene, wanted: int, rng: "np.random.Generator") -> tuple[_Floats, _Floats]:
    """Returns (n, 3) points on the surface that cameras see, and their normals."""
    faces = scene.faces
    corners = scene.points.astype(np.float64)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    areas[~np.isfinite(areas)] = 0
    normals = unit(np.nan_to_num(normals))
    found, sides = [np.zeros((0, 3))], [np.zeros((0, 3))]
    n_found = n_tried = 0
    for _ in range(_ROUNDS if areas.any() else 0):
        share = max(n_found / n_tried, 0.05) if n_tried else 0.3
        n = int(np.clip(1.1 * (wanted - n_found) / share, 1000, _CANDIDATES))
        face = rng.choice(len(faces), n, p=areas / areas.sum())
        # Uniform numbers in the unit square become uniform weights of the corners of a triangle.
        uniform, along = rng.random((n, 2)).T
        root = np.sqrt(uniform)
        weights = np.stack([1 - root, root * (1 - along), root * along], axis=1)
        points = np.einsum("nc,ncx->nx", weights, corners[face])
        nearest = faces[face, weights.argmax(axis=1)]
        side = _seen_from(scene, points, normals[face]) * scene.present[nearest]
        seen = side != 0
        found.append(points[seen])
        sides.append(side[seen, None] * normals[face][seen])
        n_found, n_tried = n_found + int(seen.sum()), n_tried + n
        if n_found >= wanted:
            break
    return np.concatenate(found)[:wanted], np.concatenate(sides)[:wanted]


def _seen_from(scene: Scene, points: _Floats, normals: _Floats) -> NDArray[np.float64]:
    """Returns for each point 1 or -1, the side from which it is seen best, or 0 if it is not."""
    best = np.zeros(len(points))
    # Points that belong to no triangle hide nothing; all else is as for vertices.
    everything = np.concatenate([scene.points.astype(np.float64), points])
    vertices = np.zeros(len(scene.points), np.bool_)
    for camera in scene.cameras:
        cosines = np.einsum("nx,nx->n", normals, unit(np.array(camera.position) - points))
        better = np.abs(cosines) > np.maximum(np.abs(best), EDGE_ON)
        seen = visible(everything, scene.faces, camera, np.concatenate([vertices, better]))
        best = np.where(seen[len(vertices) :], cosines, best)
    return np.sign(best)
