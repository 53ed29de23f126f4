"""A page on which landmarks are picked: a template and a scan, side by side."""

import numpy as np

from ..._arrays import Positions
from ..._errors import InputError, locating
from ...frame import Frames
from ...scans import ScanReader
from ...scans.cameras import Upwards, upwards_of
from ...topology import likely_up
from ..figures import KNOWN_COLOUR, SURFACE_COLOUR, View, thin
from . import Page, Shown
from .document import FIELD_OF_VIEW, Unit, document, new_plot, number_of, packed

_MOST_POINTS = 40_000
"""Of the scan; more would make the page large and slow."""

_DOT = 0.006
"""The size of a point, relative to the longest side of what is shown."""

_DISTANCE = 0.7 / np.tan(np.radians(FIELD_OF_VIEW / 2))
"""Of the camera, in the same unit."""


def pick_page(
    template: Frames,
    scans: ScanReader,
    file_name: str,
    azimuth: float,
    max_vertices: int,
    *,
    title: str | None,
    up: str | None,
) -> Page:
    """Creates a page that pairs vertices of frame 0 with points of the first scan that has any.

    The scans are in the unit of the landmarks, and the page saves these under `file_name`. The
    other arguments are those of :func:`dynmesh.view`.
    """
    first = next(iter(template))
    with locating(file=template.path):
        if not first.present.all():
            raise InputError("frame 0 must be whole")
        numbers, faces = thin(template.faces, first.points, max_vertices)
    scan = next((one.cloud for one in scans if one is not None and one.has_points), None)
    if scan is None:
        raise InputError("no scan has points", file=scans.path)
    own = Upwards(likely_up(first.points, up or template.header.up_axis))
    theirs = None if up else upwards_of(scans.rig, scan)
    points = scan[:: 1 + (len(scan) - 1) // _MOST_POINTS].astype(np.float64)
    mesh = _Side(first.points[numbers].astype(np.float64), own, azimuth)
    cloud = _Side(points, theirs or own, azimuth)
    mesh.plot += mesh.k3d.mesh(
        mesh.shown, faces.astype(np.uint32), color=number_of(SURFACE_COLOUR), side="double"
    )
    cloud.plot += cloud.k3d.points(
        cloud.shown, point_size=_DOT, color=number_of(KNOWN_COLOUR), shader="flat"
    )
    content = {
        "title": title or f"{template.path.name} and {scans.path.name}",
        "file": file_name,
        "numbers": packed(numbers.astype(np.uint32)),
        "template": mesh.told,
        "scan": cloud.told,
        "positions": packed(points),
        "other": cloud.plot.get_binary_snapshot(6).hex(),
    }
    html = document(mesh.plot, content, "pick.html", "data.js", "pick.js")
    size = (template.n_vertices, len(faces), len(template.faces))
    return Page(html=html, shown=Shown(1, 1, 1, len(numbers), *size))


class _Side:
    """One of the two plots, in units of the longest side of what it shows, around its middle."""

    def __init__(self, points: Positions, up: Upwards, azimuth: float) -> None:
        view = View.of(points, up.axis, azimuth, is_reversed=up.is_reversed)
        self.shown = Unit(view.box)(points).astype(np.float32)
        self.k3d, self.plot = new_plot(view)
        self.told = {
            "points": packed(self.shown),
            "camera": (_DISTANCE * view.axes[2]).tolist(),
            "up": view.axes[1].tolist(),
        }
