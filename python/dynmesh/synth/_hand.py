"""A right hand that closes and counts on its fingers.

Rest pose: metres, x towards the thumb, the palm faces against y, fingers up z, wrist at 0.
"""

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ._skin import Capsule, Flesh, Skin, chained, track, turn, wrapped

_CELL = 0.004  # metres
_RADII = (0.0088, 0.0080, 0.0072, 0.0064)  # metres, of a finger from its root on
_BLEND = 0.0015  # metres over which neighbouring flesh melts into one
# Little finger to forefinger: where it starts, x and z, and the lengths of its three bones.
_FINGERS = (
    (-0.031, 0.082, (0.033, 0.020, 0.018)),
    (-0.010, 0.090, (0.041, 0.027, 0.019)),
    (0.011, 0.093, (0.045, 0.030, 0.020)),
    (0.032, 0.089, (0.040, 0.025, 0.019)),
)
_THUMB = ((0.026, 0.022), (0.049, 0.054), (0.065, 0.080), (0.076, 0.102))  # x and z of its joints
# Filled cells: wrist, palm, fingers from little to forefinger, and steps of the thumb.
_BOXES = (
    ((-7, 7), (-4, 4), (-13, 3)),
    ((-10, 10), (-3, 3), (2, 22)),
    *(((x, x + 4), (-2, 2), (21, top)) for x, top in ((-10, 41), (-5, 47), (1, 50), (6, 46))),
    *(
        ((x, x + 4), (-2, 2), (z, z + 5))
        for x, z in ((9, 6), (11, 10), (13, 14), (15, 18), (17, 22))
    ),
)
# Seconds, and the share to which thumb, fore, middle, ring and little finger are bent.
_COUNT = (
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (0.6, 1.0, 1.0, 1.0, 1.0, 1.0),
    (1.0, 0.0, 1.0, 1.0, 1.0, 1.0),
    (1.4, 0.0, 0.0, 1.0, 1.0, 1.0),
    (1.8, 0.0, 0.0, 0.0, 1.0, 1.0),
    (2.2, 0.0, 0.0, 0.0, 0.0, 1.0),
    (2.6, 0.0, 0.0, 0.0, 0.0, 0.0),
    (3.2, 0.0, 0.0, 0.0, 0.0, 0.0),
)
_BENDS = (75.0, 90.0, 60.0)  # degrees of the joints of a finger in a fist
_PERIOD = 3.2  # seconds
_SOFTENING = 6  # diffusions of the weights: a bend of about two edges


# Bone 0 is the palm; then come three bones of the thumb, and of each finger from the forefinger on.
_CHAINS = [
    _THUMB,
    *([(x, z + sum(bones[:i])) for i in range(4)] for x, z, bones in reversed(_FINGERS)),
]
_JOINTS = [(0.0, 0.0, 0.0), *((x, 0.0, z) for chain in _CHAINS for x, z in chain[:3])]
_PARENTS = [None, *(0 if bone % 3 == 1 else bone - 1 for bone in range(1, len(_JOINTS)))]


@lru_cache(maxsize=1)
def _skin() -> Skin:
    wrist = [((x, 0.0, -0.040), (x, 0.0, 0.010), (0.018, 0.018)) for x in (-0.011, 0.0, 0.011)]
    palm = [((0.4 * x, 0.0, 0.012), (x, 0.0, z - 0.006), (0.014, 0.0115)) for x, z, _ in _FINGERS]
    flesh: list[Capsule] = [*wrist, *palm]
    owners = [0] * len(flesh)
    for chain in _CHAINS:
        for i, ((x, z), (x1, z1)) in enumerate(pairwise(chain)):
            owners.append(owners[-1] + 1)
            flesh.append(((x, 0.0, z), (x1, 0.0, z1), (_RADII[i], _RADII[i + 1])))
    return wrapped(Flesh(flesh, _BLEND), owners, _BOXES, _CELL, _SOFTENING)


def count(frames: int, seed: int, fps: float) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return the vertices (frames, k, 3) in metres and the faces of a hand that counts to five."""
    draw = np.random.default_rng(seed)
    seconds = np.arange(frames) / fps * draw.uniform(0.85, 1.15)
    bent = track(seconds % _PERIOD, _COUNT) * draw.uniform(0.85, 1.0, (5, 1))
    sway, tilt = draw.uniform(8.0, 16.0, 2)[:, None] * np.sin(
        2.0 * np.pi * seconds / [[2.7], [1.9]]
    )
    turns = [turn(2, sway) @ turn(1, 0.5 * tilt) @ turn(0, 0.3 * sway)]
    for bend in _BENDS:  # the thumb, which turns before the palm
        turns.append(turn(2, -0.4 * bend * bent[0]) @ turn(1, -0.25 * bend * bent[0]))
    for finger in range(1, 5):
        spread = turn(1, (2.5 - finger) * 4.0 * (1.0 - bent[finger]))
        bends = [turn(0, bend * bent[finger]) for bend in _BENDS]
        turns += [spread @ bends[0], *bends[1:]]
    skin = _skin()
    return skin.posed(chained(_JOINTS, _PARENTS, turns)), skin.faces.copy()
