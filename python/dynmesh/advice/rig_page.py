"""A page that shows cameras as frusta, what they see in colours, and the template."""

from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats, Positions
from ..draw.figures import SURFACE_COLOUR, View
from ..draw.page.document import FIELD_OF_VIEW, document, new_plot, number_of
from ..scans import DepthScan
from ..scans.cameras import Upwards, upwards

_COLOURS = (0x0072B2, 0xD55E00, 0x009E73, 0xCC79A7, 0xE69F00, 0x56B4E9, 0x7A5195, 0x444444)
_MOST_POINTS = 4000
"""Of each camera; more would make the page large and look the same."""

_FRUSTUM = 0.08
"""The depth of a frustum, relative to the size of what is shown."""


def rig_page(
    scan: DepthScan,
    template: tuple[NDArray[np.integer[Any]], Positions] | None,
    up: str | None,
    title: str,
    names: Sequence[str],
    told: str,
) -> str:
    """Creates the HTML document, which needs no other file and no network.

    The scan has an image of each camera, and a name, with what else is said of it; the template,
    if there is one, faces and vertices. If the up axis is unknown, cameras tell it, which are
    mostly held upright. A box can be drawn in the unit of the scan, for `crop`.
    """
    clouds = [cloud[:: 1 + len(cloud) // _MOST_POINTS] for cloud in scan.clouds]
    meshes = [] if template is None else [template[1]]
    seats = np.array([pose[:3, 3] for pose in scan.poses])
    # Points far away, as of a wrong depth, would leave nothing of the rest to see.
    box = np.quantile(np.concatenate(clouds), (0.001, 0.999), axis=0)
    held = (Upwards(up) if up else upwards(np.array(scan.poses))) or Upwards("z")
    shown = np.concatenate([box, *meshes, seats])
    view = View.of(shown, held.axis, 45.0, is_reversed=held.is_reversed)
    low, high = view.box
    length = float((high - low).max()) or 1.0
    k3d, plot = new_plot(view)
    for colour, cloud, depth, intrinsics, pose in zip(cycle(_COLOURS), clouds, *scan, strict=False):
        if len(cloud):
            size = 0.004 * length
            points = cloud.astype(np.float32)
            plot += k3d.points(points, point_size=size, color=colour, shader="flat")
        vertices, edges = _frustum(depth.shape, intrinsics, pose, _FRUSTUM * length)
        plot += _lines(k3d, vertices, edges, colour)
    if template is not None:
        surface, faces = template[1].astype(np.float32), template[0].astype(np.uint32)
        colour = number_of(SURFACE_COLOUR)
        plot += k3d.mesh(surface, faces, color=colour, side="double", opacity=0.85)
    corners = np.stack(np.meshgrid(*[(0, 1)] * 3, indexing="ij"), axis=-1).reshape(8, 3)
    pairs = np.argwhere(np.triu(np.abs(corners[:, None] - corners).sum(axis=2) == 1))
    plot += _lines(k3d, corners, pairs.astype(np.uint32), 0)
    plot.grid_visible, plot.grid_auto_fit, plot.grid = True, False, [*low.tolist(), *high.tolist()]
    radius = np.linalg.norm(high - low) / 2 / np.sin(np.radians(FIELD_OF_VIEW / 2))
    middle = (low + high) / 2
    seat = middle + radius * view.axes[2]
    plot.camera = [*seat.tolist(), *middle.tolist(), *view.axes[1].tolist()]
    about = {
        "title": f"{title}, the first scan",
        "told": told,
        "cameras": [(f"#{c:06x}", name) for c, name in zip(cycle(_COLOURS), names, strict=False)],
        "lines": plot.objects[-1].id,
        "box": box.tolist(),
    }
    return document(plot, about, "rig.html", "rig.js")


def _lines(k3d: Any, vertices: Floats, edges: NDArray[np.uint32], colour: int) -> Any:
    points = vertices.astype(np.float32)
    return k3d.lines(points, edges, indices_type="segment", color=colour, shader="simple")


def _frustum(
    shape: Sequence[int], intrinsics: Floats, pose: Floats, depth: float
) -> tuple[Floats, NDArray[np.uint32]]:
    """Returns the apex and the corners of what a camera sees, and the edges between them."""
    x, y = shape[1] - 0.5, shape[0] - 0.5
    pixels = np.array([[-0.5, -0.5, 1], [x, -0.5, 1], [x, y, 1], [-0.5, y, 1]])
    local = np.concatenate([np.zeros((1, 3)), depth * pixels @ np.linalg.inv(intrinsics).T])
    edges = [(0, i) for i in (1, 2, 3, 4)] + [(1, 2), (2, 3), (3, 4), (4, 1)]
    return local @ pose[:3, :3].T + pose[:3, 3], np.array(edges, np.uint32)
