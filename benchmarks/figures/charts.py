"""The picture of docs/method.md that shows generations, and that of the time of a frame."""

import csv
from pathlib import Path

import numpy as np
from matplotlib.ticker import StrMethodFormatter

from dynmesh import Completer, synth

from ..harness import ABSENT, DOCS
from ..methods import ARAP, BIHARMONIC, DETAIL, MOTION
from ..speed import TWO_THREADS
from ..style import new_figure, save

_FRAME = 1000 / 60  # ms, at 60 Hz


def latency(folder: Path) -> None:
    """Draw the time of a frame by the size of the mesh: the table of script/dev/bench --docs."""
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
        figure.legend(loc="outside lower center", ncols=3)
        save(figure, folder / "speed" / "latency.webp", is_chart=True)


def generations(folder: Path) -> None:
    """Draw a small sheet from above: anchors, and satellites by generation."""
    sheet = synth.ocean(2, grid=14)
    known = np.random.default_rng(6).random(14 * 14) < 0.1
    completer = Completer(sheet.faces, sheet.vertices[0], method="motion")
    completer.push(sheet.vertices[1], known)
    x, y = np.indices((14, 14)).reshape(2, -1)
    colours = ["#0072b2", "#fdd49e", "#fc8d59", "#d7301f", "#7f0000", "#000000"]
    with new_figure(6.6, 5) as figure:
        axis = figure.subplots()
        axis.triplot(x, y, sheet.faces, color="#bbbbbb", linewidth=0.7)
        for generation in range(completer.generation.max() + 1):
            chosen = completer.generation == generation
            size, marker, label = 60, "o", f"generation {generation}"
            if generation == 0:
                size, marker, label = 110, "s", "anchor"
            axis.scatter(
                x[chosen], y[chosen], size, colours[generation], marker=marker, label=label
            )
        for dots in axis.collections:
            dots.set(edgecolor="#333333", linewidth=0.6, zorder=3)
        axis.set_aspect("equal")
        axis.set_axis_off()
        figure.legend(loc="outside right center")
        save(figure, folder / "method" / "generations.webp", is_chart=True)
