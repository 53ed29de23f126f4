"""Strips of pictures beside one another, still or moving, with errors on one scale of colours."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, to_hex, to_rgb
from matplotlib.font_manager import findfont
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from dynmesh.draw import figures
from dynmesh.draw.figures import View
from dynmesh.normals import vertex_normals
from dynmesh.sequence import Mask, Positions

Faces = NDArray[np.integer[Any]]

TICKS = (0.1, 0.2, 0.5, 1, 2, 5)
"""Errors on the scale, in per cent of the bounding-box diagonal; the ends hold what is beyond."""
LABEL = "distance from the truth, % of the bounding-box diagonal"
PER_SECOND = 15
"""Frames of a moving strip in a second."""

OUTSIDE, INSIDE, DOTS = "#5b9bd0", "#2c4964", "#2f78b7"  # what was observed
_ERRORS = LinearSegmentedColormap.from_list(
    "errors",
    [(0, "#b9bfc9"), (0.3, "#f6c65b"), (0.6, "#e4572e"), (0.85, "#9b1d3a"), (1, "#4a0d3a")],
)
_COLOURS = [to_hex(_ERRORS(place)) for place in np.linspace(0, 1, 128)]
_INK, _FAINT = "#222222", "#666666"
_LEAST_PITCH = 240  # of the columns, so that their titles fit


@dataclass(frozen=True)
class Panel:
    """One column of a strip.

    Attributes:
        title: what it shows.
        caption: below the title.
        images: one for each frame of the moving picture; a still one has one frame.
    """

    title: str
    caption: str = ""
    images: list[figures.Image] = field(default_factory=list)


def draw_observed(faces: Faces, points: Positions, known: Mask, view: View) -> figures.Image:
    """The triangles that were observed, dark from inside."""
    whole = known[faces].all(axis=1)
    inside = vertex_normals(faces, points.astype(np.float64)) @ view.axes[2] < 0
    return figures.render(faces[whole], points, view, inside.astype(float), (OUTSIDE, INSIDE))


def draw_surface(
    faces: Faces, points: Positions, view: View, error: NDArray[np.floating[Any]] | None = None
) -> figures.Image:
    """A surface, coloured by the errors of its vertices in bounding-box diagonals."""
    places = np.zeros(len(points)) if error is None else _place(100 * error)
    return figures.render(faces, points, view, places, _COLOURS)


def save(panels: Sequence[Panel], path: Path) -> None:
    """Writes a strip to a PNG, or a moving one to a WebP."""
    images = iter(figures.cropped([image for panel in panels for image in panel.images]))
    columns = [[next(images) for _ in panel.images] for panel in panels]
    first, *rest = (_composed(panels, row) for row in zip(*columns, strict=True))
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".png":
        first.save(path, optimize=True)
    else:
        duration = round(1000 / PER_SECOND)
        first.save(
            path, save_all=True, append_images=rest, duration=duration, loop=0, quality=75, method=6
        )


def _place(percent: NDArray[np.floating[Any]] | float) -> NDArray[np.float64]:
    """Where errors in per cent are on the scale, from 0 to 1."""
    low, high = np.log([TICKS[0], TICKS[-1]])
    places = (np.log(np.maximum(percent, TICKS[0])) - low) / (high - low)
    return np.asarray(np.clip(places, 0, 1))


def _composed(panels: Sequence[Panel], row: Sequence[figures.Image]) -> Image.Image:
    """One frame: titles and captions above the pictures, and the scale below them."""
    height, width = row[0].shape[:2]
    pitch = max(width + 14, _LEAST_PITCH)
    size = max(16.0, pitch * len(panels) / 48)
    line = 1.5 * size
    top = round(2 * line)
    whole = Image.new("RGB", (pitch * len(panels), top + height + round(2.2 * line)), "white")
    draw = ImageDraw.Draw(whole)
    file = findfont("DejaVu Sans")
    font, small = ImageFont.truetype(file, size), ImageFont.truetype(file, 0.8 * size)
    for column, (panel, image) in enumerate(zip(panels, row, strict=True)):
        middle = (column + 0.5) * pitch
        whole.paste(Image.fromarray(image), (round(middle - width / 2), top))
        draw.text((middle, 0.5 * line), panel.title, _INK, font, "mm")
        draw.text((middle, 1.4 * line), panel.caption, _FAINT, small, "mm")

    long, bottom = round(16 * size), top + height
    left = whole.width - long - round(size)
    colours = np.array([[to_rgb(colour) for colour in _COLOURS]]) * 255
    bar = Image.fromarray(colours.astype(np.uint8)).resize((long, round(0.6 * size)))
    whole.paste(bar, (left, bottom + round(0.8 * size)))
    for tick in TICKS:
        place = left + float(_place(tick)) * long
        draw.text((place, bottom + 2.2 * size), f"{tick:g}", _INK, small, "mm")
    draw.text((left - size, bottom + 1.1 * size), LABEL, _INK, small, "rm")
    return whole
