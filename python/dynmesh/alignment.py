"""The rigid motion that puts a template into a scan."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _core
from ._arrays import Floats, Positions
from .polygons import Faces

__all__ = ["Alignment", "find_alignment"]

_WITHIN_EDGES = 5.0
_WITHIN_OF_SIZE = 0.1
"""A template lies in a scan if distances are at most this many mean edges, which a tracker can
bridge in one frame, and at most this share of its size, for coarse meshes."""

_TURNED_BY = np.pi / 6
_TURNED_DISTANCE = 0.5
"""It is turned in place, as a head is that looks backwards, if a rotation by more than this, which
a tracker does not bridge surely, makes distances so many times smaller."""

_FAR_EDGES = 2.5
_FAR_OF_SIZE = 0.02
"""After the best rigid motion, a template has another pose than the scan, or is another mesh, if
distances are more than this many mean edges, and more than this share of its size, which the noise
of scans of fine meshes does not reach."""

_SEEN_SHARE = 0.4
"""The share of a surface that a single camera sees at least."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """A rigid motion of a template, and what is known of it and a scan.

    Distances are typical ones between the surface of the template and the scan, small if one of
    them covers the other: the smaller one of the distance of the median point of the scan from the
    template and of that within which 40 % of the template have a point of the scan.

    Attributes:
        rotation: (3, 3) float64; the new positions are ``points @ rotation.T + shift``.
        shift: (3,) float64, in the unit of the positions.
        mean_edge: of the template, in the unit of the positions.
        before: the distance without the motion, in mean edges.
        after: the distance with it, in mean edges.
        ratio: how many times as large as the template the scan is.
        lies_in_scan: whether the template lies in the scan as it is, so that a tracker can bridge
            the distance in its first frame. Then, the motion is the identity.
        matches: whether the template lies in the scan with the motion. If not, it has another pose
            than the scan, or is another mesh, and should not be tracked.
        other_unit: whether one is at least 20 times as large as the other, so that a unit of length
            is probably wrong. Then, no motion is sought, and the template does not match.
    """

    rotation: NDArray[np.float64] = field(repr=False)
    shift: NDArray[np.float64] = field(repr=False)
    mean_edge: float
    before: float
    after: float
    ratio: float
    lies_in_scan: bool
    matches: bool
    other_unit: bool


def find_alignment(faces: Faces, first_frame: Positions, scan: Positions) -> Alignment:
    """Finds the rigid motion that puts a template into a scan, from any rotation and position.

    A tracker follows the template from there; `Tracker` itself bridges small distances only. The
    motion is found by iterative closest points in position and normal, of which the farthest fifth
    is ignored (Chetverikov et al. 2002), from 64 rotations; points are first drawn to points (Besl
    and McKay 1992), and the best results then to tangent planes (Chen and Medioni 1991). Shapes
    with symmetries match in several rotations, of which one is returned. The motion is found from
    about 1500 points and 3000 places of the template, and its distances from about 1000 and 4000,
    so the time is linear in the size of both, for reading them, plus some tenths of a second.
    Computes in double precision.

    Args:
        faces: the triangles of the template, (m, 3) integers.
        first_frame: its vertices, (k, 3) float32 or float64, finite.
        scan: points of the surface in the same unit of length, (n, 3) float32 or float64, finite,
            at least one.
    """
    frame = _arrays.points("first_frame", first_frame, np.float64)
    points = _arrays.points("scan", scan, np.float64, "(n, 3)")
    motion, mean_edge, surface, sample = _core.align_rigidly(
        _arrays.triangles(faces, len(frame)), frame, points
    )
    size = _size_of(surface)
    ratio = _size_of(sample) / size if size > 0 else 1.0
    other_unit = not 1 / _core.other_unit < ratio < _core.other_unit
    before = after = _distance(surface, sample)
    rotation: Floats = np.eye(3)
    shift: Floats = np.zeros(3)
    lies_in_scan = matches = False
    if not other_unit:
        moved = _distance(surface @ motion[:3, :3].T + motion[:3, 3], sample)
        angle = np.arccos(np.clip((np.trace(motion[:3, :3]) - 1) / 2, -1, 1))
        is_turned = angle > _TURNED_BY and moved < _TURNED_DISTANCE * before
        within = min(_WITHIN_EDGES * mean_edge, _WITHIN_OF_SIZE * size)
        lies_in_scan = matches = bool(before <= within and not is_turned)
        if not lies_in_scan:
            rotation, shift, after = motion[:3, :3], motion[:3, 3], moved
            far = max(_FAR_EDGES * mean_edge, _FAR_OF_SIZE * size)
            matches = after <= min(within, far)
    return Alignment(
        rotation,
        shift,
        mean_edge,
        before / mean_edge,
        after / mean_edge,
        ratio,
        lies_in_scan,
        matches,
        other_unit,
    )


def _size_of(points: Floats) -> float:
    """Twice the distance from the median point within which nine of ten points are.

    A few points may lie elsewhere.
    """
    return 2 * float(np.quantile(_lengths(points - np.median(points, axis=0)), 0.9))


def _distance(surface: Floats, scan: Floats) -> float:
    squared = np.zeros((len(surface), len(scan)))
    for ours, theirs in zip(surface.T, scan.T, strict=True):
        squared += (ours[:, None] - theirs) ** 2
    of_scan = np.quantile(np.sqrt(squared.min(axis=0)), 0.5)
    of_surface = np.quantile(np.sqrt(squared.min(axis=1)), _SEEN_SHARE)
    return float(min(of_scan, of_surface))


def _lengths(vectors: Floats) -> Floats:
    x, y, z = vectors.T
    return np.asarray(np.hypot(np.hypot(x, y), z))
