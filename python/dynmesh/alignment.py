"""The rigid motion that puts a template into a scan."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _core
from ._arrays import Positions
from .polygons import Faces

__all__ = ["Alignment", "find_alignment"]


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

    Raises:
        ValueError: there are no faces, vertices or points, or one of them is not as described.
    """
    frame = _arrays.points("first_frame", first_frame, np.float64)
    points = _arrays.points("scan", scan, np.float64, "(n, 3)")
    result = _core.find_alignment(_arrays.triangles(faces, len(frame)), frame, points)
    rotation = result.pop("rotation").reshape(3, 3)
    return Alignment(rotation=rotation, **result)
