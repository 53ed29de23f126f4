"""The style of all figures, and how they are saved."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._extras import require
from .tables import NMSVE_UNIT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NMSVE_LABEL = r"NMSVE $\times\ 10^4$ / diagonal"
"""The label of axes that show NMSVE in the unit of the tables, `tables.NMSVE_UNIT`."""

_DOTS_PER_INCH = 120

_STYLE: dict[str, Any] = {
    "axes.axisbelow": True,
    "axes.formatter.min_exponent": 5,  # 0.1 and 100 on logarithmic axes, not powers of ten
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.dpi": _DOTS_PER_INCH,
    "font.size": 12,
    "grid.color": "#dddddd",
    "legend.frameon": False,
    "lines.linewidth": 2,
    "savefig.facecolor": "white",
    "svg.fonttype": "none",
}


@contextmanager
def new_figure(width: float, height: float) -> Iterator["Figure"]:
    """Make a figure of a size in inches and in the common style; no global state is changed."""
    matplotlib = require("matplotlib", extra="reproduce")
    figures = require("matplotlib.figure", extra="reproduce")
    with matplotlib.rc_context(_STYLE):
        yield figures.Figure(figsize=(width, height), layout="constrained")


def save(figure: "Figure", folder: Path, name: str, *, is_chart: bool) -> Path:
    """Writes NAME.png and NAME.svg, and returns the path of the PNG."""
    path = folder / f"{name}.png"
    save_png(figure, path, is_chart=is_chart)
    figure.set_layout_engine("none")  # the layout of the PNG remains; another one takes long
    figure.savefig(folder / f"{name}.svg")
    return path


def save_png(figure: "Figure", path: Path, *, is_chart: bool) -> None:
    """Writes a PNG file.

    A palette of 256 colours reduces the files to a third of their size. For a chart, the palette
    reproduces large areas best, such as the bands between curves; for pictures of meshes it
    includes the colours that few points have.
    """
    image_module = require("PIL.Image", extra="reproduce")
    figure.savefig(path)
    methods, dither = image_module.Quantize, image_module.Dither.NONE
    method = methods.MEDIANCUT if is_chart else methods.MAXCOVERAGE
    with image_module.open(path) as image:
        small = image.convert("RGB").quantize(256, method=method, kmeans=3, dither=dither)
    small.save(path, optimize=True)


def nmsve_caption(diagonals: float) -> str:
    """Return a caption for a picture, with an NMSVE in the unit of the tables."""
    return rf"NMSVE ${diagonals / NMSVE_UNIT:.3g} \times 10^{{-4}}$"
