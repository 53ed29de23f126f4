"""The built-in sequences: their connectivity, and that they move as what they are called does."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from meshes import Array
from scipy.spatial import cKDTree

import dynmesh
from dynmesh import synth


class Kind(NamedTuple):
    """What holds for a subject: frames that show its motion, and connectivity in all frames."""

    frames: int
    vertices: int
    parts: int = 1
    boundary_edges: int = 0


KINDS = {
    "ocean": Kind(100, 2500, boundary_edges=4 * 49),
    "walker": Kind(25, 10002),
    "bust": Kind(40, 8192),
    "hand": Kind(97, 3928),
    "cloth": Kind(60, 2500, boundary_edges=4 * 49),
    "beetle": Kind(60, 3968, parts=31),
    "heart": Kind(60, 3892, parts=2),
}
_made: dict[str, dynmesh.Sequence] = {}


def subject(name: str) -> dynmesh.Sequence:
    """A subject of seed 1, which all tests share."""
    if name not in _made:
        _made[name] = getattr(synth, name)(KINDS[name].frames, seed=1)
    return _made[name]


def edge_lengths(sequence: dynmesh.Sequence) -> Array:
    """The lengths (n, m, 3) of the edges of all triangles."""
    corners = sequence.vertices[:, sequence.faces].astype(np.float64)
    return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=2), axis=3))


def volumes(sequence: dynmesh.Sequence, parts: int) -> Array:
    """The volumes (n, parts) within parts of equally many faces."""
    a, b, c = (sequence.vertices[:, sequence.faces[:, i]].astype(np.float64) for i in range(3))
    each = np.einsum("nfc,nfc->nf", a, np.cross(b, c)) / 6
    return np.asarray(each.reshape(len(each), parts, -1).sum(axis=2))


@pytest.mark.parametrize("name", KINDS)
def test_a_subject_is_a_surface_that_moves_and_does_not_collapse(name: str) -> None:
    kind, sequence = KINDS[name], subject(name)
    assert (sequence.up_axis, sequence.fps, sequence.metres_per_unit) == ("z", 30.0, 1.0)
    assert sequence.vertices.dtype == np.float32
    assert sequence.vertices.shape == (kind.frames, kind.vertices, 3)
    topology = dynmesh.Completer(sequence.faces, sequence.vertices[0]).topology
    assert (topology.components, topology.boundary_edges) == (kind.parts, kind.boundary_edges)
    assert topology.refused_faces == []
    spheres = kind.boundary_edges > 0 or 2 * kind.vertices - len(sequence.faces) == 4 * kind.parts
    assert spheres
    lengths = edge_lengths(sequence)
    assert lengths.min() > 0.02 * lengths.mean()
    assert lengths.max() < 8 * lengths.mean()
    motion = np.linalg.norm(np.diff(sequence.vertices, axis=0), axis=2).mean()
    assert 0.02 < motion / lengths.mean() * kind.frames / 60 < 8
    if kind.boundary_edges == 0:
        volume = volumes(sequence, kind.parts)
        assert (volume.min(axis=0) > 0.5 * volume[0]).all()  # oriented outward
        assert (volume > 0).all()


@pytest.mark.parametrize("name", KINDS)
def test_equal_seeds_give_equal_sequences(name: str) -> None:
    make: Any = getattr(synth, name)
    first, again, other = make(2, seed=3), make(2, seed=3), make(2, seed=4)
    assert first.vertices.tobytes() == again.vertices.tobytes()
    assert first.vertices[1].tobytes() != other.vertices[1].tobytes()
    np.testing.assert_array_equal(first.faces, other.faces)


def test_the_walker_stands_on_the_floor_and_on_its_hands() -> None:
    figure = subject("walker")
    assert figure.vertices[..., 2].min() > -0.05
    head = figure.vertices[0, :, 2].argmax()
    assert figure.vertices[:, head, 2].min() < 0.6


@pytest.mark.parametrize("seed", [0, 1])
def test_the_ocean_is_a_sheet_that_never_folds(seed: int) -> None:
    ocean = synth.ocean(300, seed=seed)
    a, b, c = (ocean.vertices[:, ocean.faces[:, corner], :2] for corner in range(3))
    area = (b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]
    assert area.min() > 0


def test_the_parts_of_the_beetle_are_rigid_and_three_feet_stand() -> None:
    beetle = subject("beetle")
    rounding = 4 * np.finfo(np.float32).eps * np.abs(beetle.vertices).max()
    lengths = edge_lengths(beetle)
    assert np.abs(lengths - lengths[0]).max() < rounding
    parts = beetle.vertices.reshape(KINDS["beetle"].frames, 31, -1, 3)
    assert parts[..., 2].min() > -0.002
    assert ((parts[..., 2].min(axis=2) < 0.002).sum(axis=1) >= 3).all()


def test_the_cloth_hangs_over_the_ball_without_passing_or_stretching() -> None:
    cloth = subject("cloth")
    ball, radius = np.array([0.0, 0.0, 0.5]), 0.25
    middles = cloth.vertices[:, cloth.faces].mean(axis=2)
    for points in (cloth.vertices, middles):
        assert (np.linalg.norm(points - ball, axis=2) > radius).all()
    threads = np.sort(edge_lengths(cloth), axis=2)[:, :, :2] / (1.2 / 49)
    assert 0.9 < threads.min() < threads.max() < 1.15
    assert np.linalg.norm(cloth.vertices[-1] - cloth.vertices[-2], axis=1).mean() < 0.005
    assert cloth.vertices[-1, :, 2].min() < 0.5 - 0.25
    assert cloth.vertices[-1, :, 2].max() > 0.5 + 0.25


def test_the_heart_beats_beside_the_lung_and_never_touches_it() -> None:
    organs = subject("heart")
    for heart, lung in organs.vertices.reshape(KINDS["heart"].frames, 2, -1, 3):
        assert np.min(cKDTree(lung).query(heart)[0]) > 0.002
    heart, lung = volumes(organs, 2).T
    assert 0.4 < heart.min() / heart.max() < 0.8
    assert 0.8 < lung.min() / lung.max() < 0.99
    beats = np.flatnonzero((heart[1:-1] < heart[:-2]) & (heart[1:-1] <= heart[2:]))
    assert len(beats) == 2  # in two seconds
