"""What a depth sensor makes of exact depths: nothing edge-on."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .depth_buffer import DepthBuffer, intrinsics_of, pose_of
from .scene import EDGE_ON, Scene
from .shared import unit
from .visibility import Camera

_Integers = NDArray[np.integer[Any]]
_Floats = NDArray[np.float64]


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
