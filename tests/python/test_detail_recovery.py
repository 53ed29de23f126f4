"""Method detail recovers after an unrealistic frame."""

from collections.abc import Callable

import numpy as np
import pytest
from meshes import EVENTS, Array, Mesh, sheet
from numpy.typing import DTypeLike

import dynmesh


def waves(mesh: Mesh) -> tuple[Array, Array]:
    """Faces and seven frames of a mesh that rotates slightly, moves, and carries a wave."""
    frames = [mesh.vertices]
    for n in range(1, 7):
        angle = 0.05 * n
        turn = np.array(
            [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        )
        wave = 0.05 * n * np.sin(0.3 * mesh.vertices[:, :1]) * [0, 0, 1]
        frames.append(mesh.vertices @ turn.T + wave + 0.1 * n)
    return np.asarray(mesh.faces), np.array(frames)


def flat_grid() -> Mesh:
    """A mesh in the plane z = 0."""
    mesh = sheet(12)
    return Mesh(mesh.faces, mesh.vertices * [1, 1, 0])


SHAPES: dict[str, Callable[[], tuple[Array, Array]]] = {
    "grid": lambda: waves(flat_grid()),
    "bumpy grid": lambda: waves(sheet(12)),
    "triangle": lambda: waves(
        Mesh(np.array([[0, 1, 2]]), np.random.default_rng(0).normal(size=(3, 3)))
    ),
}


def errors(completer: dynmesh.Completer, frames: Array) -> Array:
    """Errors of five frames with a third of the vertices known, after one complete frame."""
    rng = np.random.default_rng(1)
    completer.push(frames[1])
    found = []
    for frame in frames[2:]:
        known = rng.random(len(frame)) < 0.3
        known[0] = True
        completed = completer.push(frame, known)
        found.append(np.linalg.norm(completed - frame, axis=1).mean())
    completer.restore(completer.state())
    return np.array(found)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("noise", [None, 0.01], ids=["exact", "noise"])
def test_one_complete_frame_restores_accuracy(
    shape: str, dtype: DTypeLike, noise: float | None
) -> None:
    faces, exact = SHAPES[shape]()
    frames = exact.astype(dtype)
    edges = frames[0][faces[:, 0]] - frames[0][faces[:, 1]]
    h = float(np.linalg.norm(edges, axis=1).mean())
    sigma = None if noise is None else noise * h
    completer = dynmesh.Completer(faces, frames[0], method="detail", noise=sigma)
    expected = errors(completer, frames)
    for name, event in EVENTS.items():
        centre = frames[0].mean(axis=0)
        completer.reset(frames[0])
        completer.push(((frames[0] - centre) @ event.T + centre).astype(dtype))
        completer.restore(completer.state())
        found = errors(completer, frames)
        assert (found <= 3 * np.maximum(expected, 1e-5 * h)).all(), (name, found, expected)
