"""Whether a template lies in a scan, and the rigid motion that puts it there.

The motion is found by iterative closest points (Besl and McKay 1992), of which the farthest fifth
is ignored (Chetverikov et al. 2002, trimmed ICP), from several rotations: scans see only one side,
and may contain more than the subject.
"""

from itertools import permutations, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..sequence import Positions

_Floats = NDArray[np.float64]

_WITHIN = 5.0
_WITHIN_SHARE = 0.1
"""A template lies in a scan if typical distances are at most this many mean edges, which a tracker
can bridge in one frame, and at most this share of its size, for coarse meshes."""

_OTHER_UNIT = 20.0
"""A scan so many times larger or smaller than a template is in another unit."""

_COARSE, _FINE = (250, 600), (1000, 4000)
"""Numbers of points of the scan and of the template that are compared, at first and at last."""

_COARSE_STEPS, _FINE_STEPS = 12, 25
_KEPT = 0.8
"""The share of the pairs that is used."""

_SEEN = 0.4
"""The share of a template that a single camera sees at least."""

_AT_ONCE = 256


class Alignment(NamedTuple):
    """A rigid motion of a template, and typical distances to the scan, in mean edges.

    Attributes:
        rotation: (3, 3); the new positions are ``points @ rotation.T + shift``.
        shift: (3,)
        before: the distance without the motion.
        after: the distance with it.
    """

    rotation: _Floats
    shift: _Floats
    before: float
    after: float

    @property
    def degrees(self) -> float:
        """The angle of the rotation."""
        cosine = (np.trace(self.rotation) - 1) / 2
        return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))

    def moved(self, points: Positions) -> Positions:
        """Returns the points after the motion, in their precision."""
        moved = points.astype(np.float64) @ self.rotation.T + self.shift
        return moved.astype(points.dtype)


def ratio_of_sizes(template: Positions, scan: Positions) -> float:
    """Returns how many times as large as the template the scan is, regardless of a few points."""
    return _size(_sample(scan, _FINE[0])) / (_size(_sample(template, _FINE[1])) or 1.0)


def is_other_unit(ratio: float) -> bool:
    """Whether sizes differ so much that a unit must be wrong."""
    return not 1 / _OTHER_UNIT < ratio < _OTHER_UNIT


def lies_within(distance: float, template: Positions, mean_edge: float) -> bool:
    """Whether a template that is so many mean edges from a scan lies in it."""
    return distance <= min(_WITHIN, _WITHIN_SHARE * _size(template.astype(np.float64)) / mean_edge)


def distance_between(
    template: Positions, faces: NDArray[np.integer[Any]], scan: Positions, mean_edge: float
) -> float:
    """Returns how far a template is from a scan, in mean edges; small if one covers the other.

    It is the smaller one of two distances: that of the median point of the scan from the template,
    which is small if the scan is of one side, and that within which the scan has the nearest 40 %
    of the template, which is small if the scan has much else.
    """
    surface = _sample(_surface(template, faces), _FINE[1])
    return _distance(surface, _sample(scan, _FINE[0]), mean_edge)


def align(
    template: Positions, faces: NDArray[np.integer[Any]], scan: Positions, mean_edge: float
) -> Alignment:
    """Finds the rigid motion that puts a template into a scan.

    Args:
        template: (k, 3)
        faces: (m, 3) its triangles.
        scan: (n, 3), n at least 1.
        mean_edge: of the template.
    """
    before = distance_between(template, faces, scan, mean_edge)
    surface = _surface(template, faces)
    some, few = _sample(surface, _COARSE[1]), _sample(scan, _COARSE[0])
    middle, aim = np.median(some, axis=0), np.median(few, axis=0)
    tried = []
    for turn in _turns(some - some.mean(axis=0), few - few.mean(axis=0)):
        rotation, shift = _closest(some, few, turn, aim - middle @ turn.T, _COARSE_STEPS)
        tried.append((_distance(some @ rotation.T + shift, few, mean_edge), rotation, shift))
    best = min(range(len(tried)), key=lambda i: tried[i][0])
    _, rotation, shift = tried[best]
    whole, many = _sample(surface, _FINE[1]), _sample(scan, _FINE[0])
    rotation, shift = _closest(whole, many, rotation, shift, _FINE_STEPS)
    after = _distance(whole @ rotation.T + shift, many, mean_edge)
    return Alignment(rotation, shift, before, after)


