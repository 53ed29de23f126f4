"""Whether a template lies in a scan, and the rigid motion that puts it there.

The motion is found by iterative closest points, of which the farthest fifth is ignored (Chetverikov
et al. 2002, trimmed ICP): scans see only one side, and may contain more than the subject. From
several rotations, points are first drawn to points (Besl and McKay 1992), and the best few results
then to tangent planes (Chen and Medioni 1991), along which smooth surfaces slide into place.
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

_FAR, _FAR_SHARE = 2.5, 0.02
"""After the best rigid motion, a template has another pose than the scan, or is another mesh, if
typical distances are more than this many mean edges, and more than this share of its size, which
the noise of scans of fine meshes does not reach."""

_OTHER_UNIT = 20.0
"""A scan so many times larger or smaller than a template is in another unit."""

_COARSE, _FINE = (250, 600), (1000, 4000)
"""Numbers of points of the scan and of the template that are compared, at first and at last."""

_COARSE_STEPS, _FINE_STEPS = 12, 15
_CANDIDATES = 4
"""How many of the coarse results are refined."""

_KEPT = 0.8
"""The share of the pairs that is used."""

_SEEN = 0.4
"""The share of a template that a single camera sees at least."""

_AT_ONCE = 32
"""Points that are compared at once: so few that the processor's cache holds the distances, and that
matrix products wait for no other thread."""


class Alignment(NamedTuple):
    """A rigid motion of a template, and typical distances to the scan, in mean edges.

    Attributes:
        rotation: (3, 3); the new positions are ``points @ rotation.T + shift``.
        shift: (3,)
        before: the distance without the motion.
        after: the distance with it.
        ratio: how many times as large as the template the scan is.
    """

    rotation: _Floats
    shift: _Floats
    before: float
    after: float
    ratio: float

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


def is_far(distance: float, template: Positions, mean_edge: float) -> bool:
    """Whether a template that is so many mean edges from a scan at best is not in its pose."""
    far = max(_FAR, _FAR_SHARE * _size(template.astype(np.float64)) / mean_edge)
    return distance > far or not lies_within(distance, template, mean_edge)


def distance_between(
    template: Positions, faces: NDArray[np.integer[Any]], scan: Positions, mean_edge: float
) -> float:
    """Returns how far a template is from a scan, in mean edges; small if one covers the other.

    It is the smaller one of two distances: that of the median point of the scan from the template,
    which is small if the scan is of one side, and that within which the scan has the nearest 40 %
    of the template, which is small if the scan has much else.
    """
    surface = _sample(_surface(template, faces)[0], _FINE[1])
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
    surface, normals = _surface(template, faces)
    some, few = _sample(surface, _COARSE[1]), _sample(scan, _COARSE[0])
    middle, aim = np.median(some, axis=0), np.median(few, axis=0)
    tried: list[tuple[float, int, _Motion]] = []
    for turn in _turns(some - some.mean(axis=0), few - few.mean(axis=0)):
        motion = _to_points(some, few, _Motion(turn, aim - turn @ middle))
        tried.append((_distance(motion(some), few, mean_edge), len(tried), motion))
    whole, slopes = _sample(surface, _FINE[1]), _sample(normals, _FINE[1])
    many = _sample(scan, _FINE[0])
    refined = []
    for _, number, motion in sorted(tried, key=lambda found: found[:2])[:_CANDIDATES]:
        motion, residual = _to_planes(whole, slopes, many, motion)
        refined.append((residual, number, motion))
    _, _, motion = min(refined, key=lambda found: found[:2])
    after = _distance(motion(whole), many, mean_edge)
    ratio = ratio_of_sizes(template, scan)
    return Alignment(motion.rotation, motion.shift, before, after, ratio)


class _Motion(NamedTuple):
    """A rigid motion, as :class:`Alignment` has it."""

    rotation: _Floats
    shift: _Floats

    def __call__(self, points: _Floats) -> _Floats:
        return np.asarray(points @ self.rotation.T + self.shift)

    def then(self, rotation: _Floats, shift: _Floats) -> "_Motion":
        """Returns this motion, followed by another."""
        return _Motion(rotation @ self.rotation, rotation @ self.shift + shift)


def _surface(template: Positions, faces: NDArray[np.integer[Any]]) -> tuple[_Floats, _Floats]:
    """Returns the vertices and, for coarse meshes, the centres of triangles, with unit normals."""
    points = template.astype(np.float64)
    a, b, c = points[faces.T]
    of_faces = np.cross(b - a, c - a)
    of_vertices = np.zeros_like(points)
    for corner in faces.T:
        np.add.at(of_vertices, corner, of_faces)
    normals = np.concatenate([of_vertices, of_faces])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.concatenate([points, (a + b + c) / 3]), normals / np.where(lengths > 0, lengths, 1)


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


def _to_points(template: _Floats, scan: _Floats, motion: _Motion) -> _Motion:
    """Improves a motion such that points come near points."""
    for _ in range(_COARSE_STEPS):
        nearest, kept = _pairs(scan, motion(template))
        ours, theirs = motion(template)[nearest], scan[kept]
        turn = _fitted(ours, theirs)
        motion = motion.then(turn, theirs.mean(axis=0) - turn @ ours.mean(axis=0))
    return motion


def _to_planes(
    template: _Floats, normals: _Floats, scan: _Floats, motion: _Motion
) -> tuple[_Motion, float]:
    """Improves a motion such that points come near planes; also returns their mean distance."""
    for _ in range(_FINE_STEPS):
        ours, slopes, theirs = _to_be_joined(template, normals, scan, motion)
        centre = ours.mean(axis=0)
        rows = np.concatenate([np.cross(ours - centre, slopes), slopes], axis=1)
        heights = ((theirs - ours) * slopes).sum(axis=1)
        step = np.linalg.lstsq(rows, heights, rcond=1e-6)[0]
        turn = _rotation_by(step[:3])
        motion = motion.then(turn, centre + step[3:] - turn @ centre)
    ours, slopes, theirs = _to_be_joined(template, normals, scan, motion)
    return motion, float(np.abs(((theirs - ours) * slopes).sum(axis=1)).mean())


def _to_be_joined(
    template: _Floats, normals: _Floats, scan: _Floats, motion: _Motion
) -> tuple[_Floats, _Floats, _Floats]:
    """Returns points of the template, their normals, and the points of the scan beside them."""
    moved = motion(template)
    nearest, kept = _pairs(scan, moved)
    return moved[nearest], normals[nearest] @ motion.rotation.T, scan[kept]


def _pairs(scan: _Floats, moved: _Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Returns nearest points of the template, and the points of the scan that they belong to."""
    nearest, distances = _nearest(scan, moved)
    kept = np.argsort(distances, kind="stable")[: max(3, int(_KEPT * len(scan)))]
    return nearest[kept], kept


def _rotation_by(vector: _Floats) -> _Floats:
    """Returns the rotation about a vector by its length (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle if angle > 0 else vector
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


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
