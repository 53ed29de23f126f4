"""What is taken away from scans before tracking: the room around the subject."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._checks import check_not_negative
from .._errors import InputError
from ..degrade.shared import mean_edge_of
from ..diagnosis.planes import Plane, planes_of_room
from ..scans.scan import Scan
from ..sequence import Mask, Positions

Crop = float | tuple[float, float, float, float, float, float]
"""A distance from the box of the mesh in the last frame, or x, y, z of two corners of a box."""


def crop_of(value: Any) -> Crop | None:
    """Checks what should be cropped: a number, six numbers, or text with these and commas.

    Raises:
        ValueError: it is something else, or the corners of the box are exchanged.
    """
    if value is None:
        return None
    expected = "must be a distance, or x,y,z,x,y,z of two corners"
    try:
        given = value.split(",") if isinstance(value, str) else value
        numbers = np.atleast_1d(np.asarray(given, np.float64)).tolist()
    except (TypeError, ValueError):
        raise InputError(f"{expected}, not {value!r}", argument="crop", value=value) from None
    if len(numbers) not in (1, 6) or not np.isfinite(numbers).all():
        raise InputError(f"{expected}, not {value!r}", argument="crop", value=value)
    if len(numbers) == 1:
        check_not_negative("crop", numbers[0])
        return float(numbers[0])
    a, b, c, d, e, f = numbers
    if not (a < d and b < e and c < f):
        raise InputError(
            f"the first corner must be the smaller one in x, y and z, but the box is {value!r}",
            argument="crop",
        )
    return a, b, c, d, e, f


class Room:
    """Takes what is not the subject from scans, all in the unit of the template.

    Attributes:
        planes: floor and walls, once :meth:`look` was called.
        box: (2, 3) the corners of the mesh in the last frame.
    """

    def __init__(self, crop: Crop | None, remove_planes: bool) -> None:
        """Takes nothing away if nothing is asked for."""
        self._crop = crop
        self._removes_planes = remove_planes
        self.planes: list[Plane] = []
        self.box = np.zeros((2, 3))

    @property
    def takes(self) -> bool:
        """Whether anything is asked for."""
        return self._crop is not None or self._removes_planes

    def follow(self, points: Positions) -> None:
        """Notes where the mesh is."""
        self.box = np.stack([points.min(axis=0), points.max(axis=0)]).astype(np.float64)

    def look(self, scan: Scan, faces: NDArray[Any], template: Positions) -> None:
        """Notes where the template is, and finds floor and walls in the first scan.

        They are sought in the whole scan, as they are hardly larger than the subject in a crop.
        """
        self.follow(template)
        if self._removes_planes:
            size = float(np.linalg.norm(self.box[1] - self.box[0]))
            edge = mean_edge_of(template, faces)
            self.planes = planes_of_room(scan.cloud, thickness=edge, size=size)

    def left_of(self, scan: Scan) -> Scan:
        """Returns a scan with points without the room.

        Raises:
            ValueError: nothing is left.
        """
        left = self.without(scan)
        if scan.has_points and not left.has_points:
            raise InputError("nothing is left of the scan without planes and what is cropped")
        return left

    def without(self, scan: Scan) -> Scan:
        """Returns the scan without the room."""
        if self._crop is None and not self.planes:
            return scan
        return scan.only(self.leaves(scan.cloud))

    def leaves(self, cloud: Positions) -> Mask:
        """Returns which of (n, 3) points do not belong to the room."""
        kept = np.ones(len(cloud), np.bool_)
        if self._crop is not None:
            if isinstance(self._crop, float):
                low, high = self.box[0] - self._crop, self.box[1] + self._crop
            else:
                low, high = np.reshape(self._crop, (2, 3))
            kept = ((cloud >= low) & (cloud <= high)).all(axis=1)
        for plane in self.planes:
            kept &= ~plane.holds(cloud)
        return kept

    def subject(self, scan: Scan | None, factor: float) -> Scan | None:
        """Returns what a scan shows of the subject, `factor` times as large; None if nothing."""
        left = None if scan is None else self.without(scan.scaled(factor))
        return left if left is not None and left.has_points else None
