"""Where a template is in a first scan: there already, after a rigid motion, or in another pose."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, locating
from ..completion.start import template_of
from ..files import Reader
from ..registration import Landmarks, Registration, register, register_depth
from ..scans import PointScan, Scan, ScanReader
from ..scans.scan import inside_out
from ..sequence import Positions
from ..tracker import Alignment, Tracker, find_alignment
from .room import Room
from .units import Units, ratio_of, size_of

_SAME_POSE = 0.01
"""The share of its size within which a template that was moved rigidly is in the pose of a scan. In
its own pose it has half of it; from one farther away, a tracker needs many frames to get there."""


@dataclass(frozen=True, eq=False)
class Placed:
    """A template in a scan.

    Attributes:
        points: (k, 3) where it is.
        distance: how far it was before, in mean edges.
        alignment: the rigid motion that put it there; None if it lay there already or was
            registered.
        registration: of the template with the scan, if it had another pose there.
        remark: that the scan is larger or smaller than the template, or needs no landmarks; or
            empty.
        advice: what to look at if the template is lost.
    """

    points: Positions
    distance: float
    alignment: Alignment | None = None
    registration: Registration | None = None
    remark: str = ""
    advice: str = ""

    @property
    def doubt(self) -> str:
        """Why the registration is doubtful; empty if it is not."""
        found = self.registration
        return found.reason if found is not None and found.quality == "doubtful" else ""


def registered_with(
    faces: NDArray[np.integer[Any]], template: Positions, scan: Scan, **options: Any
) -> Registration:
    """Registers a template with points or depth images; see :func:`dynmesh.register`."""
    if isinstance(scan, PointScan):
        points = scan.points, scan.normals
        return register(faces, template, *points, viewpoints=scan.viewpoints, **options)
    return register_depth(faces, template, *scan, **options)


def push_scan(tracker: Tracker, scan: Scan | None) -> Positions:
    """Returns the mesh as it lies in a scan, or as it is carried on."""
    if scan is None:
        return tracker.skip()
    if isinstance(scan, PointScan):
        try:
            return tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
        except ValueError as error:
            if told := inside_out(scan):
                raise InputError(f"{told}: {error}") from error
            raise
    return tracker.push_depth(scan.depth, scan.intrinsics, scan.poses)


def placed_in(
    scans: ScanReader,
    mesh: Reader,
    room: Room,
    units: Units,
    landmarks: Landmarks | None,
    advice: str,
    threads: int,
) -> Placed:
    """Finds the template in the first scan with points, and the room around it.

    Raises:
        ValueError: there is none, nothing is left of it without the room, or the template is not
            found.
    """
    template = template_of(mesh)
    scan = next((one for one in scans.frames() if one is not None and one.has_points), None)
    if scan is None:
        raise InputError("no frame has points", file=scans.path)
    scan = scan.scaled(units.factor)
    room.look(scan, mesh.faces, template)
    with locating(file=scans.path):
        left = room.left_of(scan)
    if landmarks is not None:
        landmarks = landmarks[0], landmarks[1] * units.factor
    advice = "; ".join(filter(None, [inside_out(left), advice]))
    with locating(file=mesh.path):
        found = _placed(mesh.faces, template, left, landmarks, units, advice, threads)
    room.follow(found.points)
    return replace(found, advice=advice)


def _placed(
    faces: NDArray[np.integer[Any]],
    template: Positions,
    scan: Scan,
    landmarks: Landmarks | None,
    units: Units,
    advice: str,
    threads: int,
) -> Placed:
    found = find_alignment(faces, template, scan.cloud)
    if found.lies_in_scan:
        unused = "the template lies in the first scan, so `landmarks` are not used"
        return Placed(template, found.before, remark=unused if landmarks is not None else "")
    away = (
        f"the template does not lie in the first scan: it is {found.before:.3g} mean edges "
        f"({found.before * found.mean_edge:.3g} in its unit) away"
    )
    sizes = units.told(ratio_of(scan, template), size_of(template))
    causes = [one for one in (sizes, advice) if one]
    told = "; ".join([*causes, away])
    if found.other_unit:
        raise InputError(told)
    moved = template.astype(np.float64) @ found.rotation.T + found.shift
    aligned = Placed(moved.astype(template.dtype), found.before, alignment=found, remark=sizes)
    is_near = landmarks is None and found.matches
    if is_near and found.after * found.mean_edge < _SAME_POSE * size_of(template):
        return aligned
    registered = registered_with(faces, template, scan, landmarks=landmarks, threads=threads)
    if is_near and registered.quality != "good":
        return aligned
    if registered.quality == "ruined":
        raise InputError(
            f"{told}, {found.after:.3g} after the best rigid motion: {registered.reason}; "
            "landmarks may be needed"
        )
    return Placed(registered.vertices, found.before, registration=registered, remark=sizes)