def _surface(template: Positions, faces: NDArray[np.integer[Any]]) -> _Floats:
    """Returns the vertices and the centres of the triangles, for coarse meshes."""
    points = template.astype(np.float64)
    return np.concatenate([points, points[faces].mean(axis=1)])


def _turns(template: _Floats, scan: _Floats) -> list[_Floats]:
    """Returns rotations to begin with: those of a cube, and those between the principal axes."""
    cube = []
    for axes in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            turn = np.eye(3)[list(axes)] * np.array(signs)[:, None]
            if np.linalg.det(turn) > 0:
                cube.append(turn)
    ours, theirs = (_principal(points) for points in (template, scan))
    half_turns = [turn for turn in cube if np.count_nonzero(np.diag(turn)) == 3]
    return [*cube, *(theirs.T @ turn @ ours for turn in half_turns)]


def _principal(points: _Floats) -> _Floats:
    """Returns the principal axes as rows, right-handed."""
    axes = np.linalg.eigh(points.T @ points)[1].T
    return np.asarray(axes * np.array([1, 1, np.sign(np.linalg.det(axes))])[:, None])


def _closest(
    template: _Floats, scan: _Floats, rotation: _Floats, shift: _Floats, steps: int
) -> tuple[_Floats, _Floats]:
    """Improves a rigid motion by iterative closest points."""
    for _ in range(steps):
        moved = template @ rotation.T + shift
        nearest, distances = _nearest(scan, moved)
        kept = np.argsort(distances, kind="stable")[: max(3, int(_KEPT * len(scan)))]
        ours, theirs = moved[nearest[kept]], scan[kept]
        turn = _fitted(ours, theirs)
        rotation = turn @ rotation
        shift = (shift - ours.mean(axis=0)) @ turn.T + theirs.mean(axis=0)
    return rotation, shift


def _fitted(ours: _Floats, theirs: _Floats) -> _Floats:
    """Returns the rotation that fits centred points best (Kabsch 1976)."""
    u, _, vt = np.linalg.svd((ours - ours.mean(axis=0)).T @ (theirs - theirs.mean(axis=0)))
    sign = np.sign(np.linalg.det(u @ vt)) or 1.0
    return np.asarray((u * np.array([1, 1, sign])) @ vt).T


def _distance(template: _Floats, scan: _Floats, mean_edge: float) -> float:
    to_template = np.median(_nearest(scan, template)[1])
    to_scan = np.quantile(_nearest(template, scan)[1], _SEEN)
    return float(min(to_template, to_scan) / mean_edge)


def _nearest(points: _Floats, among: _Floats) -> tuple[NDArray[np.intp], _Floats]:
    """Returns the nearest of `among` to each point, and its distance; all pairs are compared."""
    nearest = np.empty(len(points), np.intp)
    squares = np.einsum("nx,nx->n", among, among)
    for begin in range(0, len(points), _AT_ONCE):
        some = points[begin : begin + _AT_ONCE]
        nearest[begin : begin + _AT_ONCE] = (squares - 2 * some @ among.T).argmin(axis=1)
    return nearest, np.asarray(np.linalg.norm(points - among[nearest], axis=1))


def _size(points: _Floats) -> float:
    """Returns twice the distance from the median point within which nine of ten points are."""
    return 2 * float(np.quantile(np.linalg.norm(points - np.median(points, axis=0), axis=1), 0.9))


def _sample(points: NDArray[Any], n: int) -> _Floats:
    """Returns about n points, evenly chosen by their numbers, always the same."""
    chosen = np.unique(np.linspace(0, len(points) - 1, n).astype(np.intp))
    return points[chosen].astype(np.float64)
