"""Small meshes for the tests, and hypothesis strategies for random ones."""

from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

Array = NDArray[Any]
Integers = NDArray[np.int64]


class Mesh(NamedTuple):
    """Faces and frame 0."""

    faces: Integers
    vertices: Array


def sheet(n: int, offset: float = 0.0) -> Mesh:
    """A bumpy grid of n by n vertices, two triangles to a square."""
    i, j = (a.ravel() for a in np.indices((n, n)))
    vertices = np.stack([j + offset, i, 0.3 * np.sin(1.3 * i + 0.7 * j)], axis=1)
    v = np.arange(n * n).reshape(n, n)[:-1, :-1].ravel()
    squares = [np.stack([v, v + 1, v + n], axis=1), np.stack([v + 1, v + n + 1, v + n], axis=1)]
    return Mesh(np.concatenate(squares), vertices.astype(np.float64))


def bumpy_torus(n: int) -> Mesh:
    """A closed surface on which every place differs from all others."""
    i, j = (a.ravel() for a in np.indices((n, n)))
    u, v = 2 * np.pi * i / n, 2 * np.pi * j / n
    bump = 0.25 * np.sin(2 * u + v) + 0.2 * np.sin(3 * u)
    r = (3 + np.cos(v)) * (1 + 0.3 * bump)
    vertices = np.stack([r * np.cos(u), r * np.sin(u), np.sin(v) * (1 + bump)], axis=1)
    a, b = i * n + j, i * n + (j + 1) % n
    c, d = (i + 1) % n * n + j, (i + 1) % n * n + (j + 1) % n
    faces = np.concatenate([np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)])
    return Mesh(faces, vertices)


def join(*meshes: Mesh) -> Mesh:
    """Joins meshes into one, without connecting them."""
    starts = np.cumsum([0] + [len(m.vertices) for m in meshes])
    faces = [m.faces + start for m, start in zip(meshes, starts[:-1], strict=True)]
    return Mesh(np.concatenate(faces), np.concatenate([m.vertices for m in meshes]))


def turned(vertices: Array, angle: float) -> Array:
    """Returns the points rotated about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(vertices @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]]))


def _half_turn(*axis: float) -> Array:
    """Rotates by exactly 180 degrees about a coordinate axis, as the cosine of pi is not exact."""
    unit = np.array(axis) / np.linalg.norm(axis)
    return np.asarray(2 * np.outer(unit, unit) - np.eye(3))


EVENTS = {
    "half turn about x": _half_turn(1, 0, 0),
    "half turn about y": _half_turn(0, 1, 0),
    "half turn about z": _half_turn(0, 0, 1),
    "half turn about another axis": _half_turn(1, 2, 3),
    "point reflection": -np.eye(3),
    "mirrored in x": np.diag([-1.0, 1, 1]),
    "mirrored in z": np.diag([1.0, 1, -1]),
    "flattened to a plane": np.diag([1.0, 1, 0]),
    "flattened to another plane": np.diag([0.0, 1, 1]),
    "flattened to a line": np.diag([1.0, 0, 0]),
    "flattened to a point": np.zeros((3, 3)),
    "a million times larger": 1e6 * np.eye(3),
    "a million times smaller": 1e-6 * np.eye(3),
    "larger and reflected": -1e6 * np.eye(3),
    "smaller and turned": 1e-6 * _half_turn(0, 0, 1),
}
"""Unrealistic changes from one frame to the next, as matrices, which method detail must survive."""


@st.composite
def meshes(draw: st.DrawFn, max_vertices: int = 24) -> Mesh:
    """Draws arbitrary faces, including degenerate, duplicate and non-manifold ones."""
    k = draw(st.integers(1, max_vertices))
    n_faces = draw(st.integers(1, 2 * max_vertices))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    faces = rng.integers(0, k, (n_faces, 3))
    if draw(st.booleans()):  # mostly local faces, for several generations
        faces = np.minimum(faces[:, :1] + rng.integers(0, 3, (n_faces, 3)), k - 1)
    return Mesh(faces, rng.normal(size=(k, 3)))


@st.composite
def masks(draw: st.DrawFn, k: int) -> NDArray[np.bool_]:
    """Draws known masks; small and large shares are equally likely."""
    share = draw(st.sampled_from([0.0, 0.05, 0.2, 0.5, 0.9, 1.0]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return rng.random(k) < share


def potato(rng: np.random.Generator) -> Mesh:
    """A closed surface with dents: a sphere with random radii."""
    import trimesh  # which tests on other platforms do without

    sphere: Any = trimesh.creation.icosphere(subdivisions=1)
    radii = rng.uniform(0.5, 1.3, (len(sphere.vertices), 1))
    return Mesh(np.array(sphere.faces), np.array(sphere.vertices) * radii)
