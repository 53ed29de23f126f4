"""Registration where the template is a part of what was scanned, or the scan of the template."""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from meshes import Array, Mesh
from scans_of_meshes import edge, vertex_normals
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

import dynmesh

Choice = Callable[[Array], Array]


@cache
def subject(name: str) -> tuple[Mesh, Array]:
    """A subject, and the same a moment later."""
    frames: Any = {"bust": dynmesh.synth.bust, "hand": dynmesh.synth.hand}.get(
        name, dynmesh.synth.walker
    )(60)
    vertices = frames.vertices.astype(np.float64)
    return Mesh(frames.faces.astype(np.int64), vertices[0]), vertices[2]


def part_of(mesh: Mesh, chosen: Array) -> tuple[Mesh, Array]:
    """The largest piece of the faces whose corners are chosen, and the numbers of its vertices."""
    faces = mesh.faces[chosen[mesh.faces].all(axis=1)]
    ends = faces.ravel(), np.roll(faces, 1, axis=1).ravel()
    shape = (len(mesh.vertices),) * 2
    _, piece = connected_components(coo_matrix((np.ones(len(ends[0])), ends), shape), False)
    faces = faces[piece[faces[:, 0]] == np.bincount(piece[faces[:, 0]]).argmax()]
    numbers, corners = np.unique(faces, return_inverse=True)
    return Mesh(corners.reshape(-1, 3), mesh.vertices[numbers]), numbers


def area(mesh: Mesh, vertices: Array) -> Array:
    a, b, c = (vertices[corners] for corners in mesh.faces.T)
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1))


def scanned(mesh: Mesh, chosen: Array, vertices: Array, template: Mesh) -> tuple[Array, Array]:
    """Points of a part of a subject, three for each vertex of the template where it is."""
    rng = np.random.default_rng(3)
    faces = mesh.faces[chosen[mesh.faces].all(axis=1)]
    areas = area(Mesh(faces, vertices), vertices)
    per_area = 3 * len(template.vertices) / area(template, template.vertices).sum()
    n = min(int(per_area * areas.sum()), 12_000)
    corners = faces[rng.choice(len(faces), n, p=areas / areas.sum())]
    share = rng.dirichlet([1, 1, 1], size=n)
    points = np.einsum("ni,nij->nj", share, vertices[corners])
    normals = np.einsum("ni,nij->nj", share, vertex_normals(mesh.faces, vertices)[corners])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return points + 0.05 * edge(template) * rng.normal(size=points.shape), normals


def everything(x: Array) -> Array:
    return np.ones(len(x), bool)


def face(x: Array) -> Array:
    return np.asarray((x[:, 1] > 0.03) & (x[:, 2] > 0.24))


def head(x: Array) -> Array:
    return np.asarray(x[:, 2] > 0.2)


def upper(x: Array) -> Array:
    return np.asarray(x[:, 2] > 0.95)


class Case(NamedTuple):
    """Which parts of a subject are the template and the scan, and another subject."""

    name: str
    template: Choice
    scan: Choice
    other: str


CASES = {
    "a face in a bust": Case("bust", face, everything, "walker"),
    "a head in a bust": Case("bust", head, everything, "hand"),
    "fingers of a hand": Case("hand", lambda x: x[:, 2] > 0.05, everything, "bust"),
    "an upper body": Case("walker", upper, everything, "hand"),
    "a bust in a head": Case("bust", everything, head, "hand"),
    "an upper body without a head": Case("walker", upper, lambda x: x[:, 2] < 1.5, "hand"),
}
TURNS = {"in place": Rotation.identity(), "turned": Rotation.from_euler("xyz", [2.5, -1, 1.5])}


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("name", CASES)
def test_a_part_is_found_in_what_was_scanned(name: str, turn: str) -> None:
    case = CASES[name]
    mesh, later = subject(case.name)
    template, numbers = part_of(mesh, case.template(mesh.vertices))
    points, normals = scanned(mesh, case.scan(mesh.vertices), later, template)
    rotation = TURNS[turn]
    found = dynmesh.register(
        template.faces, template.vertices, rotation.apply(points), rotation.apply(normals)
    )
    # What was not scanned may lie anywhere.
    is_scanned = case.scan(mesh.vertices)[numbers]
    truth = rotation.apply(later[numbers])
    wrong = np.linalg.norm(found.vertices - truth, axis=1)[is_scanned].mean() / edge(template)
    assert wrong < 0.5, found
    assert (found.quality == "good") == bool(is_scanned.all()), found.reason


@pytest.mark.parametrize("name", CASES)
def test_a_part_of_something_else_is_not_good(name: str) -> None:
    """What was scanned is as large as the subject."""
    case = CASES[name]
    mesh, _ = subject(case.name)
    template, _ = part_of(mesh, case.template(mesh.vertices))
    other, _ = subject(case.other)
    size = np.ptp(mesh.vertices, axis=0).max() / np.ptp(other.vertices, axis=0).max()
    vertices = size * other.vertices
    points, normals = scanned(other, everything(vertices), vertices, template)
    found = dynmesh.register(template.faces, template.vertices, points, normals)
    assert found.quality != "good", found
