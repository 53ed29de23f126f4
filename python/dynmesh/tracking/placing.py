"""Where a template is in a first scan: there already, after a rigid motion, or in another pose."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError
from ..files import Reader
from ..registration import Landmarks, Registration, register, register_depth
from ..scans import PointScan, Scan, ScanReader, unit_of_scans
from ..sequence import Positions
from ..tracker import Alignment, find_alignment


@dataclass(frozen=True, eq=False)
class Placed:
    """A template in a scan.

    Attributes:
        points: (k, 3) where it is.
        distance: how far it was before, in mean edges.
        alignment: the rigid motion that put it there; None if it lay there already or was
            registered.
        registration: of the template with the scan, if it had another pose there.
    """

    points: Positions
    distance: float
    alignment: Alignment | None = None
    registration: Registration | None = None

    @property
    def doubt(self) -> str:
        """Why the registration is doubtful; empty if it is not."""
        found = self.registration
        return found.reason if found is not None and found.quality == "doubtful" else ""


def placed(
    faces: NDArray[np.integer[Any]],
    template: Positions,
    scan: Scan,
    landmarks: Landmarks | None,
) -> Placed:
    """Finds a template in a scan of the same unit.

    Raises:
        ValueError: it is not there; the reason says how far it is, and what may be wrong.
    """
    found = find_alignment(faces, template, scan.cloud)
    if found.lies_in_scan:
        return Placed(template, found.before)
    told = (
        f"the template does not lie in the first scan: it is {found.before:.3g} mean edges "
        f"({found.before * found.mean_edge:.3g} in its unit) away"
    )
    if found.other_unit:
        told += f"; the scan is {found.ratio:.3g} times as large, so their units probably differ"
        raise InputError(told)
    if landmarks is None and found.matches:
        moved = template.astype(np.float64) @ found.rotation.T + found.shift
        return Placed(moved.astype(template.dtype), found.before, alignment=found)
    registered = registered_with(faces, template, scan, landmarks=landmarks)
    if registered.quality == "ruined":
        raise InputError(
            f"{told}, {found.after:.3g} after the best rigid motion, and in no other pose: "
            f"{registered.reason}; it must be the mesh of what was scanned, or landmarks may be "
            "needed"
        )
    return Placed(registered.vertices, found.before, registration=registered)


def registered_with(
    faces: NDArray[np.integer[Any]], template: Positions, scan: Scan, **options: Any
) -> Registration:
    """Registers a template with points or depth images; see :func:`dynmesh.register`."""
    if isinstance(scan, PointScan):
        points = scan.points, scan.normals
        return register(faces, template, *points, viewpoints=scan.viewpoints, **options)
    return register_depth(faces, template, *scan, **options)


def units_of(
    scans: ScanReader, template: Reader, scan_unit: float | str | None
) -> tuple[float | None, float]:
    """Returns the metres in the unit of the template, and the unit of the scans in it.

    Raises:
        ValueError: the unit contradicts the file of the cameras; or that of the scans is known, and
            that of the template is not.
    """
    own = template.header.metres_per_unit
    theirs = unit_of_scans(scans, scan_unit)
    if theirs is None:
        return own, 1.0
    if own is None:
        raise InputError(
            f"states no unit, but the scans are in units of {theirs:g} m; state its unit, by a "
            "conversion",
            file=template.path,
        )
    return own, theirs / own
