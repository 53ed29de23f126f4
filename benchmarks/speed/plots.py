"""The figures of a run. Each is written to every one of some folders."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dynmesh.study.methods import MOTION
from dynmesh.study.style import NMSVE_LABEL, new_figure
from dynmesh.study.tables import NMSVE_UNIT

from ..baselines import BIHARMONIC, COPY
from ..methods import ALL, BY_KEY, PLAIN
from .calls import Latency
from .comparison import Comparison, fewest
from .tables import power_law

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _save(figure: "Figure", folders: list[Path], name: str) -> None:
    for folder in folders:
        folder.mkdir(parents=True, exist_ok=True)
        figure.savefig(folder / name)


def _title(mask: str) -> str:
    return mask if "%" not in mask else f"{mask} known"


def error_and_time(found: Comparison, folders: list[Path]) -> None:
    """Draw error against time on one mesh, with a panel for each loss."""
    with new_figure(12, 6.6) as figure:
        axes = figure.subplots(2, 3, sharex=True, sharey=True)
        for axis, (loss, runs) in zip(axes.ravel(), found.runs.items(), strict=True):
            for key, run in runs.items():
                method, time = BY_KEY[key], 1e3 * np.median(run.seconds)
                if method is COPY:
                    axis.axvline(time, color=COPY.colour, linestyle="--", label=COPY.label)
                else:
                    error = np.mean(run.nmsve[: fewest(runs)]) / NMSVE_UNIT
                    style = {"color": method.colour, "label": method.label}
                    axis.plot(time, error, "o", markersize=9, **style)
            axis.set(title=_title(loss), xscale="log", yscale="log")
        for axis in axes[-1]:
            axis.set_xlabel("time of a frame / ms")
        for axis in axes[:, 0]:
            axis.set_ylabel(NMSVE_LABEL)
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
        _save(figure, folders, "error_and_time.png")


def size(rows: Sequence[Comparison], folders: list[Path]) -> None:
    """Draw the time over the size of the mesh."""
    with new_figure(12, 5.6) as figure:
        axes = figure.subplots(1, len(rows[0].runs), sharey=True)
        for place, (axis, loss) in enumerate(zip(axes, rows[0].runs, strict=True)):
            for method in ALL:
                times = {
                    row.scene.subject.n_vertices: row.seconds(method.key)[place]
                    for row in rows
                    if method.key in row.keys
                }
                if not times:
                    continue
                counts, shown = np.array([*times]), 1e3 * np.array([*times.values()])
                axis.plot(counts, shown, "o-", color=method.colour, label=method.label)
                if method is MOTION:
                    law = power_law(times)
                    fitted = 1e3 * np.exp(law.intercept) * counts**law.slope
                    axis.plot(counts, fitted, "--", color="#000000", linewidth=1, zorder=3)
                    text = f"{MOTION.label}: vertices to the power of {law.slope:.2f}"
                    axis.annotate(text, (0.98, 0.03), xycoords="axes fraction", ha="right")
            axis.set(title=_title(loss), xlabel="vertices", xscale="log", yscale="log")
        axes[0].set_ylabel("time of a frame / ms")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
        _save(figure, folders, "size.png")


def latency(rows: Sequence[Latency], folders: list[Path]) -> None:
    """Draw the times of the slowest frames."""
    losses = list(dict.fromkeys(row.loss for row in rows))
    cases = dict.fromkeys((row.n_vertices, row.threads) for row in rows)
    colours = dict(zip(cases, (m.colour for m in (MOTION, PLAIN, BIHARMONIC)), strict=False))
    longer = np.logspace(0, -4, 41)
    with new_figure(12, 5) as figure:
        axes = figure.subplots(1, len(losses), sharey=True)
        for axis, loss in zip(axes, losses, strict=True):
            for row in rows:
                if row.loss != loss:
                    continue
                times = 1e3 * np.percentile(row.seconds, 100 * (1 - longer))
                colour = colours[row.n_vertices, row.threads]
                dash = "-" if row.others == "idle" else "--"
                threads = "one thread" if row.threads == 1 else f"{row.threads} threads"
                label = f"{row.n_vertices} vertices, {threads}, other cores {row.others}"
                axis.plot(longer, times, dash, color=colour, label=label)
            axis.set(
                title=_title(loss),
                xscale="log",
                yscale="log",
                xlabel="share of frames that take longer",
            )
            axis.invert_xaxis()
        axes[0].set_ylabel("time of a frame / ms")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        _save(figure, folders, "latency.png")
