"""A page that shows cameras as frusta, what they see in colours, and the template."""

import html
from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats, Positions
from ..draw.figures import SURFACE_COLOUR
from ..draw.page.document import FIELD_OF_VIEW, Unit, embedded, new_plot, number_of
from ..scans import DepthScan

_COLOURS = (0x0072B2, 0xD55E00, 0x009E73, 0xCC79A7, 0xE69F00, 0x56B4E9, 0x7A5195, 0x444444)
_MOST_POINTS = 4000
"""Of each camera; more would make the page large and look the same."""

_FRUSTUM = 0.08
"""The depth of a frustum, relative to the size of what is shown."""

_STYLE = """
#rig { position: fixed; inset: 0 auto auto 0; z-index: 16777272; max-width: 62ch; margin: 12px;
  padding: 10px 14px; background: #fffe; border: 1px solid #ccc; border-radius: 8px;
  font: 14px/1.4 system-ui, sans-serif; color: #222; max-height: 92vh; overflow: auto; }
#rig h1 { font-size: 17px; margin: 0 0 6px; } #rig * { overflow-wrap: anywhere; }
#rig td { padding: 1px 10px 1px 0; }
#rig i { display: inline-block; width: 10px; height: 10px; margin-right: 6px; }
"""


def rig_page(
    scan: DepthScan,
    template: tuple[NDArray[np.integer[Any]], Positions] | None,
    up: str,
    title: str,
    told: str,
    names: Sequence[str],
) -> str:
    """Creates the HTML document, which needs no other file and no network.

    The scan has an image of each camera, and a name, with what else is said of it; the template,
    if there is one, faces and vertices.
    """
    clouds = [cloud[:: 1 + len(cloud) // _MOST_POINTS] for cloud in scan.clouds]
    meshes = [] if template is None else [template[1]]
    seats = np.array([pose[:3, 3] for pose in scan.poses])
    # Points far away, as of a wrong depth, would leave nothing of the rest to see.
    low, high = np.quantile(np.concatenate([*clouds, *meshes, seats]), (0.001, 0.999), axis=0)
    low, high = np.minimum(low, seats.min(axis=0)), np.maximum(high, seats.max(axis=0))
    unit = Unit(np.stack([low, high]))

    def shown(points: Positions) -> NDArray[np.float32]:
        return unit(points).astype(np.float32)

    k3d, plot = new_plot(up)
    for colour, cloud, depth, intrinsics, pose in zip(cycle(_COLOURS), clouds, *scan, strict=False):
        if len(cloud):
            plot += k3d.points(shown(cloud), point_size=0.004, color=colour, shader="flat")
        vertices, edges = _frustum(depth.shape, intrinsics, pose, _FRUSTUM * unit.length)
        plot += k3d.lines(
            shown(vertices), edges, indices_type="segment", color=colour, shader="simple"
        )
    if template is not None:
        surface, faces = shown(template[1]), template[0].astype(np.uint32)
        colour = number_of(SURFACE_COLOUR)
        plot += k3d.mesh(surface, faces, color=colour, side="double", opacity=0.85)
    axis = "xyz".index(up)
    direction = np.where(np.arange(3) == axis, 0.8, 1.0)
    half = np.linalg.norm(high - low) / unit.length / 2
    radius = half / np.sin(np.radians(FIELD_OF_VIEW / 2))
    seat = direction / np.linalg.norm(direction) * radius
    plot.camera = [*seat.tolist(), 0, 0, 0, *np.eye(3)[axis].tolist()]
    rows = "".join(
        f'<tr><td><i style="background:#{colour:06x}"></i>{html.escape(name)}</td></tr>'
        for colour, name in zip(cycle(_COLOURS), names, strict=False)
    )
    heading = f"<h1>{html.escape(title)}</h1><p>{html.escape(told)}</p>"
    panel = f'<style>{_STYLE}</style><div id="rig">{heading}<table>{rows}</table></div>'
    script = f"document.body.insertAdjacentHTML('beforeend', {embedded(panel)});"
    script += f"document.title = {embedded(title)};"
    return str(plot.get_snapshot(compression_level=6, additional_js_code=script))


def _frustum(
    shape: Sequence[int], intrinsics: Floats, pose: Floats, depth: float
) -> tuple[Floats, NDArray[np.uint32]]:
    """Returns the apex and the corners of what a camera sees, and the edges between them."""
    x, y = shape[1] - 0.5, shape[0] - 0.5
    pixels = np.array([[-0.5, -0.5, 1], [x, -0.5, 1], [x, y, 1], [-0.5, y, 1]])
    local = np.concatenate([np.zeros((1, 3)), depth * pixels @ np.linalg.inv(intrinsics).T])
    edges = [(0, i) for i in (1, 2, 3, 4)] + [(1, 2), (2, 3), (3, 4), (4, 1)]
    return local @ pose[:3, :3].T + pose[:3, 3], np.array(edges, np.uint32)
