"""A stag beetle of 31 rigid parts, which walks with three legs on the ground at a time.

Metres, x to the right, y forward, z up, the ground at 0. A part is a closed surface of its own.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._skin import Floats, turn

_AROUND, _ALONG = 14, 9  # vertices of a part around its axis, and rings along it
_HEIGHT, _STRIDE, _PERIOD, _LIFT = 0.015, 0.018, 0.5, 0.007  # metres and seconds of a stride
# Both ends of the axis and the semi-axes across it, relative to the trunk; legs go along x.
_THORAX = ((0.0, -0.002, 0.0), (0.0, 0.016, 0.0), 0.0110, 0.0060)
_ABDOMEN = ((0.0, -0.031, -0.001), (0.0, 0.004, -0.001), 0.0105, 0.0050)
_HEAD = ((0.0, 0.0, 0.0), (0.0, 0.0125, -0.0005), 0.0085, 0.0042)
_WING = ((0.0, -0.034, 0.0), (0.0, 0.002, 0.0), 0.0064, 0.0042)
_JAW = ((0.0, 0.0, 0.0), (-0.0025, 0.021, 0.002), 0.0019, 0.0016)
_NECK, _WING_HINGE, _JAW_HINGE = (0.0, 0.014, 0.0), (0.005, 0.0, 0.0027), (0.0052, 0.0105, 0.0)
_HIPS = ((0.007, 0.010, -0.003), (0.007, 0.0, -0.003), (0.007, -0.011, -0.003))
_FEET = ((0.026, 0.029), (0.032, -0.004), (0.027, -0.033))  # x and y, where the trunk is above
_COXA, _FEMUR, _TIBIA, _FOOT = 0.005, 0.014, 0.016, 0.009  # lengths of the parts of a leg
_THICK = {_COXA: 0.0022, _FEMUR: 0.0018, _TIBIA: 0.0013, _FOOT: 0.0008}
_SLOPES = (-10.0, -12.0)  # degrees of the first and the last part of a leg


class _Part(NamedTuple):
    """Ends, semi-axes, and for each frame the rotation and where the origin goes."""

    shape: tuple[ArrayLike, ArrayLike, float, float]
    rotations: Floats
    origins: Floats


def march(frames: int, seed: int, fps: float) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return the vertices (frames, k, 3) in metres and the faces of a beetle that walks."""
    draw = np.random.default_rng(seed)
    stride, pace = np.array([_STRIDE, 1.0 / _PERIOD]) * draw.uniform(0.85, 1.15, 2)
    phase = np.arange(frames) / fps * pace + draw.uniform()
    swing, bob = np.sin(2.0 * np.pi * phase), np.cos(4.0 * np.pi * phase)
    trunk = turn(2, 3.0 * swing) @ turn(0, bob) @ turn(1, 2.0 * swing)
    middle = np.stack([0.001 * swing, stride * phase, _HEIGHT + 0.0006 * bob], axis=1)
    head, neck = trunk @ turn(0, 8.0 * np.sin(0.9 * phase)), middle + trunk @ _NECK
    parts = [
        _Part(_THORAX, trunk, middle),
        _Part(_ABDOMEN, trunk, middle),
        _Part(_HEAD, head, neck),
    ]
    gape = 16.0 * np.sin(1.7 * phase)
    opened = 55.0 * np.clip(2.0 * np.sin(0.8 * phase + draw.uniform(0.0, 6.0)) - 0.8, 0.0, 1.0)
    for side in (-1, 1):
        mirror = np.array([side, 1, 1])
        wing = trunk @ turn(2, side * opened) @ turn(0, -0.5 * opened)
        parts.append(_Part(_WING, wing, middle + trunk @ (mirror * _WING_HINGE)))
        jaw = (mirror * _JAW[0], mirror * _JAW[1], *_JAW[2:])
        parts.append(_Part(jaw, head @ turn(2, -side * gape), neck + head @ (mirror * _JAW_HINGE)))
        for number, (hip, (x, y)) in enumerate(zip(_HIPS, _FEET, strict=True)):
            late = 0.5 * ((number + (side > 0)) % 2)  # neighbours take turns
            strides, share = np.divmod(phase + late, 1.0)
            swung = np.clip(2.0 * share - 1.0, 0.0, 1.0)  # it stands for the first half
            ahead = strides + 0.25 - late + swung * swung * (3.0 - 2.0 * swung)
            lift = _LIFT * np.sin(np.pi * swung)
            foot = np.stack([np.full(frames, side * x), y + stride * ahead, lift], axis=1)
            parts += _leg(middle + trunk @ (mirror * hip), foot)
    shapes, faces = zip(*(_surface(*part.shape) for part in parts), strict=True)
    moved = [
        shape @ part.rotations.swapaxes(1, 2) + part.origins[:, None]
        for shape, part in zip(shapes, parts, strict=True)
    ]
    offsets = len(shapes[0]) * np.arange(len(parts))[:, None, None]
    return np.concatenate(moved, axis=1).astype(np.float32), (
        (np.array(faces) + offsets).reshape(-1, 3).astype(np.int32)
    )


