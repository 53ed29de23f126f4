"""Where a template is in a first scan: there already, after a rigid motion, or in another pose.

A template that lies in the scan may be turned there. So it is tracked from there, and registered
unless that fits.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from .._arrays import Positions
from .._errors import InputError, locating
from ..advice.fit import CAMERAS, LANDMARKS, contents, sizes
from ..alignment import Alignment, find_alignment
from ..completion.start import template_of
from ..frame import Frames
from ..registration import Landmarks, Registration, register
from ..scan import inside_out
from ..scans import Scan, ScanReader
from ..scans.reader import DepthReader
from ..topology import size_of, size_of_surface
from ..tracker import Tracker, TrackingReport
from .background import Background
from .inputs import Units


@dataclass(frozen=True, eq=False)
class Placed:
    """A template in a scan.

    Attributes:
        points: (k, 3) where it is.
        distance: how far it was before, in mean edges.
        alignment: the rigid motion that put it there, if no registration was good; else None.
        registration: of the template with the scan, if it lay elsewhere.
        doubt: why it is doubtful, as the registration is; empty if it is not.
        advice: says what to look at if the template is lost.
    """

    points: Positions
    distance: float
    alignment: Alignment | None = None
    registration: Registration | None = None
    doubt: str = ""
    advice: Callable[[], str] = str


def push_scan(tracker: Tracker, scan: Scan | None) -> Positions:
    """Returns the mesh as it lies in a scan, or as it is carried on."""
    if scan is None:
        return tracker.skip()
    try:
        return tracker.push(scan)
    except InputError as error:
        if message := inside_out(scan):
            raise InputError(f"{message}: {error}") from error
        raise


_MOST_OTHERS = 0.5
"""If a larger share of the points is of other things, and no floor or wall explains it, one of them
may be the subject."""


def placed_in(
    scans: ScanReader,
    mesh: Frames,
    room: Background,
    units: Units,
    landmarks: Landmarks | None,
    threads: int,
) -> Placed:
    """Finds the template in the first scan with an extent, and the room around it."""
    template, faces = template_of(mesh), mesh.faces
    scan = next(filter(_has_extent, scans.frames()), None)
    if scan is None:
        raise InputError("no frame has several points", file=scans.path)
    scan = scan.scaled(units.factor)
    with locating(file=scans.path):
        scan = room.enter(scan, faces, template)
    with locating(file=mesh.path):
        result = find_alignment(faces, template, scan.cloud)
    away = (
        f"the template does not lie in the first scan: it is {result.before:.3g} mean edges "
        f"({result.before * result.mean_edge:.3g} in its unit) away"
    )

    cameras = CAMERAS if isinstance(scans, DepthReader) else ""
    stated = sizes(size_of(scan.cloud) / units.factor, size_of_surface(faces, template), units)

    def told(*faults: str) -> str:
        """What is wrong, what there is, and what can be done."""
        seen = contents(scan, template, faces, room) or stated
        return "; ".join(filter(None, [*faults, seen, cameras]))

    if result.other_unit:
        message = "; ".join(filter(None, [away, stated, cameras]))
        raise InputError(message, file=mesh.path)
    placed = partial(Placed, distance=result.before, advice=told)
    start, tracked = template, None
    if result.matches:
        if not result.lies_in_scan:
            moved = template.astype(np.float64) @ result.rotation.T + result.shift
            start = moved.astype(template.dtype)
        with locating(file=scans.path):
            tracked = _tracked_from(start, faces, scan, threads)
    inwards = inside_out(scan)
    fits = tracked is not None and (
        tracked.quality == "good" or (tracked.cause == "unseen" and not inwards)
    )
    if landmarks is None and result.lies_in_scan and fits:
        return placed(template)
    if landmarks is not None:
        landmarks = landmarks[0], landmarks[1] * units.factor
    with locating(file=mesh.path):
        registered = register(faces, template, scan, landmarks=landmarks, threads=threads)
    doubt = registered.reason
    if doubt and inwards and inwards == contents(scan, template, faces, room):
        raise InputError(inwards, file=scans.path)
    if not doubt and tracked is not None and tracked.cause == "size":
        doubt = tracked.reason  # the registration has made it larger or smaller
    elif (
        not doubt and registered.others > _MOST_OTHERS and not contents(scan, template, faces, room)
    ):
        doubt = f"{registered.others:.0%} of the points belong to other things, which may be it"
    elif doubt and landmarks is None:
        doubt += f"; {LANDMARKS}"
    if doubt and landmarks is None and tracked and tracked.misfit <= registered.misfit:
        # Tracking will tell whether it explains the points, but not what has none.
        doubt = doubt if registered.cause in ("size", "part") else ""
        alignment = None if result.lies_in_scan else result
        return placed(start, alignment=alignment, doubt=_registered(doubt))
    if registered.quality == "ruined" and not result.lies_in_scan:
        fault = f"{away}, {result.after:.3g} after the best rigid motion: {doubt}"
        raise InputError(told(fault), file=mesh.path)
    return placed(registered.vertices, registration=registered, doubt=_registered(doubt))


def _has_extent(scan: Scan | None) -> TypeGuard[Scan]:
    """Whether a scan tells where something is and how large: points that are not all one."""
    return scan is not None and scan.has_points and bool(np.ptp(scan.cloud, axis=0).any())


def _registered(doubt: str) -> str:
    """Says why a registration is doubtful; empty if it is not."""
    return f"the template was registered with the first scan, and {doubt}" if doubt else ""


def _tracked_from(
    start: Positions, faces: NDArray[np.integer[Any]], scan: Scan, threads: int
) -> TrackingReport | None:
    """How a scan is tracked from a start; None if it is refused as too far away."""
    tracker = Tracker(faces, start, threads=threads)
    try:
        push_scan(tracker, scan)
    except InputError:
        if inside_out(scan):
            raise
        return None
    return tracker.report
