"""The choreography of a figure that walks, turns round, does a handstand and stands up again.

Feet and hands follow paths, on the floor or relative to the trunk, and the limbs follow by inverse
kinematics. World axes: z up, floor at 0; the walk is along y. Angles are in degrees.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._body import JOINTS, LEFT, MIDLINE, RIGHT, SIDES, Bone, Pose, body_of_girth
from ._skin import Floats, Keys, track, turn

_DURATION = 5.83  # seconds
_STEP_TIME = 0.42  # seconds from footfall to footfall
_STEP_LENGTH = 0.5  # metres
_WALK_END = 6.0  # steps

# Steps, then the pelvis: x (m), y (step lengths), y (m), heading, share of the walk's swings.
_PELVIS_PATH: Keys = (
    (-1.0, 0.00, -1.5, 0.00, 0, 1.0),
    (0.0, 0.00, -0.5, 0.00, 0, 1.0),
    (2.5, 0.00, 2.0, 0.00, 0, 1.0),
    (3.5, -0.08, 2.85, 0.04, 45, 0.7),
    (4.0, -0.09, 3.0, 0.08, 75, 0.5),
    (5.0, -0.08, 3.0, 0.15, 140, 0.2),
    (6.0, -0.05, 3.0, 0.15, 180, 0.0),
)
# Steps, then the foot: x (m), y (step lengths), y (m), heading. A foot on the floor may pivot.
_FOOT_PATHS: dict[int, Keys] = {
    LEFT: (
        (0.1, -0.09, -1, 0.00, 0),
        (0.9, -0.09, 1, 0.00, 0),
        (2.1, -0.09, 1, 0.00, 0),
        (2.9, -0.09, 3, 0.00, 0),
        (3.1, -0.09, 3, 0.00, 0),
        (4.1, -0.09, 3, 0.00, 48),
        (4.9, 0.05, 3, 0.15, 180),
    ),
    RIGHT: (
        (1.1, 0.09, 0, 0.00, 0),
        (1.9, 0.09, 2, 0.00, 0),
        (3.1, 0.09, 2, 0.00, 0),
        (3.5, 0.10, 3, 0.02, 20),
        (3.9, -0.10, 3, 0.29, 95),
        (4.1, -0.10, 3, 0.29, 95),
        (5.1, -0.10, 3, 0.29, 135),
        (5.9, -0.15, 3, 0.15, 180),
    ),
}
# Step during which a foot swings forward, and how far it rolls from heel to toe.
_SWINGS: dict[int, Keys] = {
    LEFT: ((0, 1.0), (2, 1.0), (4, 0.5)),
    RIGHT: ((1, 1.0), (3, 0.5), (5, 0.5)),
}
# From here on, seconds after the walk.
# The trunk: advance (m), height of the hips (m), pitch of the pelvis, curl of the back, nod.
_TRUNK: Keys = (
    (0.00, 0.00, 0.915, 3, 2, -4),
    (0.62, -0.10, 0.80, 75, 50, -30),
    (0.90, 0.04, 0.93, 110, 40, -34),
    (1.20, 0.27, 1.07, 145, 20, -45),
    (1.52, 0.52, 1.126, 180, -6, -35),
    (2.10, 0.52, 1.126, 180, -6, -35),
    (2.40, 0.27, 1.07, 145, 20, -45),
    (2.67, 0.04, 0.93, 110, 40, -34),
    (2.89, -0.10, 0.80, 75, 50, -30),
    (3.31, 0.00, 0.92, 2, 2, -4),
)
# The legs: hold on the floor (0 to 1), flexion of the hip, reach (leg lengths), pitch of the foot.
_LEGS: dict[int, Keys] = {
    LEFT: (
        (0.70, 1, 80, 0.85, 0),
        (0.95, 1, 75, 0.80, -34),
        (1.20, 0, 62, 0.78, -34),
        (1.45, 0, 30, 0.88, -34),
        (1.68, 0, 0, 1.00, -34),
        (2.07, 0, 0, 1.00, -34),
        (2.37, 0, 15, 0.95, -34),
        (2.65, 0, 58, 0.76, -20),
        (2.91, 1, 85, 0.70, 0),
    ),
    RIGHT: (
        (0.45, 1, 85, 0.85, 0),
        (0.62, 1, 80, 0.74, -34),
        (0.86, 0, 62, 0.82, -34),
        (1.10, 0, 30, 0.93, -34),
        (1.38, 0, -2, 1.00, -34),
        (1.68, 0, 0, 1.00, -34),
        (2.03, 0, 0, 1.00, -34),
        (2.27, 0, 50, 0.88, -34),
        (2.51, 0, 82, 0.72, -20),
        (2.75, 1, 88, 0.70, 0),
    ),
}
# The arms: hold on the floor (0 to 1), lift before the chest, turn of the elbows from back to out
# (0 to 1), lift of the shoulders.
_ARMS: Keys = (
    (0.10, 0, 4, 0, 0),
    (0.30, 0, 50, 0.5, 8),
    (0.62, 1, 110, 1, 28),
    (2.89, 1, 110, 1, 28),
    (3.09, 0, 50, 0.5, 8),
    (3.29, 0, 4, 0, 0),
)
# The sway of the trunk while it balances (0 to 1).
_BALANCING: Keys = ((1.40, 0), (1.60, 1), (2.00, 1), (2.20, 0))
_SWAY_PERIOD = 0.45  # seconds

_HIP_SWAY, _HIP_DROP, _HIP_BOB, _HIP_TWIST = 0.02, 0.026, 0.016, 7.0  # of the walk, m and degrees
_ARM_SWING, _ARM_SPREAD, _ARM_REACH = 24.0, 11.0, 0.96
_HANDS_FORWARD, _HANDS_APART, _WRIST_HEIGHT = 0.52, 0.40, 0.038  # metres, on the floor
_FOOT_LIFT, _HEEL_OFF, _HEEL_STRIKE = 0.05, -32.0, 14.0  # of a swing, metres and degrees
_LEG_SPREAD, _TOES_POINTED = 3.5, -40.0  # off the floor
_FORWARD = np.array([0.0, 1.0, 0.0])
_BALL, _HEEL = np.array([0.0, 0.155, -0.085]), np.array([0.0, -0.05, -0.085])  # from the ankle
_SLACK = 0.006  # metres over which a stretched limb bends


class Gait(NamedTuple):
    """What differs from one figure to the next, as factors near one."""

    stride: float
    swing: float
    bounce: float
    pace: float
    girth: float
    stature: float


_GAIT_SPREAD = np.array([0.06, 0.15, 0.2, 0.12, 0.05, 0.04])  # of each of its factors


def walk(frames: int, seed: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return the vertices (frames, 10002, 3) in metres and the faces (20000, 3) of a performance.

    The choreography always fills the frames; the first and the last are its first and last pose.
    """
    gait = Gait(*(1.0 + _GAIT_SPREAD * np.random.default_rng(seed).uniform(-1.0, 1.0, 6)))
    body = body_of_girth(gait.girth)
    around = np.linspace(0.0, 2.0 * np.pi, frames)
    seconds = _DURATION / (2.0 * np.pi) * (around + (gait.pace - 1.0) * np.sin(around))
    vertices = body.posed(_pose(seconds, gait).motions())
    vertices *= np.float32(gait.stature)
    return vertices, body.faces.copy()


