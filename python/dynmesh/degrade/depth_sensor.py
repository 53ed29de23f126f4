"""What a depth sensor makes of exact depths: nothing edge-on, and mixtures at silhouettes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .depth_buffer import DepthBuffer, intrinsics_of, pose_of
from .scene import EDGE_ON, FLIGHT, Scene
from .shared import unit
from .visibility import Camera

_Integers = NDArray[np.integer[Any]]
_Floats = NDArray[np.float64]

_JUMP = 3.0
"""Pixels whose depths differ by more than this many mean edges are on different surfaces."""


def measured(buffer: DepthBuffer, scene: Scene, camera: Camera) -> _Floats:
    """Returns the depths, infinite where nothing is measured."""
    row, column = np.nonzero(buffer.triangle >= 0)
    corners = scene.faces[buffer.triangle[row, column]]
    a, b, c = scene.points.astype(np.float64)[corners.T]
    height, width = buffer.depth.shape
    pixels = np.stack([column, row, np.ones(len(row))], axis=1)
    to_rays = pose_of(camera)[:3, :3] @ np.linalg.inv(intrinsics_of(camera, width, height))
    normals = np.cross(b - a, c - a)
    cosines = (unit(normals) * unit(pixels @ to_rays.T)).sum(axis=1)
    nearest = buffer.weights[row, column].argmax(axis=1)
    present = scene.present[corners[np.arange(len(corners)), nearest]]
    seen = present & (np.abs(cosines) > EDGE_ON)
    depth = buffer.depth.copy()
    depth[row[~seen], column[~seen]] = np.inf
    return depth


def with_flying(
    depth: _Floats, share: float, mean_edge: float, rng: "np.random.Generator"
) -> _Floats:
    """Replaces some of the pixels at silhouettes by mixtures with what is behind them."""
    behind = np.full_like(depth, -np.inf)  # the farthest of the neighbours
    for axis in (0, 1):
        for step in (1, -1):
            beside = np.roll(depth, step, axis=axis)
            edge = [slice(None), slice(None)]
            edge[axis] = slice(0, 1) if step == 1 else slice(-1, None)
            beside[tuple(edge)] = -np.inf
            behind = np.maximum(behind, beside)
    measured = np.isfinite(depth)
    places = np.flatnonzero(measured & (behind > np.where(measured, depth, 0) + _JUMP * mean_edge))
    n = min(len(places), round(share * np.count_nonzero(measured)))
    chosen = rng.choice(places, n, replace=False) if n else places[:0]
    mixed = depth.copy()
    near, far = depth.flat[chosen], behind.flat[chosen]
    mixed.flat[chosen] += rng.random(n) * np.minimum(far - near, FLIGHT * mean_edge)
    return mixed
