"""The page itself: a k3d snapshot whose script shows the frames and has controls to play them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..figures import KNOWN_COLOUR, SURFACE_COLOUR, View
from ..heatmap import Colour, ShownFrame
from ..scales import Scale
from .document import (
    FIELD_OF_VIEW,
    Unit,
    document,
    new_plot,
    packed,
    packed_bytes,
    packed_masks,
    packed_positions,
)

_GRID_CELLS = 8192  # along the longest side; far below a pixel
_DOT_SIZE = 0.008  # of the longest side
_SCAN_DOT_SIZE = 0.004
_SCANS_WITHIN = 1.0  # of the longest side, around the middle; the grid reaches four of them
_ONE_COLOUR = {"scans": KNOWN_COLOUR, "input": KNOWN_COLOUR, "reference": SURFACE_COLOUR}
_SCRIPTS = ("data.js", "panes.js", "camera.js", "player.js")


def player(
    faces: NDArray[np.integer[Any]],
    frames: Sequence[ShownFrame],
    scales: Mapping[Colour, Scale | None],
    view: View,
    captions: Mapping[str, str],
    told: Mapping[str, Any],
) -> str:
    """Creates the HTML document.

    At least one vertex is visible in the frames, and the box of the view contains all that are. The
    scales are None for one colour. The captions are those of the panes, from left to right:
    "sequence", those beside it in the frames, and "scans" if the frames have clouds. `told` is what
    the script is told beside that.
    """
    unit = Unit(view.box)
    told = dict(told) | {
        "n_vertices": len(frames[0].points),
        "faces": packed(faces.astype(np.uint32)),
        "grid": _GRID_CELLS,
        "panes": [_pane(name, caption, frames, unit) for name, caption in captions.items()],
        "scan_dot": _SCAN_DOT_SIZE,
        "colours": [_choice_of(name, scale, frames) for name, scale in scales.items()],
        "camera": {
            "axes": view.axes.tolist(),
            "up": view.upwards.tolist(),
            "field_of_view": FIELD_OF_VIEW,
        },
    }
    return document(_empty_plot(view, unit), told, "player.html", *_SCRIPTS)


def _empty_plot(view: View, unit: Unit) -> Any:
    """Returns a plot with a mesh and two dots, which the script replaces."""
    k3d, plot = new_plot(view)
    looks = {"color_map": _colour_map(SURFACE_COLOUR), "color_range": [0, 1], "color": 0xFFFFFF}
    # The mesh extends over the box, from which k3d determines how far one can see.
    corners, values = unit(view.box).astype(np.float32), np.zeros(2, np.float32)
    triangle = np.array([[0, 1, 1]], np.uint32)
    solid = {"side": "double", "flat_shading": False, "roughness": 0.8}
    dotted = {"point_size": _DOT_SIZE, "shader": "3d"}
    plot += k3d.mesh(corners, triangle, attribute=values, **solid, **looks)
    plot += k3d.points(corners, attribute=values, **dotted, **looks)
    return plot


def _pane(name: str, caption: str, frames: Sequence[ShownFrame], unit: Unit) -> dict[str, Any]:
    """Returns the sequence, one beside it or the scans, for the script."""
    own_map = {} if name == "sequence" else {"map": _colour_map(_ONE_COLOUR[name])}
    pane = {"caption": caption, **own_map}
    if name == "scans":
        every = [unit(frame.cloud) for frame in frames if frame.cloud is not None]
        near = [points[(np.abs(points) <= _SCANS_WITHIN).all(axis=1)] for points in every]
        counts = [len(points) for points in near]
        return pane | {"points": packed(_on_grid(np.concatenate(near))), "counts": counts}
    shown, positions = frames, _placed(frames, unit)
    if name != "sequence":
        # Relative to the sequence, as most are the same.
        shown = [frame.beside[name] for frame in frames]
        positions = _placed(shown, unit, positions) - positions
    masks = np.stack([frame.visible for frame in shown])
    return pane | {"positions": packed_positions(positions), "seen": packed_masks(masks)}


def _placed(
    frames: Sequence[ShownFrame], unit: Unit, others: NDArray[np.int16] | None = None
) -> NDArray[np.int16]:
    """Returns (n, k, 3) places on the grid.

    A missing vertex has that of the others or of the frame before, either of which takes little
    space; no triangle shows it.
    """
    places = np.zeros((len(frames), len(frames[0].points), 3), np.int16)
    for i, frame in enumerate(frames):
        places[i] = places[max(0, i - 1)] if others is None else others[i]
        places[i, frame.visible] = _on_grid(unit(frame.points[frame.visible]))
    return places


def _on_grid(points: NDArray[np.float64]) -> NDArray[np.int16]:
    return np.asarray(np.round(points * _GRID_CELLS), np.int16)


def _choice_of(name: Colour, scale: Scale | None, frames: Sequence[ShownFrame]) -> dict[str, Any]:
    """Returns a choice of colours for the script, with its colour bar and the values as bytes."""
    colours = (SURFACE_COLOUR,) if scale is None else scale.colours
    choice: dict[str, Any] = {"name": name, "map": _colour_map(*colours)}
    if scale is not None:
        places = np.zeros((len(frames), len(frames[0].points)), np.uint8)
        for row, frame in zip(places, frames, strict=True):
            row[frame.visible] = np.round(255 * scale.position(frame.values[name][frame.visible]))
        choice["values"] = packed_bytes(places)
        choice["scale"] = {
            "title": scale.title,
            "colours": colours,
            "ticks": [tick._asdict() for tick in scale.ticks],
        }
    return choice


def _colour_map(*colours: str) -> list[float]:
    """Converts equal steps for k3d: position, red, green and blue, one step after another."""
    stops: list[float] = []
    for i, colour in enumerate(colours):
        shares = [component / 255 for component in bytes.fromhex(colour.removeprefix("#"))]
        for edge in (i + 1e-3, i + 1):  # of two at one position, k3d would drop the first
            stops += [edge / len(colours), *shares]
    stops[0] = 0
    return stops
