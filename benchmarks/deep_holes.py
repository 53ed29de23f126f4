"""A small subject that deforms where it is not seen, for comparisons in deep holes.

A hole has 12, 16 or 20 rings around a vertex, hides it for ten frames, and then the next one opens.
"""

import numpy as np

from dynmesh._arrays import Mask
from dynmesh.synth._skin import Flesh, chained, turn, wrapped
from dynmesh.topology import cells

from .subjects import Subject

_FRAMES, _FPS = 31, 30.0
_RINGS, _LIFETIME = (12, 16, 20), 10
_SECONDS = np.arange(_FRAMES) / _FPS


def flippers() -> Subject:
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
