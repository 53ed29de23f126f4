"""Sequences in memory: their checks and their repr."""

from pathlib import Path

import numpy as np
import pytest
from meshes import Mesh

import dynmesh


@pytest.mark.parametrize("vertex", [-1, 49, 2**31])
def test_a_face_without_vertex_is_refused(mesh: Mesh, vertex: int, tmp_path: Path) -> None:
    faces = mesh.faces.copy()
    faces[5, 1] = vertex
    message = rf"faces: face 5 refers to vertex {vertex}, but the mesh has 49 vertices"
    with pytest.raises(ValueError, match=message):
        dynmesh.Sequence(mesh.vertices[None], faces)
    with pytest.raises(ValueError, match=message):
        dynmesh.Header(faces, 1, 49, np.dtype(np.float64))
    np.savez(tmp_path / "bad.npz", vertices=mesh.vertices[None], faces=faces)
    with pytest.raises(ValueError, match=rf"bad\.npz: {message}"):
        dynmesh.open(tmp_path / "bad.npz")


def test_repr(mesh: Mesh, tmp_path: Path) -> None:
    vertices = np.stack([mesh.vertices] * 4)
    known = np.ones((4, 49), np.bool_)
    known[1:, :7] = False
    partial = dynmesh.Sequence(vertices, mesh.faces, known, fps=25.0)
    counts = "4 frames, 49 vertices, 72 faces, float64"
    assert repr(partial) == f"Sequence({counts}, 89.3 % known, 25 fps)"
    assert repr(dynmesh.Sequence(vertices, mesh.faces)) == f"Sequence({counts}, no masks, no fps)"
    empty = dynmesh.Sequence(vertices[:0], mesh.faces, known[:0])
    assert repr(empty).startswith("Sequence(0 frames")
    dynmesh.write(tmp_path / "a.npz", partial)
    with dynmesh.open(tmp_path / "a.npz") as reader:
        path = str(tmp_path / "a.npz")
        assert repr(reader) == f"NpzReader({path!r}: {counts}, with masks, 25 fps)"