def _pose(seconds: Floats, gait: Gait) -> Pose:
    pose = Pose({}, {})
    _move_trunk(pose, seconds, gait)
    for side in SIDES:
        _move_leg(pose, side, seconds, gait)
        _move_arm(pose, side, seconds, gait)
    return pose


def _move_trunk(pose: Pose, seconds: Floats, gait: Gait) -> None:
    steps, after = _clocks(seconds)
    x, strides, y, heading, walking = track(steps, _PELVIS_PATH)
    advance, height, pitch, curl, nod = track(after, _TRUNK)
    x = x + _HIP_SWAY * gait.bounce * walking * np.sin(np.pi * steps)
    y = y + _STEP_LENGTH * gait.stride * strides - advance  # the walk's end faces against y
    bob = _HIP_BOB * gait.bounce * np.cos(2.0 * np.pi * steps)
    height = height - walking * (_HIP_DROP + bob)
    twist = _HIP_TWIST * gait.swing * walking * np.cos(np.pi * steps)
    (balancing,) = track(after, _BALANCING)
    sway = balancing * np.sin(2.0 * np.pi * after / _SWAY_PERIOD)
    pose.joints["pelvis", MIDLINE] = np.stack([x, y, height], axis=1)
    pose.rotations["pelvis", MIDLINE] = turn(2, heading - twist) @ turn(0, -pitch - 2.0 * sway)
    for bone, parent, turned, bend in (
        ("spine", "pelvis", 0.8 * twist, 0.5 * curl),
        ("chest", "spine", 0.8 * twist, 0.5 * curl - 3.0 * sway),
        ("neck", "chest", -0.4 * twist, 0.5 * nod),
        ("head", "neck", -0.2 * twist, 0.5 * nod),
    ):
        local = turn(2, turned) @ turn(0, -bend)
        _attach(pose, (bone, MIDLINE), (parent, MIDLINE), local)


