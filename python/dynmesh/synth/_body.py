"""A human figure of exactly 10002 vertices and 20000 triangles, with a skeleton to pose it by.

The connectivity is the surface of a figure stacked from cells of a cubic lattice. Its shape is
the smooth union of tapered capsules, onto which that surface is projected while it is relaxed.

Rest pose: metres, x to the figure's right, y forward, z up, soles at 0, arms straight out.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ._skin import Flesh, Floats, Skin, rigid_motions, wrapped

Point = tuple[float, float, float]
Bone = tuple[str, int]  # name, and LEFT, RIGHT or MIDLINE

LEFT, MIDLINE, RIGHT = -1, 0, 1
SIDES = (LEFT, RIGHT)

_HIP, _KNEE, _ANKLE = (0.095, 0.025, 0.89), (0.095, 0.0, 0.50), (0.095, -0.01, 0.085)
_SHOULDER, _ELBOW, _WRIST = (0.188, 0.0, 1.408), (0.455, 0.0, 1.42), (0.71, 0.0, 1.42)

# Bone, parent, and the joint between them, parents first. Joints at positive x come in pairs.
_SKELETON = (
    ("pelvis", "", (0.0, 0.0, 0.92)),
    ("spine", "pelvis", (0.0, -0.01, 1.06)),
    ("chest", "spine", (0.0, -0.01, 1.20)),
    ("neck", "chest", (0.0, -0.01, 1.46)),
    ("head", "neck", (0.0, 0.01, 1.55)),
    ("clavicle", "chest", (0.03, 0.0, 1.42)),
    ("upper arm", "clavicle", _SHOULDER),
    ("forearm", "upper arm", _ELBOW),
    ("hand", "forearm", _WRIST),
    ("thigh", "pelvis", _HIP),
    ("shin", "thigh", _KNEE),
    ("foot", "shin", _ANKLE),
)

# Bone, ends and radii of each capsule of flesh. Capsules that start at positive x come in pairs.
_CAPSULES = (
    ("pelvis", (-0.055, -0.005, 0.94), (0.055, -0.005, 0.94), 0.094, 0.094),
    ("pelvis", (-0.052, 0.0, 1.00), (0.052, 0.0, 1.00), 0.083, 0.083),
    ("pelvis", (0.07, -0.055, 0.90), (0.07, -0.045, 0.95), 0.070, 0.060),
    ("spine", (-0.05, 0.003, 1.07), (0.05, 0.003, 1.07), 0.077, 0.077),
    ("spine", (-0.053, 0.005, 1.14), (0.053, 0.005, 1.14), 0.078, 0.078),
    ("chest", (-0.062, 0.004, 1.21), (0.062, 0.004, 1.21), 0.084, 0.084),
    ("chest", (-0.076, 0.003, 1.28), (0.076, 0.003, 1.28), 0.088, 0.088),
    ("chest", (-0.090, 0.0, 1.345), (0.090, 0.0, 1.345), 0.084, 0.084),
    ("clavicle", (0.05, -0.012, 1.435), (0.16, -0.004, 1.418), 0.054, 0.047),
    ("clavicle", (0.03, -0.018, 1.475), (0.13, -0.010, 1.43), 0.030, 0.042),
    ("neck", (0.0, -0.02, 1.44), (0.0, 0.005, 1.55), 0.060, 0.053),
    ("head", (0.0, -0.012, 1.650), (0.0, 0.012, 1.655), 0.084, 0.084),
    ("head", (0.0, 0.038, 1.625), (0.0, 0.052, 1.57), 0.060, 0.043),
    ("head", (0.0, 0.088, 1.645), (0.0, 0.104, 1.62), 0.016, 0.016),
    ("upper arm", (0.185, 0.0, 1.42), (0.435, 0.0, 1.42), 0.053, 0.037),
    ("forearm", (0.475, 0.0, 1.42), _WRIST, 0.038, 0.022),
    ("hand", (0.735, 0.022, 1.42), (0.855, 0.022, 1.415), 0.012, 0.009),
    ("hand", (0.735, 0.0, 1.42), (0.875, 0.0, 1.415), 0.012, 0.009),
    ("hand", (0.735, -0.022, 1.42), (0.845, -0.022, 1.415), 0.012, 0.009),
    ("hand", (0.745, 0.02, 1.415), (0.79, 0.068, 1.41), 0.016, 0.014),
    ("thigh", (0.095, 0.0, 0.92), (0.095, 0.0, 0.515), 0.078, 0.045),
    ("shin", (0.095, 0.0, 0.475), _ANKLE, 0.043, 0.032),
    ("shin", (0.096, -0.024, 0.40), (0.094, -0.020, 0.30), 0.034, 0.030),
    ("foot", (0.095, -0.04, 0.034), (0.10, 0.05, 0.045), 0.030, 0.030),
    ("foot", (0.10, 0.04, 0.040), (0.112, 0.145, 0.022), 0.030, 0.018),
    ("foot", (0.095, 0.04, 0.040), (0.088, 0.155, 0.022), 0.030, 0.020),
)
_BLEND = 0.013  # metres over which neighbouring capsules melt into one another

# The lattice figure's right half, in cells from the mirror plane, the ankles' axis and the floor.
# Sizes follow the girths and lengths of the limbs and make a surface of exactly 10000 squares.
_CELL = 0.015  # metres
_BOXES = (
    ((2, 10), (-5, 4), (32, 54)),  # thigh
    ((3, 9), (-4, 3), (5, 32)),  # shin
    ((3, 9), (-5, 12), (0, 5)),  # foot
    ((0, 11), (-7, 5), (54, 65)),  # pelvis
    ((0, 10), (-6, 5), (65, 81)),  # waist
    ((0, 11), (-7, 5), (81, 97)),  # chest
    ((11, 47), (-3, 2), (92, 97)),  # arm
    ((47, 59), (-4, 3), (93, 96)),  # hand
    ((49, 53), (3, 6), (93, 96)),  # thumb
    ((0, 3), (-4, 3), (97, 103)),  # neck
    ((0, 5), (-5, 7), (103, 117)),  # head
)
_WEIGHT_DIFFUSIONS = 45  # a standard deviation of about four edges, the bend of a joint


def _sides(point: Point) -> tuple[int, ...]:
    return SIDES if point[0] > 0.0 else (MIDLINE,)


def _on_side(point: Point, side: int) -> Floats:
    return np.array(point) * (side or 1, 1, 1)


JOINTS: dict[Bone, Floats] = {
    (name, side): _on_side(joint, side) for name, _, joint in _SKELETON for side in _sides(joint)
}


def _parent(bone: Bone) -> Bone | None:
    """Return the bone that carries `bone`, on its own side if that side has one."""
    name, side = bone
    above = next(parent for child, parent, _ in _SKELETON if child == name)
    return next((b for b in ((above, side), (above, MIDLINE)) if b in JOINTS), None)


PARENTS: dict[Bone, Bone | None] = {bone: _parent(bone) for bone in JOINTS}


@dataclass(frozen=True, eq=False)
class Pose:
    """Where the bones are in `n` frames: (n, 3, 3) rotations from rest and (n, 3) joints."""

    rotations: dict[Bone, Floats]
    joints: dict[Bone, Floats]

    def carried(self, bone: Bone, point: Floats) -> Floats:
        """Return where (n, 3) the rest pose `point` (3,) is when it moves with `bone`."""
        return self.joints[bone] + self.rotations[bone] @ (point - JOINTS[bone])

    def motions(self) -> Floats:
        """Return what moves each bone from rest, as dual quaternions (n, b, 8)."""
        bones = list(JOINTS)
        return rigid_motions(
            [self.rotations[bone] for bone in bones],
            [self.carried(bone, np.zeros(3)) for bone in bones],
            [bones.index(parent) if parent else None for parent in PARENTS.values()],
        )


@lru_cache(maxsize=4)
def body_of_girth(girth: float) -> Skin:
    """Return the figure with all its flesh `girth` times as thick as usual.

    It has 10002 vertices in metres, 20000 faces, and a weight for each of `JOINTS` in their order.
    """
    rows = [
        ((bone, side), (_on_side(start, side), _on_side(end, side), (r0 * girth, r1 * girth)))
        for bone, start, end, r0, r1 in _CAPSULES
        for side in _sides(start)
    ]
    bones = list(JOINTS)
    # Paired flesh may belong to a bone on the midline.
    owners = [bones.index(bone if bone in JOINTS else (bone[0], MIDLINE)) for bone, _ in rows]
    flesh = Flesh([capsule for _, capsule in rows], _BLEND)
    boxes = [(side, y, z) for x, y, z in _BOXES for side in (x, (-x[1], -x[0]))]
    return wrapped(flesh, owners, boxes, _CELL, _WEIGHT_DIFFUSIONS)
