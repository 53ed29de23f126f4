"""A page that shows cameras as frusta, what they see in colours, the template and a floor."""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._extras import require
from ..sequence import Positions
from .figures import SURFACE_COLOUR
from .page.packing import embedded

_Floats = NDArray[np.float64]

_COLOURS = (0x0072B2, 0xD55E00, 0x009E73, 0xCC79A7, 0xE69F00, 0x56B4E9, 0x7A5195, 0x444444)
_MOST_POINTS = 4000
"""Of each camera; more would make the page large and look the same."""

_FRUSTUM = 0.08
"""The depth of a frustum, relative to the size of what is shown."""

_CELLS = 10

_FIELD = 30
"""The vertical field of view in degrees."""

_STYLE = """
#rig { position: fixed; inset: 0 auto auto 0; z-index: 16777272; max-width: 62ch; margin: 12px;
  padding: 10px 14px; background: #fffe; border: 1px solid #ccc; border-radius: 8px;
  font: 14px/1.4 system-ui, sans-serif; color: #222; max-height: 92vh; overflow: auto; }
#rig h1 { font-size: 17px; margin: 0 0 6px; overflow-wrap: anywhere; }
#rig p { margin: 4px 0; overflow-wrap: anywhere; } #rig .wrong { color: #b00020; }
#rig table { border-collapse: collapse; margin-top: 8px; }
#rig td, #rig th { padding: 1px 10px 1px 0; text-align: right; white-space: nowrap; }
#rig td:first-child, #rig th:first-child { text-align: left; }
#rig i { display: inline-block; width: 10px; height: 10px; margin-right: 6px; }
"""


@dataclass(frozen=True, eq=False)
class ShownCamera:
    """What a page shows of a camera.

    Attributes:
        name: of the camera.
        points: (n, 3) what it sees.
        pose: (4, 4) from its axes, x right, y down, z ahead, to those of the points; None if it is
            unknown.
        intrinsics: (3, 3), or None.
        size: width and height of its images.
    """

    name: str
    points: Positions
    pose: _Floats | None
    intrinsics: _Floats | None
    size: tuple[int, int]


