"""A heart that beats beside a lung that breathes.

Metres, x to the left of the body, y forward, z up, 0 in the middle of the heart.
"""

import numpy as np
from numpy.typing import NDArray

from ._skin import Floats, turn

_GRID = 18  # edges along the side of the cube of which an organ is the image
_BEAT, _BREATH = 0.9, 4.0  # seconds
_GAP = 0.004  # metres between the organs
_HEART = np.array([0.040, 0.037, 0.056])  # metres, half the extents
_LUNG, _LUNG_CENTRE = np.array([0.060, 0.075, 0.120]), np.array([0.090, -0.012, 0.030])
_TILT = turn(1, np.array([-35.0]))[0] @ turn(0, np.array([25.0]))[0]  # of the heart's axis
# Direction, height, width and steepness of what rises: both atria, aorta, artery of the lungs.
_BUMPS = (
    ((-0.75, -0.2, 0.55), 0.30, 0.40, 2),
    ((0.65, -0.5, 0.55), 0.25, 0.40, 2),
    ((-0.20, -0.1, 1.0), 0.55, 0.26, 6),
    ((0.30, 0.36, 0.9), 0.40, 0.22, 6),
)
_SHORTER, _NARROWER, _TWIST = 0.12, 0.20, 14.0  # of the ventricles; degrees of the apex
_SIDEWAYS, _DOWN = 0.06, 0.10  # of the lung, as it fills


def beat(frames: int, seed: int, fps: float) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return the vertices (frames, k, 3) in metres and the faces of both organs."""
    draw = np.random.default_rng(seed)
    seconds = np.arange(frames) / fps * draw.uniform(0.85, 1.15, (2, 1))
    beats, breaths = seconds / [[_BEAT], [_BREATH]] + draw.uniform(0.0, 1.0, (2, 1))
    directions, faces = _sphere()
    heart, lung = _heart(directions), _lung(directions)
    depth = np.clip(0.5 - 0.5 * heart[:, 2] / _HEART[2], 0.0, 1.0)  # 1 at the apex, 0 at the base
    vertices = np.empty((frames, 2 * len(directions), 3), dtype=np.float32)
    for frame, now, breath in zip(vertices, beats, np.sin(np.pi * breaths) ** 2, strict=True):
        squeeze = _pulse(now - 0.17 * np.minimum(1.0, 2.0 * depth))  # the atria come first
        twist = turn(2, _TWIST * squeeze * (depth - 0.4))
        smaller = 1.0 - np.stack([_NARROWER * squeeze] * 2 + [_SHORTER * squeeze], axis=1)
        frame[: len(heart)] = (twist @ (heart * smaller)[:, :, None])[:, :, 0] @ _TILT.T
        # It fills away from the heart and, with the midriff, down.
        away = np.array([1.0 + _SIDEWAYS * breath, 1.0 + 0.5 * _SIDEWAYS * breath, 1.0])
        filled = lung * away
        filled[:, 2] -= _DOWN * breath * np.maximum(0.0, _LUNG[2] - lung[:, 2])
        frame[len(heart) :] = filled
    return vertices, np.concatenate([faces, faces + len(directions)]).astype(np.int32)


def _pulse(beats: Floats) -> Floats:
    """Return how far muscle is contracted, which takes a third of a beat, and rests in between."""
    return np.asarray(np.sin(np.pi * np.clip((beats % 1.0) / 0.45, 0.0, 1.0)) ** 2)


def _heart(directions: Floats) -> Floats:
    """Return the heart at rest, its axis up z and its apex below."""
    radius = np.ones(len(directions))
    for direction, height, width, power in _BUMPS:
        away = np.linalg.norm(directions - np.divide(direction, np.linalg.norm(direction)), axis=1)
        radius += height * np.exp(-((away / width) ** power))
    taper = 1.0 - 0.28 * np.clip(-directions[:, 2], 0.0, 1.0) ** 2
    across = np.stack([taper, taper, np.ones_like(taper)], axis=1)
    return np.asarray(directions * radius[:, None] * _HEART * across)


def _lung(directions: Floats) -> Floats:
    x, y, z = directions.T
    narrow = 1.0 - 0.35 * np.clip(z, 0.0, 1.0) ** 2
    lung = _LUNG_CENTRE + _LUNG * np.stack([narrow * x, narrow * y, z], axis=1)
    room = 1.25 * _HEART.max() + _GAP
    away = np.linalg.norm(lung, axis=1, keepdims=True)
    return np.asarray(lung * (away**12 + room**12) ** (1.0 / 12.0) / away)


def _sphere() -> tuple[Floats, NDArray[np.int64]]:
    """Return directions evenly around and the triangles between them, oriented outward."""
    lines = np.tan(np.linspace(-0.25 * np.pi, 0.25 * np.pi, _GRID + 1))
    i = np.arange(_GRID)
    cells = np.stack(np.meshgrid(i, i, indexing="ij"), axis=-1).reshape(-1, 1, 2)
    around, squares = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]), []
    for axis in range(3):
        for level, ring in ((0, around[::-1]), (1, around)):
            square = np.insert(cells + ring, 0, level * _GRID, axis=2)
            squares.append(np.roll(square, axis, axis=2))
    places, index = np.unique(np.concatenate(squares).reshape(-1, 3), axis=0, return_inverse=True)
    cube = lines[places]
    faces = index.reshape(-1, 4)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return cube / np.linalg.norm(cube, axis=1, keepdims=True), faces
