"""Method detail that learns from the frames that it completes."""

import meshes
import numpy as np
import pytest
from meshes import Array
from test_training import completed, error
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


def test_what_recurs_is_completed_more_accurately(rng: np.random.Generator) -> None:
    """A corner comes and goes."""
    sheet = meshes.sheet(12)
    frames = swinging(sheet.vertices, 90)
    masks = rng.random((89, len(sheet.vertices))) < 0.4
    hidden = np.arange(89) % 30 >= 15
    masks &= ~(hidden[:, None] & (sheet.vertices[:, 0] > 6))
    learned, plain = (completed(sheet, frames, masks, learn=on)[30:] for on in (True, False))
    assert error(frames[31:], np.stack(learned)) < 0.9 * error(frames[31:], np.stack(plain))
