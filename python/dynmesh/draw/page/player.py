"""The page itself: a k3d snapshot with playback controls."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files as resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._extras import require
from ...sequence import Positions
from ..figures import SURFACE_COLOUR, View
from ..heatmap import ShownFrame, whole_faces
from ..scales import Scale

_GRID_CELLS = 8192  # along the longest side; far below a pixel, and halves the size of the page
_FIELD_OF_VIEW = 30.0  # degrees
_LIKELY_PROPORTION = 1.5  # of a browser's window, width to height
_DOT_SIZE = 0.008  # of the longest side


@dataclass(frozen=True)
class Playback:
    """The text and the times of the page.

    Attributes:
        name: of the sequence.
        note: what was left out.
        numbers: of the shown frames, evenly spaced.
        n_frames: number of frames of the sequence.
        fps: frames of the sequence per second, or None if unknown.
    """

    name: str
    note: str
    numbers: list[int]
    n_frames: int
    fps: float | None


def compose(
    faces: NDArray[np.integer[Any]],
    frames: Sequence[ShownFrame],
    scale: Scale | None,
    camera: View,
    playback: Playback,
) -> str:
    """Creates the HTML document.

    Args:
        faces: (t, 3) integers.
        frames: frames of these vertices, with at least one visible vertex.
        scale: colour scale of the values; None for one colour.
        camera: initial view; `camera.box` contains all visible vertices.
        playback: the text and the times.

    Raises:
        ImportError: k3d is not installed.
    """
    k3d = require("k3d", extra="view")
    plot = k3d.plot(
        background_color=0xFFFFFF,
        camera_auto_fit=False,
        camera_fov=_FIELD_OF_VIEW,
        camera_mode="orbit",
        camera_up_axis="xyz"[int(np.argmax(camera.up))],
        colorbar_object_id=0,  # the page has its own colour bar
        grid_visible=False,
        axes_helper=0,
        menu_visibility=False,
        time_interpolation=False,
        name=playback.name,
    )
    unit = _Unit.of(camera)
    plot.camera = _camera(camera, unit, frames)
    for drawable in _drawables(k3d, faces, frames, scale, unit):
        plot += drawable
    told = asdict(playback) | {"scale": None if scale is None else _told(scale)}
    folder = resources(__package__)
    markup, script = (
        folder.joinpath(name).read_text("utf-8") for name in ("player.html", "player.js")
    )
    constants = f"const markup = {_embedded(markup)};\nconst told = {_embedded(told)};\n"
    return str(plot.get_snapshot(compression_level=6, additional_js_code=constants + script))


@dataclass(frozen=True)
class _Unit:
    """Converts positions to units of the longest side of what the page shows, around its middle."""

    middle: NDArray[np.float64]
    length: float

    @classmethod
    def of(cls, camera: View) -> "_Unit":
        box = camera.box.astype(np.float64)
        return cls(box.mean(axis=0), float((box[1] - box[0]).max()) or 1.0)

    def rounded(self, points: Positions) -> NDArray[np.float32]:
        cells = np.round((points - self.middle) / self.length * _GRID_CELLS)
        return (cells / _GRID_CELLS).astype(np.float32)


def _drawables(
    k3d: Any,
    faces: NDArray[np.integer[Any]],
    frames: Sequence[ShownFrame],
    scale: Scale | None,
    unit: _Unit,
) -> list[Any]:
    """Returns the surface and, if there are any, the dots, as they change from frame to frame."""
    surface: dict[str, dict[str, Any]] = {"vertices": {}, "indices": {}, "attribute": {}}
    dots: dict[str, dict[str, Any]] = {"positions": {}, "attribute": {}}
    points = np.zeros((len(frames[0].points), 3), np.float32)
    places = np.zeros(len(points), np.float32)
    for i, frame in enumerate(frames):
        time = str(i)
        visible = frame.visible
        # A missing vertex keeps its position, which takes no space; no triangle shows it.
        points, places = points.copy(), places.copy()
        points[visible] = unit.rounded(frame.points[visible])
        if scale is not None and frame.values is not None:
            places[visible] = np.round(255 * scale.place(frame.values[visible])) / 255
        whole, alone = whole_faces(faces, visible)
        surface["vertices"][time], dots["positions"][time] = points, points[alone]
        surface["attribute"][time], dots["attribute"][time] = places, places[alone]
        surface["indices"][time] = whole.astype(np.uint32)
    if all(frame.visible.all() for frame in frames):
        # If the triangles do not change, the browser can update positions in place.
        surface["indices"] = surface["indices"]["0"]
    looks = {"color_map": _colour_map(scale), "color_range": [0, 1]}
    drawables = [k3d.mesh(**surface, **looks, side="double", flat_shading=False, roughness=0.8)]
    if any(len(positions) for positions in dots["positions"].values()):
        drawables.append(k3d.points(**dots, **looks, point_size=_DOT_SIZE, shader="3d"))
    return drawables


def _colour_map(scale: Scale | None) -> list[float]:
    """Converts a scale for k3d: position, red, green and blue, one step after another."""
    colours = (SURFACE_COLOUR,) if scale is None else scale.colours
    stops: list[float] = []
    for i, colour in enumerate(colours):
        shares = [component / 255 for component in bytes.fromhex(colour.removeprefix("#"))]
        for edge in (i + 1e-3, i + 1):  # of two at one position, k3d would drop the first
            stops += [edge / len(colours), *shares]
    stops[0] = 0
    return stops


def _camera(camera: View, unit: _Unit, frames: Sequence[ShownFrame]) -> list[float]:
    """Converts a camera for k3d: position, target and up, so that all visible vertices fit."""
    slope = np.tan(np.radians(_FIELD_OF_VIEW / 2)) / 1.25  # room for the controls
    distance = 0.0
    for frame in frames:
        x, y, z = camera.axes @ unit.rounded(frame.points[frame.visible]).T
        across = np.maximum(np.abs(y), np.abs(x) / _LIKELY_PROPORTION)
        distance = max(distance, (z + across / slope).max(initial=0.0))
    return [*(distance * camera.axes[2]), 0, 0, 0, *camera.up]


def _told(scale: Scale) -> dict[str, Any]:
    """Returns the colour bar for the script."""
    return {
        "title": scale.title,
        "colours": scale.colours,
        "ticks": [tick._asdict() for tick in scale.ticks],
    }


def _embedded(value: Any) -> str:
    """Encodes JSON such that it cannot end the script that contains it."""
    return json.dumps(value).replace("<", "\\u003c")
