"""The picture of the time of a frame over the size of the mesh, from the table of sizes."""

import csv
from pathlib import Path

from matplotlib.ticker import StrMethodFormatter

from ..harness import ABSENT, DOCS
from ..methods import ARAP, BIHARMONIC, DETAIL, MOTION
from ..speed import TWO_THREADS
from ..style import new_figure, save

_FRAME = 1000 / 60  # ms, at 60 Hz


def draw(folder: Path) -> None:
    """Draw the table in docs/tables that script/dev/bench --docs writes."""
    with (DOCS / "tables" / "sizes.csv").open(encoding="utf-8") as file:
        (_, *counts, _), *rows = csv.reader(file)
    times = {label: cells for label, *cells in rows}
    with new_figure(8, 4.5) as figure:
        axes = figure.add_subplot(xlabel="vertices", ylabel="ms per frame")
        axes.set(xscale="log", yscale="log")
        methods = (MOTION, DETAIL, TWO_THREADS, BIHARMONIC, ARAP)
        for method in (method for method in methods if method.label in times):
            cells = zip(counts, times[method.label], strict=False)
            measured = {int(n): float(cell) for n, cell in cells if cell != ABSENT}
            (line,) = axes.plot([*measured], [*measured.values()], method.dash, marker="o")
            line.set(color=method.colour, label=method.label)
        axes.axhline(_FRAME, color="#666666", linewidth=1)
        axes.annotate("a frame at 60 Hz", (int(counts[-1]), _FRAME), ha="right", va="bottom")
        axes.set_xticks([int(n) for n in counts], labels=counts)
        axes.minorticks_off()
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.legend()
        save(figure, folder / "results" / "latency.png", is_chart=True)
