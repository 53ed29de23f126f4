"""A faulty sequence for each finding of a diagnosis, and sequences without faults."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from meshes import Array, Mesh, join, sheet

from dynmesh import Sequence, synth

N_FRAMES = 16


def moving(mesh: Mesh, n_frames: int = N_FRAMES, dtype: Any = np.float64) -> Sequence:
    """Returns a mesh that drifts and grows slowly."""
    times = np.arange(n_frames)[:, None, None]
    waves = 0.1 * (np.sin(0.3 * times + mesh.vertices[:, :1]) - np.sin(mesh.vertices[:, :1]))
    vertices = mesh.vertices * (1 + 0.002 * times) + np.array([0.05, 0.02, 0.01]) * times + waves
    return Sequence(vertices.astype(dtype), mesh.faces)


@lru_cache
def walker() -> Sequence:
    """Returns the built-in figure."""
    return synth.walker(40)


def masked(sequence: Sequence) -> Array:
    """Returns a mask in which everything is known."""
    return np.ones(sequence.vertices.shape[:2], np.bool_)


def with_faces(*faces: list[int]) -> Sequence:
    mesh = sheet(12)
    return moving(mesh._replace(faces=np.concatenate([mesh.faces, np.array(faces)])))


def with_points(*points: tuple[float, float, float], faces: list[list[int]]) -> Sequence:
    """Returns a sheet of 144 vertices with additional points and faces."""
    mesh = sheet(12)
    vertices = np.concatenate([mesh.vertices, np.array(points)])
    added = np.array(faces, np.int64).reshape(-1, 3)
    return moving(Mesh(np.concatenate([mesh.faces, added]), vertices))


class Expected(NamedTuple):
    """The expected content of a finding."""

    number: int
    vertices: list[int] | None = None
    faces: list[int] | None = None
    frames: list[int] | None = None


Broken = tuple[Sequence, Expected]


def first_frame_incomplete() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[0, [3, 7]] = np.nan
    return sequence, Expected(2, [3, 7], frames=[0])


def known_not_finite() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[4, 5] = np.inf
    sequence.vertices[6, 2] = np.nan
    return replace(sequence, known=masked(sequence)), Expected(2, [2, 5], frames=[4, 6])


def scrambled_frames() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[5] = sequence.vertices[5, np.random.default_rng(0).permutation(144)]
    return sequence, Expected(1, frames=[5])


def zeros() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[3:5, 10:14] = 0
    return sequence, Expected(8, [10, 11, 12, 13], frames=[3, 4])


def leaps() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[6:] += 5  # a cut
    sequence.vertices[12] -= 5  # a misplaced frame
    return sequence, Expected(3, frames=[6, 12, 13])


def outliers() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[4, 50] += [0, 0, 10]
    return sequence, Expected(1, [50], frames=[4])


def frames_without_anchors() -> Broken:
    sequence = moving(sheet(12))
    known = masked(sequence)
    known[5:7] = False
    return replace(sequence, known=known), Expected(2, frames=[5, 6])


def never_seen() -> Broken:
    sequence = moving(sheet(12))
    patch = [0, 1, 2, 12, 13, 14, 24, 25, 26]
    sequence.vertices[1:, patch] = np.nan
    return sequence, Expected(9, patch)


def coincident_vertices() -> Broken:
    flat = sheet(12)
    flat.vertices[:, 2] = 0
    mesh = join(flat, flat._replace(vertices=flat.vertices + np.array([11, 0, 0])))
    seam = [i for i in range(288) if mesh.vertices[i, 0] == 11]
    return moving(mesh), Expected(24, seam)


def non_manifold_edges() -> Broken:
    sequence = with_points((5, 5, 2), faces=[[65, 66, 144]])  # a fin on an inner edge
    return sequence, Expected(1, faces=[242])


def non_manifold_vertices() -> Broken:
    sequence = with_points((5, 5, 2), (6, 5, 2), faces=[[65, 144, 145]])
    return sequence, Expected(1, faces=[242])


def degenerate_faces() -> Broken:
    return with_faces([5, 5, 6], [7, 7, 7]), Expected(2, faces=[242, 243])


def no_faces() -> Broken:
    sequence = moving(sheet(12))
    return replace(sequence, faces=np.empty((0, 3), np.int64)), Expected(1)


BROKEN: dict[str, Callable[[], Broken]] = {
    make.__name__: make
    for make in (
        first_frame_incomplete, known_not_finite, no_faces, scrambled_frames,
        zeros, leaps, outliers,
        frames_without_anchors,
        never_seen,
        coincident_vertices, non_manifold_edges,
        non_manifold_vertices, degenerate_faces,
    )
}  # fmt: skip
