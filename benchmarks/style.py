"""The style of all charts, and how figures are saved."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from PIL import Image

from .harness import NMSVE_UNIT

NMSVE_LABEL = r"NMSVE $\times\ 10^4$ / diagonal"
"""The label of axes that show NMSVE in the unit of the tables."""

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
    """Write a PNG file.

    A palette of 256 colours reduces the files to a third of their size. For a chart, the palette
    reproduces large areas best, such as the bands between curves; for pictures of meshes it
    includes the colours that few points have.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    method = Image.Quantize.MEDIANCUT if is_chart else Image.Quantize.MAXCOVERAGE
    with Image.open(path) as image:
        small = image.convert("RGB").quantize(
            256, method=method, kmeans=3, dither=Image.Dither.NONE
        )
    small.save(path, optimize=True)


def nmsve_caption(diagonals: float) -> str:
    """Return a caption for a picture, with an NMSVE in the unit of the tables."""
    return rf"NMSVE ${diagonals / NMSVE_UNIT:.3g} \times 10^{{-4}}$"
