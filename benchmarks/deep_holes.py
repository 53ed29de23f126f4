"""Small subjects that deform where they are not seen, for comparisons in deep holes.

A hole has 12, 16 or 20 rings around a vertex, hides it for ten frames, and then the next one opens.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from dynmesh._arrays import Mask
from dynmesh.synth._skin import Flesh, chained, turn, wrapped
from dynmesh.topology import cells

from .subjects import Subject

_FRAMES, _FPS = 31, 30.0
_RINGS, _LIFETIME = (12, 16, 20), 10
_SECONDS = np.arange(_FRAMES) / _FPS

Floats = NDArray[np.float64]


def _bell() -> Subject:
    """Return a bell whose rim contracts later than its top, which pushes it upwards."""
    k = 2000
    s = np.sqrt((np.arange(k) + 0.5) / k)  # the distance from the top along the surface
    around = np.arange(k) * np.pi * (3 - np.sqrt(5))
    faces = Delaunay(s[:, None] * np.stack([np.cos(around), np.sin(around)], axis=1)).simplices
    along = np.linspace(0, 1, 201)
    beat = np.sin(2 * np.pi * (1.4 * _SECONDS[:, None] - 0.18 * along)) ** 2
    slope = 0.35 * np.pi * along + 0.9 * beat * along**2
    steps = np.stack([np.cos(slope), -np.sin(slope)]) / 200
    out, up = np.cumsum(steps, axis=2) - steps[:, :, :1]
    ribs = 0.012 * s * np.cos(9 * around)
    frames = []
    for r, z, rise in zip(out, up, np.cumsum(beat[:, -1]) / 60, strict=True):
        radius = np.interp(s, along, r) + ribs
        height = np.interp(s, along, z) + rise
        frames.append(np.stack([radius * np.cos(around), radius * np.sin(around), height], axis=1))
    return Subject("bell", np.array(frames), faces, "z", 20.0)


def _flippers() -> Subject:
    """Return a flat body that rows with two long flippers and steers with two short ones."""
    body = [((x, -0.5, 0.0), (x, 0.5, 0.0), (0.22, 0.18)) for x in (-0.3, 0.0, 0.3)]
    joints, tips = [(0.0, 0.0, 0.0)], []
    for side in (-1, 1):
        joints += [(side * 0.45, 0.45, 0.0), (side * 0.85, 0.5, 0.0), (side * 0.4, -0.55, 0.0)]
        tips += [(side * 0.85, 0.5, 0.0), (side * 1.35, 0.3, 0.0), (side * 0.75, -0.85, 0.0)]
    radii = [(0.14, 0.13), (0.13, 0.09), (0.12, 0.10)] * 2
    flesh = [*body, *zip(joints[1:], tips, radii, strict=True)]
    boxes = [((-9, 9), (-11, 11), (-2, 2))]
    for inner, outer, low, high in ((8, 25, 5, 10), (5, 15, -16, -10)):
        boxes += [((inner, outer), (low, high), (-1, 1)), ((-outer, -inner), (low, high), (-1, 1))]
    owners = [0, 0, 0, 1, 2, 3, 4, 5, 6]
    skin = wrapped(Flesh(flesh, 0.05), owners, boxes, 0.06, 6)
    phase = 2 * np.pi * 1.1 * _SECONDS
    turns = [turn(0, 6 * np.sin(phase))]
    for side in (-1, 1):
        turns += [
            turn(1, -side * 38 * np.sin(phase)) @ turn(0, 20 * np.cos(phase)),
            turn(1, -side * 30 * np.sin(phase - 0.9)),
            turn(2, side * 25 * np.sin(phase - 0.4)),
        ]
    motions = chained(joints, [None, 0, 1, 0, 0, 4, 0], turns)
    return Subject("flippers", skin.posed(motions).astype(np.float64), skin.faces, "z", 20.0)


def _box() -> Subject:
    """Return a long box with bumps that bends and twists."""
    sides = np.array([10, 10, 36])
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    squares = []
    for axis in range(3):
        across, down = np.delete(np.arange(3), axis)
        at = np.stack(np.meshgrid(*map(np.arange, sides[[across, down]]), indexing="ij"), axis=-1)
        for level, ring in ((0, corners[::-1]), (sides[axis], corners)):
            square = np.empty((at[..., 0].size, 4, 3), int)
            square[..., axis] = level
            square[..., [across, down]] = at.reshape(-1, 1, 2) + ring[:: -1 if axis == 1 else 1]
            squares.append(square)
    places, index = np.unique(np.concatenate(squares).reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 4)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    rest = places - sides / [2, 2, 1]
    bumps = np.sin(1.3 * places[:, 0]) + np.sin(1.1 * places[:, 1]) + np.sin(0.9 * places[:, 2])
    rest[:, :2] *= 1 + 0.05 * bumps[:, None]
    x, y, z = rest.T
    frames = []
    for seconds in _SECONDS:
        angle = 0.4 * np.sin(2 * np.pi * 0.7 * seconds) * (z / sides[2]) ** 2
        turned = np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y
        curvature = 0.045 * np.sin(2 * np.pi * 0.9 * seconds) + 1e-9
        bent, radius = curvature * z, 1 / curvature
        frames.append(
            np.stack(
                [
                    radius - (radius - turned[0]) * np.cos(bent),
                    turned[1],
                    (radius - turned[0]) * np.sin(bent),
                ],
                axis=1,
            )
        )
    return Subject("box", np.array(frames), faces, "z", 20.0)


SUBJECTS: dict[str, Callable[[], Subject]] = {"bell": _bell, "flippers": _flippers, "box": _box}


def masks(subject: Subject) -> list[Mask]:
    """Return the known mask of every frame."""
    offsets, neighbours = cells(subject.faces, subject.n_vertices)
    draw = np.random.default_rng(0)
    known = [np.ones(subject.n_vertices, bool)]
    for rings in _RINGS:
        hole = np.zeros(subject.n_vertices, bool)
        hole[draw.integers(subject.n_vertices)] = True
        for _ in range(rings):
            inside = np.repeat(hole, np.diff(offsets))
            hole[neighbours[inside]] = True
        known += [~hole] * _LIFETIME
    return known
