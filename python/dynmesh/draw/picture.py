"""Pictures of a sequence: a frame, or a contact sheet of several with a colour bar."""

import math
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from .._arrays import Positions
from .._errors import require
from . import figures
from .figures import SURFACE_COLOUR, Image, View
from .heatmap import Heatmap, ShownFrame, whole_faces
from .scales import Scale

_MARGIN = 12
_LINE = 20
_INK = "#222222"
_PROPORTION = 1.6  # of a sheet, width to height
_BAR_WIDTH = 22
_LARGEST_LEGEND = (400, 800)  # what is white around it is cropped


def evenly_spaced(n_frames: int, count: int) -> list[int]:
    """Returns the indices of at most `count` of `n_frames` frames, with the first and the last."""
    return sorted({round(x) for x in np.linspace(0, n_frames - 1, min(count, n_frames))})


def centred(points: Positions) -> Positions:
    """Moves (k, 3) positions such that the middle of their bounding box is at 0."""
    return np.asarray(points - (points.min(axis=0) + points.max(axis=0)) / 2)


def drawn(heatmap: Heatmap, frame: ShownFrame, scale: Scale | None, view: View) -> Image:
    """Draws a frame, in the middle of its picture, wherever it moves.

    Triangles with a missing vertex are left out; remaining vertices without a triangle become dots.
    """
    faces, alone = whole_faces(heatmap.reader.faces, frame.visible)
    places = np.zeros(len(frame.points), np.float32)
    colours = (SURFACE_COLOUR,) if scale is None else scale.colours
    if scale is not None:
        places[frame.visible] = scale.position(frame.values[heatmap.colour][frame.visible])
    points = np.where(frame.visible[:, None], frame.points, 0)
    if frame.visible.any():
        view = view.around(frame.points[frame.visible])
    return figures.render(faces, points, view, places, colours, alone)


def contact_sheet(
    heading: str,
    images: Sequence[Image],
    captions: Sequence[str],
    scale: Scale | None,
    note: str = "",
) -> Any:
    """Arranges pictures of equal size in rows on an image of Pillow.

    The caption of each is below what it shows, or in the middle if there is but one picture. The
    scale has a colour bar at the right; None for no bar. The note is at the bottom.
    """
    pillow, drawing = (require(f"PIL.{name}", extra="view") for name in ("Image", "ImageDraw"))
    fonts = require("PIL.ImageFont", extra="view")
    title_font, font = fonts.load_default(20), fonts.load_default(15)
    height, width = images[0].shape[:2]
    cell_width, cell_height = width + _MARGIN, height + _LINE + _MARGIN
    # As many columns as give the sheet about the desired proportion.
    rows = max(1, round(math.sqrt(len(images) * cell_width / cell_height / _PROPORTION)))
    columns = math.ceil(len(images) / rows)
    top = _LINE + 2 * _MARGIN
    lengths = title_font.getlength(heading), font.getlength(note)
    right = _MARGIN + max(columns * cell_width, *map(math.ceil, lengths))
    largest = (right + _LARGEST_LEGEND[0], top + rows * cell_height + _LARGEST_LEGEND[1])
    sheet = pillow.new("RGB", largest, "white")
    draw = drawing.Draw(sheet)
    draw.text((_MARGIN, _MARGIN), heading, fill=_INK, font=title_font)
    draw.text((_MARGIN, top + rows * cell_height), note, fill=_INK, font=font)
    for i, (image, caption) in enumerate(zip(images, captions, strict=True)):
        row, column = divmod(i, columns)
        x, y = _MARGIN + column * cell_width, top + row * cell_height
        sheet.paste(pillow.fromarray(np.ascontiguousarray(image)), (x, y))
        room = math.ceil(font.getlength(caption) / 2)
        middle = width // 2 if len(images) == 1 else _middle(image)
        middle = max(min(middle, width - room), room)
        draw.text((x + middle, y + height), caption, fill=_INK, font=font, anchor="ma")
    if scale is not None:
        _draw_legend(draw, font, scale, right, top)
    (drawn,) = figures.cropped([np.asarray(sheet)])
    return pillow.fromarray(drawn)


def _middle(image: Image) -> int:
    marked = np.flatnonzero((image < 250).any(axis=(0, 2)))
    return int(marked[[0, -1]].mean()) if len(marked) else image.shape[1] // 2


def _draw_legend(draw: Any, font: Any, scale: Scale, x: int, y: int) -> None:
    for line in textwrap.wrap(scale.title, 22):
        draw.text((x, y), line, fill=_INK, font=font)
        y += _LINE
    y += _MARGIN
    width, height = _BAR_WIDTH, max(min(260, 36 * len(scale.colours)), _LINE * len(scale.ticks))
    edges = np.linspace(y + height, y, len(scale.colours) + 1).round().astype(int).tolist()
    for colour, below, above in zip(scale.colours, edges, edges[1:], strict=False):
        draw.rectangle((x, above, x + width, below - 1), fill=colour)
    for position, label in scale.ticks:
        middle = y + round((1 - position) * height)
        draw.line((x + width, middle, x + width + 4, middle), fill=_INK)
        draw.text((x + width + 10, middle), label, fill=_INK, font=font, anchor="lm")
