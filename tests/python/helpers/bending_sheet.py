"""Frames of a sheet that bends and twists."""

from typing import Any

import numpy as np
from meshes import Array, Mesh


def bent(vertices: Array, amounts: Any) -> Array:
    """Frames of a sheet that bends and twists by these amounts."""
    x, y, z = vertices.T
    frames = []
    for bend, twist in amounts:
        height = 0.05 * bend * (x - x.mean()) ** 2 + 0.08 * twist * x * np.sin(0.7 * y)
        frames.append(np.stack([x, y + 0.1 * bend * x, z + height], axis=1))
    return np.stack(frames)


def poses(vertices: Array, n: int, rng: np.random.Generator) -> Array:
    """By random amounts."""
    return bent(vertices, rng.normal(size=(n, 2)))


def swinging(vertices: Array, n: int) -> Array:
    """Each with its own period, again and again."""
    return bent(vertices, [(np.sin(0.7 * time), np.cos(0.45 * time) - 1) for time in range(n)])


def travelling(mesh: Mesh, n: int) -> Array:
    """Waves, so that the shape of frame 0 does not help."""
    x, y, _ = mesh.vertices.T
    height = np.sin(0.8 * x + 0.1 * n) * np.cos(0.6 * y - 0.07 * n)
    return np.asarray(mesh.vertices + 0.3 * height[:, None] * [0, 0, 1])
