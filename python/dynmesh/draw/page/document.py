"""What all pages share: an empty plot of k3d, packed arrays, and the document itself."""

import base64
import json
import zlib
from importlib.resources import files as resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._errors import require
from ..figures import View


def packed(values: NDArray[np.generic]) -> str:
    """Compresses the bytes of an array, little-endian and row by row."""
    swapped = values.astype(values.dtype.newbyteorder("<"))
    return base64.b64encode(zlib.compress(swapped.tobytes(), 6)).decode()


def packed_bytes(values: NDArray[np.uint8]) -> str:
    """Packs (n, k) bytes as differences between frames, most of which are 0."""
    return packed(np.diff(values, axis=0, prepend=np.zeros_like(values[:1])))


def packed_positions(positions: NDArray[np.int16]) -> str:
    """Packs (n, k, 3) positions as second differences, between frames and between vertices.

    Neighbouring vertices often have similar numbers and move alike, so that most of these are
    small. Their signs are in the lowest bit, and their low bytes come before their high bytes:
    both make zeros of the high bytes. Together this is a quarter of what the positions themselves
    take when compressed.
    """
    rows = positions.transpose(0, 2, 1)
    for axis in (0, 2):
        rows = np.diff(rows, axis=axis, prepend=np.zeros_like(rows.take([0], axis=axis)))
    folded = ((rows << 1) ^ (rows >> 15)).astype(np.uint16)
    return packed(np.stack([folded & 0xFF, folded >> 8]).astype(np.uint8))


def packed_masks(masks: NDArray[np.bool_]) -> str | None:
    """Packs (n, k) masks; returns None if they are True everywhere."""
    if masks.all():
        return None
    return packed(np.packbits(masks, axis=1, bitorder="little"))


def embedded(value: Any) -> str:
    """Encodes JSON such that it cannot end the script that contains it."""
    return json.dumps(value).replace("<", "\\u003c")


FIELD_OF_VIEW = 30.0
"""In degrees, from top to bottom."""


class Unit:
    """Converts positions to units of the longest side of a box, (2, 3), around its middle."""

    def __init__(self, box: NDArray[np.floating[Any]]) -> None:
        low, high = box.astype(np.float64)
        self.middle, self.length = (low + high) / 2, float((high - low).max()) or 1.0

    def __call__(self, points: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
        """Converts (n, 3) positions."""
        return np.asarray((points - self.middle) / self.length)


def new_plot(view: View) -> tuple[Any, Any]:
    """Returns the library and a plot with nothing but what is added to it."""
    k3d = require("k3d", extra="view")
    plot = k3d.plot(
        background_color=0xFFFFFF,
        camera_auto_fit=False,
        camera_fov=FIELD_OF_VIEW,
        camera_mode="orbit",
        camera_up_axis="none" if view.is_reversed else view.up,
        colorbar_object_id=0,  # pages have their own colour bar
        grid_visible=False,
        axes_helper=0,
        menu_visibility=False,
    )
    return k3d, plot


def document(plot: Any, told: dict[str, Any], markup: str, *scripts: str) -> str:
    """Returns the HTML of a plot, with markup and scripts of this folder, which read `told`."""
    folder = resources(__package__)
    page, *code = (folder.joinpath(name).read_text("utf-8") for name in (markup, *scripts))
    begin = f"document.body.insertAdjacentHTML('beforeend', {embedded(page)});"
    script = "\n".join([begin, f"const told = {embedded(told)};", *code])
    code_of_page = f"(async () => {{{script}}})();"
    return str(plot.get_snapshot(compression_level=6, additional_js_code=code_of_page))


def number_of(colour: str) -> int:
    """Returns a colour "#rrggbb" as k3d takes it."""
    return int(colour.removeprefix("#"), 16)
