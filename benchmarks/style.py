"""The style of all charts, and how figures are saved."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image
from scipy import ndimage

from .harness import NMSVE_UNIT

NMSVE_LABEL = r"NMSVE $\times\ 10^4$ / diagonal"
"""The label of axes that show NMSVE in the unit of the tables."""

TEXT_COLOUR = "#7b838c"
"""Stands out from white and from black."""

_STYLE: Any = {  # the type of its keys lists all settings of matplotlib
    "axes.axisbelow": True,
    "axes.formatter.min_exponent": 5,  # 0.1 and 100 on logarithmic axes, not powers of ten
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.dpi": 120,
    "font.size": 12,
    "grid.color": "#dddddd",
    "legend.frameon": False,
    "lines.linewidth": 2,
    "savefig.facecolor": "white",
}


@contextmanager
def new_figure(width: float, height: float) -> Iterator[Figure]:
    """Make a figure of a size in inches and in the common style; no global state is changed."""
    with matplotlib.rc_context(_STYLE):
        yield Figure(figsize=(width, height), layout="constrained")


def save(figure: Figure, path: Path, *, is_chart: bool) -> None:
    """Write a WebP file, `transparent`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file := io.BytesIO())
    with Image.open(file) as image:
        seen_through = transparent(image, is_chart=is_chart)
    seen_through.save(path, lossless=is_chart, quality=80, method=6)


def transparent(image: Image.Image, *, is_chart: bool) -> Image.Image:
    """Return a figure without its white ground, with grey text, for light and for dark pages.

    On white, it looks as before. Pale colours become transparent in all of a chart, but in a
    picture of a mesh only where the ground is near, and in text.
    """
    if is_chart:
        image = image.convert("RGB").quantize(256, kmeans=3, dither=Image.Dither.NONE)
    pixels = np.asarray(image.convert("RGB"), np.float64) / 255
    ink = 1 - pixels.min(axis=2)  # how far from white
    opaque = np.zeros(ink.shape, bool)
    if not is_chart:
        things, count = ndimage.label(ink > 0.03)
        inside = ndimage.binary_erosion(things > 0, iterations=2)
        shares = ndimage.mean(inside, things, np.arange(1, count + 1))  # small in letters and dots
        opaque = inside & np.concatenate([[False], np.asarray(shares) > 0.4])[things]
    alpha = np.where(opaque, 1, np.minimum(2 * ink, 1))
    colours = 1 - (1 - pixels) / np.maximum(alpha, 1 / 255)[..., None]
    is_text = ~opaque & (np.ptp(pixels, axis=2) < 0.25 * ink)
    colours[is_text] = to_rgb(TEXT_COLOUR)
    alpha[is_text] = ink[is_text]
    both = np.dstack([np.clip(colours, 0, 1), alpha])
    return Image.fromarray(np.uint8(np.round(255 * both)))


def nmsve_caption(diagonals: float) -> str:
    """Return a caption for a picture, with an NMSVE in the unit of the tables."""
    return rf"NMSVE ${diagonals / NMSVE_UNIT:.3g} \times 10^{{-4}}$"
