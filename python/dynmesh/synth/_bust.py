"""A bust: head, neck and shoulders, which look about and speak.

Rest pose: metres, x to the figure's right, y forward, z up, 0 at the lower edge of the chest.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ._skin import Capsule, Flesh, Skin, chained, turn, wrapped

_CELL = 0.0075  # metres
_BLEND = 0.006  # metres over which neighbouring flesh melts into one
_CHEST, _NECK, _NAPE, _HEAD, _JAW, _MOUTH = range(6)
_JOINTS = (
    (0.0, 0.0, 0.0),
    (0.0, -0.015, 0.150),
    (0.0, -0.010, 0.185),
    (0.0, -0.005, 0.235),
    (0.0, 0.005, 0.295),
    (0.0, 0.098, 0.290),
)
_PARENTS = (None, _CHEST, _NECK, _NAPE, _HEAD, _HEAD)
# Bone, ends and radii of each capsule of flesh, of the right half.
_CAPSULES = (
    (_CHEST, (-0.06, 0.0, 0.06), (0.06, 0.0, 0.06), 0.075, 0.075),
    (_CHEST, (0.03, -0.015, 0.108), (0.120, -0.01, 0.08), 0.052, 0.056),
    (_CHEST, (0.0, -0.02, 0.14), (0.10, -0.02, 0.115), 0.046, 0.036),
    (_NECK, (0.0, -0.017, 0.13), (0.0, -0.013, 0.175), 0.055, 0.052),
    (_NAPE, (0.0, -0.013, 0.175), (0.0, -0.006, 0.225), 0.052, 0.052),
    (_HEAD, (0.0, -0.006, 0.240), (0.0, -0.010, 0.290), 0.050, 0.055),
    (_HEAD, (0.0, -0.028, 0.345), (0.0, 0.010, 0.363), 0.077, 0.073),
    (_HEAD, (0.0, 0.040, 0.325), (0.0, 0.050, 0.280), 0.047, 0.033),
    (_HEAD, (0.028, 0.040, 0.322), (0.022, 0.044, 0.280), 0.040, 0.034),
    (_HEAD, (0.008, 0.076, 0.352), (0.044, 0.064, 0.354), 0.014, 0.013),  # brow
    (_HEAD, (0.033, 0.0700, 0.333), (0.034, 0.070, 0.333), 0.0135, 0.0135),  # eye
    (_HEAD, (0.040, 0.062, 0.307), (0.056, 0.035, 0.314), 0.017, 0.016),  # cheekbone
    (_HEAD, (0.040, 0.038, 0.290), (0.046, 0.020, 0.288), 0.024, 0.024),  # cheek
    (_HEAD, (0.0, 0.082, 0.346), (0.0, 0.106, 0.301), 0.0085, 0.0105),  # nose
    (_HEAD, (0.009, 0.098, 0.297), (0.011, 0.092, 0.297), 0.0075, 0.0075),  # nostril
    (_HEAD, (0.0, 0.094, 0.276), (0.022, 0.080, 0.270), 0.0095, 0.006),  # upper lip
    (_JAW, (0.0, 0.093, 0.252), (0.020, 0.079, 0.258), 0.0095, 0.006),  # lower lip
    (_JAW, (0.0, 0.074, 0.232), (0.014, 0.068, 0.233), 0.019, 0.018),  # chin
    (_JAW, (0.0, 0.050, 0.245), (0.028, 0.035, 0.252), 0.030, 0.027),
    (_JAW, (0.016, 0.058, 0.234), (0.052, 0.008, 0.262), 0.019, 0.018),
    (_HEAD, (0.053, 0.006, 0.270), (0.056, 0.004, 0.300), 0.019, 0.019),
    (_HEAD, (0.078, -0.012, 0.345), (0.074, -0.002, 0.312), 0.011, 0.008),  # ear
)
_LIPS, _MOUTH_SIZE = np.array([0.0, 0.095, 0.264]), np.array([0.022, 0.02, 0.006])
# Filled cells of the right half.
_BOXES = (
    ((0, 23), (-9, 8), (-1, 18)),
    ((0, 7), (-9, 6), (18, 29)),
    ((0, 10), (-14, 13), (29, 58)),
    ((0, 2), (13, 17), (38, 48)),
    ((10, 12), (-3, 1), (40, 48)),
)
_SOFTENING = 2  # diffusions of the weights: bends of about three edges


@lru_cache(maxsize=1)
def _skin() -> Skin:
    capsules: list[Capsule] = []
    owners = []
    for bone, start, end, r0, r1 in _CAPSULES:
        for side in (1, -1) if end[0] > 0.0 and start[0] >= 0.0 else (1,):
            mirror = np.array([side, 1, 1])
            capsules.append((start * mirror, end * mirror, (r0, r1)))
            owners.append(bone)
    boxes = [(side, y, z) for x, y, z in _BOXES for side in (x, (-x[1], -x[0]))]
    skin = wrapped(Flesh(capsules, _BLEND), owners, boxes, _CELL, _SOFTENING)
    # Between the lips the skin goes in when the jaw goes down.
    away = (skin.vertices - _LIPS) / _MOUTH_SIZE
    inside = np.exp(-np.sum(away**2, axis=1, keepdims=True))
    return Skin(
        skin.vertices, skin.faces, np.concatenate([skin.weights * (1 - inside), inside], axis=1)
    )


def speak(frames: int, seed: int, fps: float) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return the vertices (frames, k, 3) in metres and the faces of a bust that speaks."""
    draw = np.random.default_rng(seed)
    periods = np.array([3.4, 2.3, 4.1, 0.27, 0.9]) * draw.uniform(0.85, 1.15, 5)
    around = np.arange(frames) / (fps * periods[:, None]) + draw.uniform(0.0, 1.0, (5, 1))
    yaw, nod, roll, syllable, word = np.sin(2.0 * np.pi * around)
    opened = 0.1 + 0.8 * (0.5 + 0.5 * syllable) * np.clip(0.6 + word, 0.0, 1.0)
    look = turn(2, 20.0 * yaw) @ turn(0, 3.0 * nod) @ turn(1, 2.0 * roll)
    jaw, mouth = turn(0, -15.0 * opened), turn(0, -55.0 * opened)
    turns = [turn(2, 6.0 * yaw), look, look, look, jaw, mouth]
    skin = _skin()
    return skin.posed(chained(_JOINTS, _PARENTS, turns)), skin.faces.copy()