def _move_leg(pose: Pose, side: int, seconds: Floats, gait: Gait) -> None:
    steps, after = _clocks(seconds)
    hold, flexion, reach, pitch = track(after, _LEGS[side])
    ankle, sole = _foot_on_floor(side, steps, pitch, gait)
    pelvis = pose.rotations["pelvis", MIDLINE]
    hip = pose.carried(("pelvis", MIDLINE), JOINTS["thigh", side])
    bones = [("thigh", side), ("shin", side), ("foot", side)]
    leg = _limb_direction(pelvis, side, flexion, _LEG_SPREAD)
    free = hip + (reach * sum(_lengths(bones)))[:, None] * leg
    target = _mixed(free, ankle, hold)
    hinge = pelvis[:, :, 0] + hold[:, None] * sole[:, :, 0]
    _bend_limb(pose, bones, hip, target, np.cross(hinge, target - hip), _FORWARD)
    pointed = pose.rotations["shin", side] @ turn(0, np.full(len(seconds), _TOES_POINTED))
    pose.rotations["foot", side] = _between(pointed, sole, hold)


def _foot_on_floor(side: int, steps: Floats, pitch: Floats, gait: Gait) -> tuple[Floats, Floats]:
    """Return the ankle (n, 3) and rotation (n, 3, 3) of a foot rolling over heel and ball."""
    x, strides, y, heading = track(steps, _FOOT_PATHS[side])
    lifts: list[tuple[float, ...]] = []
    rolls: list[tuple[float, ...]] = []
    for step, roll in _SWINGS[side]:
        lifts += [(step + 0.1, 0.0), (step + 0.5, _FOOT_LIFT), (step + 0.9, 0.0)]
        rolls += [(step - 0.2, 0.0), (step + 0.14, _HEEL_OFF * roll)]
        rolls += [(step + 0.84, _HEEL_STRIKE * roll), (step + 1.04, 0.0)]
    (lift,), (rolled,) = track(steps, tuple(lifts)), track(steps, tuple(rolls))
    pitch = pitch + rolled
    on_heel = 0.5 + 0.5 * np.tanh(pitch / 5.0)
    pivot = on_heel[:, None] * _HEEL + (1.0 - on_heel)[:, None] * _BALL
    facing, roll_over = turn(2, heading), turn(0, pitch)
    ankle = np.stack([x, y + _STEP_LENGTH * gait.stride * strides, lift - _BALL[2]], axis=1)
    return ankle + _applied(facing, pivot - _applied(roll_over, pivot)), facing @ roll_over


def _move_arm(pose: Pose, side: int, seconds: Floats, gait: Gait) -> None:
    steps, after = _clocks(seconds)
    hold, lift, elbow_out, shrug = track(after, _ARMS)
    walking = track(steps, _PELVIS_PATH)[-1]
    lift = lift - side * _ARM_SWING * gait.swing * walking * np.cos(np.pi * steps)
    chest = pose.rotations["chest", MIDLINE]
    _attach(pose, ("clavicle", side), ("chest", MIDLINE), turn(1, -side * shrug))
    shoulder = pose.carried(("clavicle", side), JOINTS["upper arm", side])
    bones = [("upper arm", side), ("forearm", side), ("hand", side)]
    arm = _limb_direction(chest, side, lift, _ARM_SPREAD)
    free = shoulder + _ARM_REACH * sum(_lengths(bones)) * arm
    _, x, strides, y, *_ = _PELVIS_PATH[-1]
    end = y + _STEP_LENGTH * gait.stride * strides
    planted = np.array([x - side * _HANDS_APART / 2.0, end - _HANDS_FORWARD, _WRIST_HEIGHT])
    target = _mixed(free, planted, hold)
    elbow = np.stack([side * elbow_out, elbow_out - 1.0, 0.0 * elbow_out], axis=1)
    _bend_limb(pose, bones, shoulder, target, _applied(chest, elbow), -_FORWARD)
    fingers_ahead = turn(2, np.full(len(seconds), -90.0 * side))
    pose.rotations["hand", side] = _between(pose.rotations["forearm", side], fingers_ahead, hold)


