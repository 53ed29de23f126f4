"""Tests that USD and Alembic share: one mesh of a scene, frame by frame."""

import dataclasses
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from memory import own_memory

import dynmesh
from dynmesh.polygons import Polygons, split_polygons

pytest.importorskip("pxr")
pytest.importorskip("alembic3d")

suffixes = pytest.mark.parametrize("suffix", ["usd", "usdc", "usda", "abc"])


def sequence_of(n_frames: int, dtype: Any = np.float32) -> dynmesh.Sequence:
    """A quad, a triangle and a pentagon with all optional attributes."""
    rng = np.random.default_rng(0)
    corners = np.array([0, 1, 2, 3, 2, 1, 4, 0, 3, 5, 6, 7])
    faces, polygons = split_polygons(Polygons(np.array([4, 3, 5]), corners))
    vertices = rng.normal(size=(n_frames, 8, 3)).astype(dtype)
    vertices[0, 1] = np.nan
    vertices[-1] = np.nan  # a frame without any position
    return dynmesh.Sequence(
        vertices,
        faces,
        known=rng.random((n_frames, 8)) < 0.5,
        fps=30000 / 1001,
        polygons=polygons,
        name="/World/Figure/Body",
        generation=rng.integers(-1, 9, (n_frames, 8)).astype(np.int32),
        age=rng.integers(0, 9, (n_frames, 8)).astype(np.int32),
    )


