"""Sequences in PC2 files, and the meshes beside them."""

import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array, sheet
from sequences import assert_refused

import dynmesh
from dynmesh import files

K = 49


def sequence(n: int = 10, **more: Any) -> dynmesh.Sequence:
    mesh = sheet(7)
    vertices = mesh.vertices + np.random.default_rng(0).normal(size=(n, 1, 3))
    return dynmesh.Sequence(vertices.astype(np.float32), mesh.faces, **more)


def pc2(frames: Array, version: int = 1, n: int | None = None, k: int | None = None) -> bytes:
    n, k = len(frames) if n is None else n, frames.shape[1] if k is None else k
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", version, k, 7.0, 0.5, n)
    return header + frames.astype("<f4").tobytes()


def test_what_is_written_is_what_the_format_says(tmp_path: Path) -> None:
    path = tmp_path / "a.pc2"
    before = sequence(fps=24.0)
    dynmesh.write(path, before)
    data = path.read_bytes()
    assert data[:32] == struct.pack("<12siiffi", b"POINTCACHE2\0", 1, K, 0.0, 1.0, 10)
    assert data[32:] == before.vertices.astype("<f4").tobytes()
    assert sorted(tmp_path.iterdir()) == sorted([path, tmp_path / "a.obj"])
    with dynmesh.open(path) as reader:
        assert reader.files == [path, tmp_path / "a.obj"]
        assert next(iter(reader)).points.dtype.isnative


def test_an_existing_mesh_with_the_same_faces_is_kept(tmp_path: Path) -> None:
    path, mesh = tmp_path / "a.pc2", tmp_path / "a.obj"
    dynmesh.write(path, sequence())
    text = mesh.read_text().replace("f ", "vt 0.5 0.5\nf ", 1)
    mesh.write_text(text)
    dynmesh.write(path, sequence(3))
    assert mesh.read_text() == text
    assert files.target_of(path).existing() == [path, mesh]

    other = dynmesh.Sequence(sequence().vertices, sheet(7).faces[::-1])
    dynmesh.write(path, other)
    np.testing.assert_array_equal(dynmesh.read(path).faces, other.faces)
    assert sorted(tmp_path.iterdir()) == [mesh, path]
    for axis in ("z", "y"):
        dynmesh.write(tmp_path / "b.pc2", replace(other, up_axis=axis))
        assert dynmesh.read(tmp_path / "b.pc2").up_axis == axis


def test_faces_come_from_the_mesh_beside(tmp_path: Path) -> None:
    path = tmp_path / "a.pc2"
    before = sequence()
    path.write_bytes(pc2(before.vertices))
    dynmesh.write(tmp_path / "a.ply", sequence(1))
    again = dynmesh.read(path)
    assert again.start == 7
    np.testing.assert_array_equal(again.vertices, before.vertices)
    np.testing.assert_array_equal(again.faces, before.faces)
    dynmesh.write(tmp_path / "a.obj", dynmesh.Sequence(np.zeros((1, 4, 3)), np.array([[0, 1, 2]])))
    with pytest.raises(ValueError, match=r"has 49 vertices, but the mesh .* has 4$"):
        dynmesh.open(path)
    dynmesh.open(path, faces=before.faces).close()  # files beside it are ignored


def test_more_frames_than_a_point_cache_can_count_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dynmesh.files.writer.check_space", lambda *_: None)
    header = dynmesh.Header(sheet(7).faces, 2**31, K, np.dtype(np.float32))
    with pytest.raises(ValueError, match="can hold at most 2147483647 frames, not 2147483648"):
        files.create(tmp_path / "a.pc2", header)
    assert not list(tmp_path.iterdir())


FRAMES = np.arange(10 * K * 3, dtype=np.float32).reshape(10, K, 3)


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (pc2(FRAMES, version=2), "version 2"),
        (pc2(FRAMES) + b"\0", "5912 bytes, but .* 5913"),
        (pc2(FRAMES[:0]), "no frames"),
        (pc2(FRAMES, n=-1), r"\(-1, 49, 3\)"),
        (pc2(FRAMES, k=-1), r"\(10, -1, 3\)"),
        (pc2(FRAMES, n=2**31 - 1, k=2**31 - 1), "55340232\\d+ bytes"),
    ],
)
def test_damaged_caches_are_refused(tmp_path: Path, data: bytes, told: str) -> None:
    path = tmp_path / "a.pc2"
    path.write_bytes(data)
    assert_refused(path, told, faces=np.array([[0, 1, 2]]))
