"""Points measured on the surface of a mesh, and how far a result is from the true vertices."""

from functools import cache
from typing import Any

import numpy as np
from meshes import Array, Mesh, bumpy_torus

import dynmesh

TORUS = bumpy_torus(24)


@cache
def person() -> tuple[Mesh, Array]:
    """A person, and another pose."""
    frames = dynmesh.synth.walker(12)
    vertices = frames.vertices.astype(np.float64)
    return Mesh(frames.faces.astype(np.int64), vertices[0]), vertices[1]


def vertex_normals(faces: Array, vertices: Array) -> Array:
    a, b, c = (vertices[faces[:, n]] for n in range(3))
    normals = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], np.cross(b - a, c - a))
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def bent(vertices: Array, amount: float) -> Array:
    """Bends the surface about y, more the farther out."""
    x, y, z = vertices.T
    angle = amount * x / 4
    return np.stack([x * np.cos(angle), y, z + x * np.sin(angle)], axis=1)


def scan_of(
    mesh: Mesh, vertices: Array, n: int, rng: np.random.Generator, noise: float = 0.0
) -> tuple[Array, Array]:
    """Random points of the surface, with normals interpolated between the vertices."""
    face = mesh.faces[rng.integers(len(mesh.faces), size=n)]
    share = rng.dirichlet([1, 1, 1], size=n)
    points = np.einsum("ni,nij->nj", share, vertices[face])
    normals = np.einsum("ni,nij->nj", share, vertex_normals(mesh.faces, vertices)[face])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return points + noise * rng.normal(size=points.shape), normals


def edge(mesh: Mesh) -> float:
    a, b = mesh.vertices[mesh.faces[:, 0]], mesh.vertices[mesh.faces[:, 1]]
    return float(np.linalg.norm(a - b, axis=1).mean())


def error(mesh: Mesh, truth: Array, tracked: Array) -> float:
    """The mean distance from the true vertices, in mean edges."""
    return float(np.linalg.norm(truth - tracked, axis=1).mean() / edge(mesh))


def scan(mesh: Mesh, vertices: Array, rng: np.random.Generator, n: int = 4000) -> Any:
    return scan_of(mesh, vertices, n, rng, noise=0.05 * edge(mesh))


def torus_scan(mesh: Mesh, vertices: Array, n: int = 6000) -> tuple[Array, Array]:
    return scan_of(mesh, vertices, n, np.random.default_rng(1))
