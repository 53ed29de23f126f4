"""Sequences in point caches, PC2 and MDD, and the meshes beside them."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array, sheet

import dynmesh
from dynmesh import files
from dynmesh.files.mdd import timing

K = 49
SUFFIXES = [".pc2", ".mdd"]


def sequence(n: int = 10, **more: Any) -> dynmesh.Sequence:
    mesh = sheet(7)
    vertices = mesh.vertices + np.random.default_rng(0).normal(size=(n, 1, 3))
    return dynmesh.Sequence(vertices.astype(np.float32), mesh.faces, **more)


def pc2(frames: Array, version: int = 1, n: int | None = None, k: int | None = None) -> bytes:
    n, k = len(frames) if n is None else n, frames.shape[1] if k is None else k
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", version, k, 7.0, 0.5, n)
    return header + frames.astype("<f4").tobytes()


def mdd(
    frames: Array, times: Array | None = None, n: int | None = None, k: int | None = None
) -> bytes:
    n, k = len(frames) if n is None else n, frames.shape[1] if k is None else k
    times = np.arange(len(frames)) / 24 if times is None else times
    numbers = times.astype(">f4").tobytes() + frames.astype(">f4").tobytes()
    return struct.pack(">ii", n, k) + numbers


ENCODE: dict[str, Any] = {".pc2": pc2, ".mdd": mdd}


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_is_written_is_what_the_format_says(tmp_path: Path, suffix: str) -> None:
    known = np.random.default_rng(1).random((10, K)) < 0.5
    path = tmp_path / f"a{suffix}"
    before = sequence(known=known, fps=24.0)
    dynmesh.write(path, before)
    holes = np.where(known[..., None], before.vertices, np.nan)
    data = path.read_bytes()
    if suffix == ".pc2":
        assert data[:32] == struct.pack("<12siiffi", b"POINTCACHE2\0", 1, K, 0.0, 1.0, 10)
        assert data[32:] == holes.astype("<f4").tobytes()
    else:
        assert data == mdd(holes)
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


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_faces_come_from_a_mesh(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    before = sequence()
    path.write_bytes(ENCODE[suffix](before.vertices))
    with pytest.raises(ValueError, match=r"no a\.obj or a\.ply beside it; give its faces") as e:
        dynmesh.open(path)
    assert str(e.value).startswith(f"{path}: ")
    dynmesh.write(tmp_path / "b.npz", before)
    again = dynmesh.read(path, faces=tmp_path / "b.npz")
    assert again.start == (7 if suffix == ".pc2" else 0)
    np.testing.assert_array_equal(again.vertices, before.vertices)
    np.testing.assert_array_equal(again.faces, before.faces)
    dynmesh.write(tmp_path / "a.ply", sequence(1))
    np.testing.assert_array_equal(dynmesh.read(path).faces, before.faces)

    small = dynmesh.Sequence(np.zeros((1, 4, 3)), np.array([[0, 1, 2]]))
    for name in ("c.npz", "a.obj"):
        dynmesh.write(tmp_path / name, small)
        options: dict[str, Any] = {} if name == "a.obj" else {"faces": tmp_path / name}
        with pytest.raises(ValueError, match=r"has 49 vertices, but the mesh .* has 4$"):
            dynmesh.open(path, **options)
    (tmp_path / "a.obj").write_text("v 0 0\n")
    with pytest.raises(ValueError, match=r"a\.obj: "):
        dynmesh.open(path)
    dynmesh.open(path, faces=before.faces).close()  # files beside it are ignored


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_more_frames_than_a_point_cache_can_count_are_refused(
    tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dynmesh.files.target.check_space", lambda *_: None)
    header = dynmesh.Header(sheet(7).faces, 2**31, K, np.dtype(np.float32))
    with pytest.raises(ValueError, match="can hold at most 2147483647 frames, not 2147483648"):
        files.create(tmp_path / f"a{suffix}", header)
    assert not list(tmp_path.iterdir())


FRAMES = np.arange(10 * K * 3, dtype=np.float32).reshape(10, K, 3)


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.pc2", b"v 0 0 0\n" * 50, "is not a PC2 file, as it does not begin with POINTCACHE2"),
        ("a.pc2", pc2(FRAMES)[:20], "ends in its header, after 20 of 32 bytes"),
        ("a.pc2", pc2(FRAMES, version=2), "version 2, but only version 1 is supported"),
        ("a.pc2", pc2(FRAMES)[: 32 + 588 * 7 + 5], "ends in the middle of frame 7 of 10"),
        (
            "a.pc2",
            pc2(FRAMES) + b"\0",
            "continues after its 10 frames: .* 5912 .* the file has 5913",
        ),
        ("a.pc2", pc2(FRAMES, n=0), "continues after its 0 frames"),
        ("a.pc2", pc2(FRAMES[:0]), "has no frames"),
        ("a.pc2", pc2(FRAMES, n=-1), r"array of shape \(-1, 49, 3\)"),
        ("a.pc2", pc2(FRAMES, k=-1), r"array of shape \(10, -1, 3\)"),
        ("a.pc2", pc2(FRAMES, n=2**31 - 1, k=2**31 - 1), "frame 0 of 2147483647"),
        ("a.mdd", b"v 0 0 0\n" * 50, "ends in its header, after 400 of"),
        ("a.mdd", mdd(FRAMES)[:30], "ends in its header, after 30 of 48 bytes"),
        (
            "a.mdd",
            mdd(FRAMES) + b"\0",
            "continues after its 10 frames: .* 5928 .* the file has 5929",
        ),
        ("a.mdd", mdd(FRAMES, n=2**31 - 1, k=2**31 - 1), "ends in its header"),
        ("a.mdd", mdd(FRAMES, k=2**31 - 1), "frame 0 of 10"),
    ],
)
def test_damaged_caches_are_refused(tmp_path: Path, name: str, data: bytes, message: str) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(ValueError, match=message) as caught:
        dynmesh.read(path, faces=np.array([[0, 1, 2]]))
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize(("start", "n"), [(0, 2), (1, 3), (1001, 100), (86400, 2)])
@pytest.mark.parametrize("fps", [24.0, 25.0, 29.97, 23.976, 60.0, 120.0, 12.5, 0.5, 7.0])
def test_mdd_stores_rate_and_start(tmp_path: Path, fps: float, start: int, n: int) -> None:
    path = tmp_path / "a.mdd"
    vertices = np.zeros((n, 3, 3), np.float32)
    sequence = dynmesh.Sequence(vertices, np.array([[0, 1, 2]]), fps=fps, start=start)
    dynmesh.write(path, sequence)
    again = dynmesh.read(path)
    assert (again.fps, again.start) == (fps, start)
    later = (5 + np.arange(n) / fps).astype(np.float32)
    assert timing(later.astype(np.float64)) == pytest.approx((fps, 5 * fps), rel=1e-5)
    for first in (-7, 86400):
        long = ((first + np.arange(5000)) / fps).astype(np.float32)
        assert timing(long.astype(np.float64)) == (fps, first)


def test_mdd_has_no_rate_if_it_is_unknown(tmp_path: Path) -> None:
    path = tmp_path / "a.mdd"
    before = sequence()
    dynmesh.write(path, before)
    assert dynmesh.read(path).fps is None
    steps = np.arange(10.0)
    broken = np.where(steps == 4, np.nan, steps / 2)
    for times in (steps, 0 * steps, -steps / 25, steps**2, broken, 1001 + steps, 7.5 + steps**2):
        path.write_bytes(mdd(before.vertices, times))
        again = dynmesh.read(path)
        assert (again.fps, again.start) == (None, times[0])
        np.testing.assert_array_equal(again.vertices, before.vertices)
    dynmesh.write(path, sequence(1, fps=25.0, start=1001))  # one frame has no rate
    again = dynmesh.read(path)
    assert (again.fps, again.start) == (None, 0)
