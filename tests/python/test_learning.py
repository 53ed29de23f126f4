"""Method detail that learns from the frames that it completes."""

from pathlib import Path
from typing import Any

import meshes
import numpy as np
import pytest
from meshes import Array, Mesh
from test_training import completed, error, errors_of
from training_reference import Learned

import dynmesh


def swinging(vertices: Array, n: int) -> Array:
    """Frames of a sheet that bends and twists, each with its own period, again and again."""
    x, y, z = vertices.T
    frames = []
    for time in range(n):
        bend, twist = np.sin(0.7 * time), np.cos(0.45 * time) - 1
        height = 0.05 * bend * (x - x.mean()) ** 2 + 0.08 * twist * x * np.sin(0.7 * y)
        frames.append(np.stack([x, y + 0.1 * bend * x, z + height], axis=1))
    return np.stack(frames)


@pytest.fixture
def sheet() -> Mesh:
    return meshes.sheet(12)


@pytest.fixture
def clip(sheet: Mesh, rng: np.random.Generator) -> tuple[Array, Array]:
    """Frames, and masks of those after the first in which a corner comes and goes."""
    frames = swinging(sheet.vertices, 90)
    masks = rng.random((89, len(sheet.vertices))) < 0.4
    for n in range(89):
        if n % 30 >= 15:
            masks[n, sheet.vertices[:, 0] > 6] = False
    return frames, masks


@pytest.mark.parametrize(
    ("shape", "n_frames", "noise"),
    [("sheet", 75, None), ("sheet", 24, 0.02), ("two parts", 24, None), ("two parts", 24, 0.02)],
)
def test_frames_equal_the_transcription(
    shape: str, n_frames: int, noise: float | None, rng: np.random.Generator
) -> None:
    """From frame 58 of the longer clip on, a shape leaves the library for each that enters."""
    mesh = {
        "sheet": meshes.sheet(8),
        "two parts": meshes.join(meshes.sheet(7), meshes.sheet(6, 30.0)),
    }[shape]
    frames = swinging(mesh.vertices, n_frames + 1)[1:]
    completer = dynmesh.Completer(
        mesh.faces, mesh.vertices, method="detail", disconnected="hold", noise=noise, learn=True
    )
    expected = Learned(mesh.faces, mesh.vertices, noise)
    for n, points in enumerate(frames):
        known = rng.random(len(points)) < (0.0 if n == 11 else 0.3)
        if shape == "two parts" and n % 3 == 1:
            known[49:] = False  # disconnected
        completed = completer.push(points, known)
        np.testing.assert_allclose(
            completed, expected.complete(points, known), rtol=0, atol=1e-6 * expected.h
        )
        report = completer.report
        assert report.prior_weight == expected.prior_weight
        assert report.prior_share == pytest.approx(expected.prior_share, abs=1e-4)
        if known.any():
            assert report.blend == pytest.approx(expected.blend, abs=1e-4)
    assert report.prior_weight == 1


def test_what_recurs_is_completed_more_accurately(sheet: Mesh, clip: tuple[Array, Array]) -> None:
    frames, masks = clip
    learned, plain = (completed(sheet, frames, masks, learn=on) for on in (True, False))
    assert error(frames[31:], np.stack(learned[30:])) < 0.9 * error(
        frames[31:], np.stack(plain[30:])
    )


@pytest.mark.parametrize("settings", [{}, {"noise": 0.02}])
def test_a_state_continues(sheet: Mesh, clip: tuple[Array, Array], settings: Any) -> None:
    """After each number of slices, and around the frame in which a shape first leaves."""
    frames, masks = clip

    def make(**more: Any) -> dynmesh.Completer:
        return dynmesh.Completer(
            sheet.faces, frames[0], method="detail", **{"learn": True, **settings, **more}
        )

    one, others = make(), []
    for n, (points, known) in enumerate(zip(frames[1:], masks, strict=True)):
        if n in (3, 4, 5, 6, 7, 8, 9, 56, 57, 58, 59, 60, 61, 62, 63, 64, 65, 66, 67, 68, 69):
            others.append(make(threads=2))
            others[-1].restore(one.state())
            assert others[-1].state() == one.state()
        expected = one.push(points, known)
        for other in others:
            np.testing.assert_array_equal(other.push(points, known), expected)
    for other in others:
        assert other.state() == one.state()
    with pytest.raises(ValueError, match="learn is True, not False"):
        make(learn=False).restore(one.state())


@pytest.mark.parametrize(("name", "most"), [("ea_bone", 0.80), ("ocean_sim_50x50", 1.02)])
def test_recorded_subjects(data: Path, name: str, most: float) -> None:
    """One recurs, the other does not."""
    sequence = dynmesh.read(data / f"{name}.npz")
    frames = sequence.vertices[:60]
    masks = list(dynmesh.degrade.patch_known(sequence.faces, 60, frames.shape[1], 0.3, seed=0))[1:]
    errors = errors_of(sequence, frames, masks, {"learn": False}, {"learn": True})
    assert errors[1] <= most * errors[0]
