"""Which small errors of cameras explain that their points lie beside a template.

The points of each camera are moved onto the template by themselves. If they lie much nearer then,
the camera, or all of them, or the size of the template, is wrong; another pose or shape of the
template would leave them where they are.
"""

from collections.abc import Sequence

import numpy as np

from .._arrays import Floats
from ..alignment import find_alignment
from ..scans import DepthScan
from .surface import Surface, subject_of, without_jumps

LEAST = 60
"""Fewer points than this cannot be judged."""

MEASURED = 0.1
"""Mean edges below which distances are those of the measurement."""

_LEFT = 0.5
"""A motion explains the distances of which it leaves at most this share."""

_LONGER = 0.04
"""Focal lengths, and templates, that differ by less may be right."""

_LONGEST = 0.3
"""A larger difference is none of the small ones that are found here: the points lie elsewhere."""

_MEASURED_FACTOR = 0.01
"""What is found of right cameras."""

_ROUNDS = 8
_NEAR_EDGES = 4.0
_ASIDE_EDGES = 2.0
"""Points farther from the surface, or from any of its vertices, do not move the others."""


def wrong_camera(scan: DepthScan, names: Sequence[str], surface: Surface) -> str:
    """Says which cameras lie beside a template; empty if none do, or something else is wrong.

    Args:
        scan: in the unit of the template.
        names: of its cameras.
        surface: the template, in the pose of the scan but for a rigid motion.
    """
    clouds = [subject_of(cloud, surface) for cloud in without_jumps(scan).clouds]
    if len(clouds) < 2 or min(map(len, clouds)) < LEAST:
        return ""
    result = find_alignment(surface.faces, surface.points, np.concatenate(clouds))
    clouds = [(cloud - result.shift) @ result.rotation for cloud in clouds]
    before = np.array([_median(cloud, surface) for cloud in clouds])
    if not (before > MEASURED).any():
        return ""
    # The same points lie farther aside of the axis if the focal length is shorter.
    sizes = [_moved(cloud, surface, np.eye(3)) for cloud in clouds]
    axes = [result.rotation.T @ pose[:3, 2] for pose in scan.poses]
    asides = [np.eye(3) - np.outer(axis, axis) for axis in axes]
    pairs = zip(clouds, asides, strict=True)
    lengths = [_moved(cloud, surface, aside) for cloud, aside in pairs]
    kind, best = min(
        (("size", sizes), ("length", lengths)), key=lambda one: sum(left for left, _ in one[1])
    )
    left, factors = (np.array(values) for values in zip(*best, strict=True))
    is_off = (before > MEASURED) & (left <= _LEFT * before)
    if not is_off.any() or (left > np.maximum(MEASURED, _LEFT * before)).any():
        return ""
    changes = np.abs(factors - 1)
    is_common = len({*np.sign(factors - 1)}) == 1
    if is_common and changes.min() > max(_MEASURED_FACTOR, changes.max() / 2):
        change = float(np.median(changes))
        if not _LONGER <= change <= _LONGEST:
            return ""
        if kind == "length":
            how = "long" if factors[0] > 1 else "short"
            return f"the focal lengths of all cameras are about {change:.0%} too {how}"
        how = "large" if factors[0] > 1 else "small"
        return f"the template is about {change:.0%} too {how} for the scan"
    if is_off.all():
        return ""
    wrong = [repr(name) for name, off in zip(names, is_off, strict=True) if off]
    return f"the pose or the intrinsics of camera {' and '.join(wrong)} are wrong"


def _median(cloud: Floats, surface: Surface) -> float:
    return float(np.median(np.abs(surface.feet(cloud)[0]))) / surface.mean_edge


def _moved(cloud: Floats, surface: Surface, aside: Floats) -> tuple[float, float]:
    """Moves points rigidly onto a surface, and makes them larger in some directions.

    Returns:
        The median distance that is left, in mean edges, and how many times as large they became.
    """
    edge, factor = surface.mean_edge, 1.0
    for _ in range(_ROUNDS):
        heights, normals, away = surface.feet(cloud)
        near = (np.abs(heights) < _NEAR_EDGES * edge) & (away < _ASIDE_EDGES * edge)
        if np.count_nonzero(near) < LEAST:
            break
        middle = cloud.mean(axis=0)
        arms = cloud - middle
        larger = arms @ aside
        columns = [normals, np.cross(arms, normals), (larger * normals).sum(axis=1)[:, None]]
        weights = 1 / np.sqrt(np.maximum(np.abs(heights), MEASURED * edge))[near]
        rows = np.concatenate(columns, axis=1)[near] * weights[:, None]
        step = np.linalg.lstsq(rows, -heights[near] * weights, rcond=1e-6)[0]
        x, y, z = step[3:6]
        left, _, right = np.linalg.svd(np.array([[1, -z, y], [z, 1, -x], [-y, x, 1]]))
        cloud = (arms + step[6] * larger) @ (left @ right).T + step[:3] + middle
        factor *= 1 + step[6]
    return _median(cloud, surface), float(factor)