def rig_page(
    cameras: Sequence[ShownCamera],
    template: tuple[NDArray[np.integer[Any]], Positions] | None,
    *,
    up: str,
    title: str,
    wrong: Sequence[str],
    right: Sequence[str],
    table: Sequence[Sequence[str]],
) -> str:
    """Creates the HTML document, which needs no other file and no network.

    Args:
        cameras: in the order of their colours.
        template: faces and vertices, or None.
        up: "x", "y" or "z".
        title: the heading.
        wrong: sentences that are shown as warnings.
        right: other sentences.
        table: rows of words; the first is the head, the others begin with the name of a camera.

    Raises:
        ImportError: k3d is not installed.
    """
    k3d = require("k3d", extra="view")
    clouds = [
        camera.points[:: max(1, -(-len(camera.points) // _MOST_POINTS))] for camera in cameras
    ]
    meshes = [] if template is None else [template[1]]
    seats = [camera.pose[None, :3, 3] for camera in cameras if camera.pose is not None]
    everything = np.concatenate([np.zeros((0, 3)), *clouds, *meshes, *seats])
    low, high = np.quantile(everything, (0.001, 0.999), axis=0)
    for places in seats:
        low, high = np.minimum(low, places[0]), np.maximum(high, places[0])
    middle, length = (low + high) / 2, float((high - low).max()) or 1.0

    def shown(points: Positions) -> NDArray[np.float32]:
        return np.asarray((points - middle) / length, np.float32)

    axis = "xyz".index(up)
    plot = k3d.plot(
        background_color=0xFFFFFF,
        camera_up_axis=up,
        camera_auto_fit=False,
        camera_fov=_FIELD,
        grid_visible=False,
        axes_helper=0,
        menu_visibility=False,
    )
    for number, (camera, cloud) in enumerate(zip(cameras, clouds, strict=True)):
        colour = colour_of(number)
        if len(cloud):
            plot += k3d.points(shown(cloud), point_size=0.004, color=colour, shader="flat")
        if camera.pose is not None:
            vertices, segments = _frustum(camera, _FRUSTUM * length)
            plot += _lines(k3d, shown(vertices), segments, colour)
    if template is not None:
        faces, points = template
        colour = int(SURFACE_COLOUR.removeprefix("#"), 16)
        plot += k3d.mesh(
            shown(points), faces.astype(np.uint32), color=colour, side="double", opacity=0.85
        )
    floor = float((shown(np.concatenate([np.zeros((0, 3)), *clouds, *meshes])))[:, axis].min())
    plot += _lines(k3d, *_grid(axis, floor), 0xCCCCCC)
    direction = np.array([1.0, 1.0, 1.0])
    direction[axis] = 0.8
    radius = max(np.linalg.norm(high - low) / length / 2, np.hypot(np.sqrt(0.5), floor))
    seat = direction / np.linalg.norm(direction) * radius / np.sin(np.radians(_FIELD / 2))
    plot.camera = [*seat.tolist(), 0, 0, 0, *np.eye(3)[axis].tolist()]
    panel = _panel(title, wrong, right, table)
    script = f"document.body.insertAdjacentHTML('beforeend', {embedded(panel)});"
    script += f"document.title = {embedded(title)};"
    return str(plot.get_snapshot(compression_level=6, additional_js_code=script))


def colour_of(number: int) -> int:
    """Returns the colour of a camera as 0xRRGGBB."""
    return _COLOURS[number % len(_COLOURS)]


def _frustum(camera: ShownCamera, depth: float) -> tuple[_Floats, NDArray[np.uint32]]:
    """Returns the apex and the corners of what a camera sees, and the edges between them."""
    corners = np.array([[-0.5, -0.4], [0.5, -0.4], [0.5, 0.4], [-0.5, 0.4]])
    if camera.intrinsics is not None and camera.size[0]:
        ends = np.array(camera.size) - 0.5
        pixels = np.array(
            [[x, y, 1] for x, y in ((-0.5, -0.5), (ends[0], -0.5), ends, (-0.5, ends[1]))]
        )
        corners = (pixels @ np.linalg.inv(camera.intrinsics).T)[:, :2]
    local = np.concatenate([[[0, 0, 0]], np.column_stack([corners, np.ones(4)]) * depth])
    pose = np.asarray(camera.pose)
    edges = [(0, i) for i in (1, 2, 3, 4)] + [(1, 2), (2, 3), (3, 4), (4, 1)]
    return local @ pose[:3, :3].T + pose[:3, 3], np.array(edges, np.uint32)


def _grid(axis: int, height: float) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Returns the lines of a floor of size 1 around the middle."""
    steps = np.linspace(-0.5, 0.5, _CELLS + 1)
    ends = [(a, b) for s in steps for a, b in (((s, -0.5), (s, 0.5)), ((-0.5, s), (0.5, s)))]
    flat = np.array(ends).reshape(-1, 2)
    points = np.insert(flat, axis, height, axis=1)
    return points.astype(np.float32), np.arange(len(points), dtype=np.uint32).reshape(-1, 2)


def _lines(k3d: Any, vertices: NDArray[Any], segments: NDArray[Any], colour: int) -> Any:
    return k3d.lines(
        vertices.astype(np.float32),
        segments.astype(np.uint32),
        indices_type="segment",
        color=colour,
        shader="simple",
    )


def _panel(
    title: str, wrong: Sequence[str], right: Sequence[str], table: Sequence[Sequence[str]]
) -> str:
    """Returns the heading, the sentences and the table."""
    lines = [f"<h1>{html.escape(title)}</h1>"]
    lines += [f'<p class="wrong">{html.escape(sentence)}</p>' for sentence in wrong]
    lines += [f"<p>{html.escape(sentence)}</p>" for sentence in right]
    head, *rows = table
    cells = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
    lines.append(f"<table><tr>{cells}</tr>")
    for number, (name, *values) in enumerate(rows):
        dot = f'<i style="background:#{colour_of(number):06x}"></i>'
        others = "".join(f"<td>{html.escape(value)}</td>" for value in values)
        lines.append(f"<tr><td>{dot}{html.escape(name)}</td>{others}</tr>")
    return f'<style>{_STYLE}</style><div id="rig">{"".join(lines)}</table></div>'
