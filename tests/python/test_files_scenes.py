"""Tests that USD and Alembic share: one mesh of a scene, frame by frame."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from bad_input.files import on_a_full_disk
from memory import own_memory

import dynmesh
from dynmesh.polygons import Polygons, split_polygons

pytest.importorskip("pxr")
pytest.importorskip("alembic3d")

suffixes = pytest.mark.parametrize("suffix", ["usdc", "usda", "abc"])


def sequence_of(n_frames: int) -> dynmesh.Sequence:
    """A quad, a triangle and a pentagon with all optional attributes."""
    rng = np.random.default_rng(0)
    corners = np.array([0, 1, 2, 3, 2, 1, 4, 0, 3, 5, 6, 7])
    faces, polygons = split_polygons(Polygons(np.array([4, 3, 5]), corners))
    vertices = rng.normal(size=(n_frames, 8, 3)).astype(np.float32)
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
@pytest.mark.parametrize("n_frames", [1, 5])
def test_what_is_written_is_read(
    tmp_path: Path, suffix: str, n_frames: int, capfd: pytest.CaptureFixture[str]
) -> None:
    sequence = sequence_of(n_frames)
    path = tmp_path / f"a name [1] é.{suffix}"
    dynmesh.write(path, sequence)
    again = dynmesh.read(path)
    assert again.vertices.dtype == np.float32
    np.testing.assert_array_equal(again.vertices, sequence.vertices)
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
def test_a_reader_refuses_a_file_that_was_replaced(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    sequence = sequence_of(3)
    dynmesh.write(path, sequence)
    with dynmesh.open(path) as reader:
        dynmesh.write(path, dataclasses.replace(sequence, vertices=sequence.vertices + 1))
        np.testing.assert_array_equal(dynmesh.read(path).vertices, sequence.vertices + 1)
        with pytest.raises(ValueError, match="was changed while it was read"):
            list(reader)


@pytest.mark.parametrize("limit", [300_000, 1_100_000])
def test_a_full_disk_is_reported_for_text_and_leaves_nothing(
    tmp_path: Path, limit: int, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.usda"
    points = np.random.default_rng(0).random((40, 2000, 3)).astype(np.float32)
    sequence = dynmesh.Sequence(points, np.array([[0, 1, 2]]))
    with pytest.raises(OSError, match=rf"{path}: .*File too large"):
        on_a_full_disk(lambda: dynmesh.write(path, sequence), limit)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", ["usdc", "abc"])
def test_memory_does_not_grow_with_the_frames(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"long.{suffix}"
    points = np.random.default_rng(0).random((200_000, 3)).astype(np.float32)
    n_frames, faces = 30, np.array([[0, 1, 2]])
    used = []
    header = dynmesh.Header(faces, n_frames, len(points), points.dtype)
    with dynmesh.create(path, header) as writer:
        for _ in range(n_frames):
            points[0] += 1  # equal frames would be stored only once
            writer.append(points)
            used.append(own_memory())
    assert path.stat().st_size > n_frames * points.nbytes > 70e6
    assert max(used) - used[0] < 40_000
    with dynmesh.open(path) as reader:
        used = [own_memory() for _ in reader]
    assert max(used) - used[0] < 20_000
