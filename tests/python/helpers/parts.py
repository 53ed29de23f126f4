"""Subjects of several parts by formula, and how each part moves."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import trimesh
from meshes import Array, Mesh, join
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


class Part(NamedTuple):
    mesh: Mesh
    moved: Callable[[Array, int], Array]
    """Its vertices in a frame."""


def ball(subdivisions: int, radii: tuple[float, float, float], centre: Array) -> Mesh:
    """A rounded body without symmetry, whose points tell how it turns."""
    made = trimesh.creation.icosphere(subdivisions)
    x, y, z = made.vertices.T
    size = 1 + 0.12 * np.sin(2.1 * y + 0.7) + 0.1 * np.cos(2.7 * z) + 0.12 * (x * x - y * y)
    vertices = made.vertices * size[:, None] * radii + centre
    return Mesh(np.asarray(made.faces, np.int64), vertices)


def turned(axis: tuple[float, float, float], angle: float, points: Array, about: Array) -> Array:
    rotation = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis))
    return np.asarray(rotation.apply(points - about) + about)


def on_joints(x: Array, frame: int, link: int) -> Array:
    """Moves a link of a chain along x, each of which turns on the one before."""
    for joint in range(link, -1, -1):
        about = np.array([0.98 * joint - 0.49, 0, 0])
        x = turned((0, 0.3, 1), 0.05 * frame * (1 if joint % 2 else 0.6), x, about)
    return x


def joined(parts: list[Part], n: int) -> tuple[NDArray[np.int64], Array, NDArray[np.int64]]:
    """The faces, the frames (n, k, 3), and the number of the part of each vertex."""
    whole = join(*(part.mesh for part in parts))
    frames = [np.concatenate([p.moved(p.mesh.vertices, i) for p in parts]) for i in range(n)]
    labels = np.repeat(np.arange(len(parts)), [len(part.mesh.vertices) for part in parts])
    return whole.faces, np.array(frames), labels