def _clocks(seconds: Floats) -> tuple[Floats, Floats]:
    """Return the time in steps and in seconds after the walk."""
    return seconds / _STEP_TIME, seconds - _WALK_END * _STEP_TIME


def _attach(pose: Pose, bone: Bone, parent: Bone, local: Floats) -> None:
    pose.joints[bone] = pose.carried(parent, JOINTS[bone])
    pose.rotations[bone] = pose.rotations[parent] @ local


def _limb_direction(trunk: Floats, side: int, flexion: Floats, spread: float) -> Floats:
    """Return unit vectors (n, 3): down the trunk, `flexion` forward and `spread` sideways."""
    angle, tilt = np.radians(flexion), np.radians(spread)
    out = np.full(len(angle), side * np.sin(tilt))
    local = np.stack([out, np.cos(tilt) * np.sin(angle), -np.cos(tilt) * np.cos(angle)], axis=1)
    return _applied(trunk, local)


def _lengths(bones: list[Bone]) -> list[float]:
    return [float(np.linalg.norm(JOINTS[b] - JOINTS[a])) for a, b in pairwise(bones)]


def _bend_limb(
    pose: Pose, bones: list[Bone], root: Floats, target: Floats, pole: Floats, rest_pole: Floats
) -> None:
    """Place the first two of three `bones` and the joint of the third, by inverse kinematics.

    The limb reaches from `root` towards `target`, both (n, 3), as far as it can; its middle joint
    bends towards `pole` (n, 3), which corresponds to `rest_pole` (3,) at rest.
    """
    first, second, end = bones
    upper, lower = _lengths(bones)
    span = target - root
    distance = np.linalg.norm(span, axis=1)
    # A soft minimum: a hard one would snap the joint straight.
    reach = -_SLACK * np.logaddexp(-distance / _SLACK, -(upper + lower - _SLACK) / _SLACK)
    axes = _frame(span, pole)
    cosine = (upper**2 + reach**2 - lower**2) / (2.0 * upper * reach)
    sine = np.sqrt(np.maximum(0.0, 1.0 - cosine**2))
    middle = root + upper * (cosine[:, None] * axes[:, :, 0] + sine[:, None] * axes[:, :, 1])
    pose.joints[first], pose.joints[second] = root, middle
    pose.joints[end] = root + reach[:, None] * axes[:, :, 0]
    for bone, following in pairwise(bones):
        rest = _frame(JOINTS[following] - JOINTS[bone], rest_pole)
        bent = _frame(pose.joints[following] - pose.joints[bone], axes[:, :, 1])
        pose.rotations[bone] = bent @ rest.T


def _frame(first: Floats, second: Floats) -> Floats:
    """Return (..., 3, 3) rotations with columns along `first`, near `second`, and their cross."""
    x = first / np.linalg.norm(first, axis=-1, keepdims=True)
    y = second - np.sum(second * x, axis=-1, keepdims=True) * x
    y /= np.linalg.norm(y, axis=-1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _between(start: Floats, end: Floats, share: Floats) -> Floats:
    """Return rotations (n, 3, 3) the given share (n,) of the way from `start` to `end`."""
    mixed = start + share[:, None, None] * (end - start)
    return _frame(mixed[:, :, 0], mixed[:, :, 1])


def _mixed(start: Floats, end: Floats, share: Floats) -> Floats:
    return start + share[:, None] * (end - start)


def _applied(rotations: Floats, vectors: Floats) -> Floats:
    return np.asarray((rotations @ vectors[:, :, None])[:, :, 0])
