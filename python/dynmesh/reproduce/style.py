"""What all figures share."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._extras import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DOTS_PER_INCH = 120

_STYLE: dict[str, Any] = {
    "axes.axisbelow": True,
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
    """A figure of a size in inches, drawn and saved in one style; no global state is touched."""
    matplotlib = require("matplotlib", extra="reproduce")
    figures = require("matplotlib.figure", extra="reproduce")
    with matplotlib.rc_context(_STYLE):
        yield figures.Figure(figsize=(width, height), layout="constrained")


def save(figure: "Figure", folder: Path, name: str, *, colours: int | None = None) -> Path:
    """Writes NAME.png and NAME.svg, and returns the path of the PNG.

    A palette of so many `colours`, picked by clustering, makes pictures of meshes a third of the
    size. Charts, whose colours mean something, go without.
    """
    image_module = require("PIL.Image", extra="reproduce")
    path = folder / f"{name}.png"
    figure.savefig(folder / f"{name}.svg")
    figure.savefig(path)
    with image_module.open(path) as image:
        small = image.convert("RGB")
    if colours is not None:
        method, dither = image_module.Quantize.MAXCOVERAGE, image_module.Dither.NONE
        small = small.quantize(colours, method=method, kmeans=3, dither=dither)
    small.save(path, optimize=True)
    return path


def percent(share: float) -> str:
    """A share as people write it."""
    return f"{100 * share:g} %"


def scientific(value: float) -> str:
    """An NMSVE for captions."""
    return f"{value:.2e}".replace("e-0", "e-").replace("e+0", "e+")