@suffixes
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("n_frames", [1, 5])
def test_what_is_written_is_read(
    tmp_path: Path, suffix: str, n_frames: int, dtype: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    sequence = sequence_of(n_frames, dtype)
    path = tmp_path / f"a name [1] é.{suffix}"
    dynmesh.write(path, sequence)
    again = dynmesh.read(path)
    assert again.vertices.dtype == np.float32
    np.testing.assert_array_equal(again.vertices, sequence.vertices.astype(np.float32))
    np.testing.assert_array_equal(again.faces, sequence.faces)
    for name in ("known", "generation", "age"):
        np.testing.assert_array_equal(getattr(again, name), getattr(sequence, name))
        assert getattr(again, name).dtype == getattr(sequence, name).dtype
    assert again.polygons is not None
    assert sequence.polygons is not None
    np.testing.assert_array_equal(again.polygons.sizes, sequence.polygons.sizes)
    np.testing.assert_array_equal(again.polygons.corners, sequence.polygons.corners)
    assert again.fps == pytest.approx(30000 / 1001, rel=1e-14)
    assert again.name == "/World/Figure/Body"
    assert list(tmp_path.iterdir()) == [path]
    assert capfd.readouterr() == ("", "")


@suffixes
@pytest.mark.parametrize("fps", [None, 1.0, 24.0])
def test_unknown_properties_remain_unknown(tmp_path: Path, suffix: str, fps: float | None) -> None:
    whole = sequence_of(4)
    dynmesh.write(tmp_path / f"a.{suffix}", dynmesh.Sequence(whole.vertices, whole.faces, fps=fps))
    again = dynmesh.read(tmp_path / f"a.{suffix}")
    assert (again.fps, again.up_axis, again.name) == (fps, None, "/mesh")
    assert (again.known, again.generation, again.age, again.polygons) == (None,) * 4


@suffixes
def test_any_frames_can_be_read(tmp_path: Path, suffix: str) -> None:
    sequence = sequence_of(6)
    dynmesh.write(tmp_path / f"a.{suffix}", sequence)
    with dynmesh.open(tmp_path / f"a.{suffix}") as reader:
        first = iter(reader)
        next(first)
        for number, frame in zip((1, 3, 5), reader.frames(1, None, 2), strict=True):
            np.testing.assert_array_equal(frame.points, sequence.vertices[number])
            np.testing.assert_array_equal(frame.known, sequence.known[number])  # type: ignore[index]
        np.testing.assert_array_equal(next(first).points, sequence.vertices[1])


@suffixes
def test_a_reader_refuses_a_file_that_was_replaced(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    sequence = sequence_of(3)
    dynmesh.write(path, sequence)
    with dynmesh.open(path) as reader:
        dynmesh.write(path, dataclasses.replace(sequence, vertices=sequence.vertices + 1))
        np.testing.assert_array_equal(dynmesh.read(path).vertices, sequence.vertices + 1)
        with pytest.raises(ValueError, match="was changed while it was read"):
            list(reader)


@suffixes
def test_damaged_files_are_refused(
    tmp_path: Path, suffix: str, capfd: pytest.CaptureFixture[str]
) -> None:
    whole = tmp_path / f"whole.{suffix}"
    dynmesh.write(whole, sequence_of(30))
    data = whole.read_bytes()
    path = tmp_path / f"damaged.{suffix}"
    for damaged in (b"", b"solid", data[: len(data) // 2], data[:-9], bytes(len(data))):
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match=r"damaged\..*: is damaged or not an? ") as caught:
            dynmesh.read(path)
        assert "\n" not in str(caught.value)
    with pytest.raises(FileNotFoundError):
        dynmesh.read(tmp_path / f"none.{suffix}")
    assert capfd.readouterr() == ("", "")


@suffixes
def test_faces_from_elsewhere_are_refused(tmp_path: Path, suffix: str) -> None:
    dynmesh.write(tmp_path / f"a.{suffix}", sequence_of(2))
    with pytest.raises(ValueError, match="holds its faces"):
        dynmesh.read(tmp_path / f"a.{suffix}", faces=np.array([[0, 1, 2]]))


@suffixes
def test_missing_folders_are_refused(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(FileNotFoundError):
        dynmesh.write(tmp_path / "nowhere" / f"a.{suffix}", sequence_of(2))


@suffixes
def test_what_float32_cannot_hold_is_refused(tmp_path: Path, suffix: str) -> None:
    vertices = np.zeros((2, 3, 3))
    vertices[0, 0, 0] = np.inf
    vertices[1, 2, 1] = -1e39
    with pytest.raises(ValueError, match=r"frame 1: vertex 2 at \[0.0, -1e\+39, 0.0\] is out of"):
        dynmesh.write(tmp_path / f"a.{suffix}", dynmesh.Sequence(vertices, np.array([[0, 1, 2]])))
    assert list(tmp_path.iterdir()) == []


FULL_DISK = """
import resource, sys
import numpy as np
import dynmesh

path, limit = sys.argv[1], int(sys.argv[2])
points = np.random.default_rng(0).random((40, 2000, 3)).astype(np.float32)
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
try:
    dynmesh.write(path, dynmesh.Sequence(points, np.array([[0, 1, 2]])))
except OSError as error:
    print(error)
"""


@pytest.mark.parametrize(
    ("suffix", "limit"),
    [("usdc", 300_000), ("usda", 300_000), ("usda", 1_100_000), ("abc", 300_000)],
)
def test_a_full_disk_is_reported_and_leaves_nothing(
    tmp_path: Path, suffix: str, limit: int
) -> None:
    path = tmp_path / f"a.{suffix}"
    command = [sys.executable, "-c", FULL_DISK, str(path), str(limit)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert str(path) in done.stdout
    assert "File too large" in done.stdout
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", ["usdc", "abc"])
def test_memory_does_not_grow_with_the_frames(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"long.{suffix}"
    points = np.random.default_rng(0).random((200_000, 3)).astype(np.float32)
    n_frames, faces = 60, np.array([[0, 1, 2]])
    used = []
    header = dynmesh.Header(faces, n_frames, len(points), points.dtype)
    with dynmesh.create(path, header) as writer:
        for _ in range(n_frames):
            points[0] += 1  # equal frames would be stored only once
            writer.append(points)
            used.append(own_memory())
    assert path.stat().st_size > n_frames * points.nbytes > 140e6
    assert max(used) - used[0] < 40_000
    with dynmesh.open(path) as reader:
        used = [own_memory() for _ in reader]
    assert max(used) - used[0] < 20_000