def _leg(hip: Floats, foot: Floats) -> list[_Part]:
    """Return the four parts of a leg from hip to foot (n, 3), in a vertical plane."""
    span = foot - hip
    sideways = np.degrees(np.arctan2(span[:, 1], span[:, 0]))
    first, last = np.radians(_SLOPES)
    reach = np.hypot(span[:, 0], span[:, 1]) - _COXA * np.cos(first) - _FOOT * np.cos(last)
    rise = span[:, 2] - _COXA * np.sin(first) - _FOOT * np.sin(last)
    far = np.hypot(reach, rise)
    bend = np.arccos(np.clip((_FEMUR**2 + far**2 - _TIBIA**2) / (2.0 * _FEMUR * far), -1.0, 1.0))
    femur = np.arctan2(rise, reach) + bend
    tibia = np.arctan2(rise - _FEMUR * np.sin(femur), reach - _FEMUR * np.cos(femur))
    slopes = (np.full_like(femur, first), femur, tibia, np.full_like(femur, last))
    parts, joint = [], hip
    for length, slope in zip(_THICK, slopes, strict=True):
        rotations = turn(2, sideways) @ turn(1, -np.degrees(slope))
        shape = ((0.0, 0.0, 0.0), (length, 0.0, 0.0), _THICK[length], _THICK[length])
        parts.append(_Part(shape, rotations, joint))
        joint = joint + length * rotations[:, :, 0]
    return parts


def _surface(
    start: ArrayLike, end: ArrayLike, wide: float, high: float
) -> tuple[Floats, NDArray[np.int64]]:
    """Return a closed surface around the axis from `start` to `end`, oriented outward."""
    start, span = np.asarray(start), np.subtract(end, start)
    sideways = np.cross(span, (0.0, 0.0, 1.0))
    sideways /= np.linalg.norm(sideways)
    upward = np.cross(sideways, span)
    upward /= np.linalg.norm(upward)
    along = np.linspace(0.0, np.pi, _ALONG + 2)[1:-1, None, None]
    around = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)[None, :, None]
    ring = wide * np.cos(around) * sideways - high * np.sin(around) * upward
    rings = start + 0.5 * (1.0 - np.cos(along)) * span + np.sin(along) ** 0.7 * ring
    vertices = np.concatenate([rings.reshape(-1, 3), [start, start + span]])
    a = np.arange(_ALONG * _AROUND).reshape(_ALONG, _AROUND)
    b = np.roll(a, -1, axis=1)
    first, last = np.full(_AROUND, len(vertices) - 2), np.full(_AROUND, len(vertices) - 1)
    triangles = [
        np.stack([a[:-1], b[:-1], b[1:]], axis=-1).reshape(-1, 3),
        np.stack([a[:-1], b[1:], a[1:]], axis=-1).reshape(-1, 3),
        np.stack([first, b[0], a[0]], axis=-1),
        np.stack([last, a[-1], b[-1]], axis=-1),
    ]
    return vertices, np.concatenate(triangles)
