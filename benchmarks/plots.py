"""The figures of a run."""

from pathlib import Path
from typing import Any

import numpy as np

from dynmesh.study.baselines import BIHARMONIC, COPY
from dynmesh.study.methods import MOTION
from dynmesh.study.style import NMSVE_LABEL, new_figure
from dynmesh.study.tables import NMSVE_UNIT

from .comparison import Measurement
from .latency import Latency
from .methods import ALL, BY_KEY, PLAIN, TWO_THREADS
from .results import Results
from .sizes import fit_line, fit_power_law, unknown_vertices


def draw(results: Results, folder: Path) -> list[Path]:
    """Draw the sections that were run, and return the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = []
    if any(row.part == "low-resolution" for row in results.comparison):
        drawn.append(_error_and_time(results.comparison, folder / "error_and_time.png"))
    if results.sizes:
        drawn.append(_size(results.sizes, folder / "size.png"))
    if results.unknown:
        drawn.append(_unknown(results.unknown, folder / "unknown.png"))
    if results.latency:
        drawn.append(_latency(results.latency, folder / "latency.png"))
    return drawn


def _error_and_time(comparison: list[Measurement], path: Path) -> Path:
    """Draw error against time on the smallest mesh, with a panel for each loss."""
    of_part = [row for row in comparison if row.part == "low-resolution"]
    rows = [row for row in of_part if row.nmsve]
    copies = {row.mask: row for row in of_part if row.method == COPY.key}
    masks = list(dict.fromkeys(row.mask for row in rows))
    with new_figure(12, 6.6) as figure:
        axes = figure.subplots(2, 3, sharex=True, sharey=True)
        for axis, mask in zip(axes.ravel(), masks, strict=True):
            frames = min(len(row.nmsve) for row in rows if row.mask == mask)
            for row in rows:
                if row.mask != mask or row.method == TWO_THREADS.key:
                    continue
                time = 1e3 * np.median(row.seconds)
                error = np.mean(row.nmsve[:frames]) / NMSVE_UNIT
                method = BY_KEY[row.method]
                axis.plot(time, error, "o", markersize=9, color=method.colour, label=method.label)
            floor = 1e3 * np.median(copies[mask].seconds)
            axis.axvline(floor, color=COPY.colour, linestyle="--", label=COPY.label)
            known = mask if "%" not in mask else f"{mask} known"
            axis.set(title=known, xscale="log", yscale="log")
        for axis in axes[-1]:
            axis.set_xlabel("time of a frame / ms")
        for axis in axes[:, 0]:
            axis.set_ylabel(NMSVE_LABEL)
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
        figure.savefig(path)
    return path


def _size(rows: list[Measurement], path: Path) -> Path:
    masks = list(dict.fromkeys(row.mask for row in rows))
    with new_figure(12, 5.6) as figure:
        axes = figure.subplots(1, len(masks), sharey=True)
        for axis, mask in zip(axes, masks, strict=True):
            for method in ALL:
                of_method = [r for r in rows if (r.method, r.mask) == (method.key, mask)]
                measured = [row for row in of_method if row.seconds]
                if not measured:
                    continue
                vertices = np.array([row.n_vertices for row in measured])
                seconds = np.array([np.median(row.seconds) for row in measured])
                axis.plot(vertices, 1e3 * seconds, "o-", color=method.colour, label=method.label)
                if method is MOTION:
                    _draw_power_law(axis, measured, vertices)
            axis.set(title=f"{mask} known", xlabel="vertices", xscale="log", yscale="log")
        axes[0].set_ylabel("time of a frame / ms")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5)
        figure.savefig(path)
    return path


def _draw_power_law(axis: Any, measured: list[Measurement], vertices: Any) -> None:
    law = fit_power_law(measured)
    fitted = 1e3 * law.factor * vertices**law.exponent
    axis.plot(vertices, fitted, "--", color="#000000", linewidth=1, zorder=3)
    text = f"{MOTION.label}: vertices to the power of {law.exponent:.2f}"
    axis.annotate(text, (0.98, 0.03), xycoords="axes fraction", ha="right")


def _unknown(rows: list[Measurement], path: Path) -> Path:
    rows = sorted(rows, key=unknown_vertices)
    count = np.array([unknown_vertices(row) for row in rows])
    first, median, third = (
        1e3 * np.array([np.percentile(row.seconds, [25, 50, 75]) for row in rows]).T
    )
    line = fit_line(rows)
    with new_figure(7.5, 5) as figure:
        axis = figure.subplots()
        axis.fill_between(count, first, third, color=MOTION.colour, alpha=0.25, linewidth=0)
        axis.plot(count, median, "o", color=MOTION.colour, label="median, quartiles")
        label = f"{1e9 * line.slope:.3g} ns a vertex, R² {line.r_squared:.3f}"
        fitted = 1e3 * (line.slope * count + line.intercept)
        axis.plot(count, fitted, "--", color="#000000", linewidth=1, label=label)
        axis.set(xlabel="unknown vertices", ylabel="time of a frame / ms", ylim=(0, None))
        axis.set_title(f"{rows[0].scene}, {rows[0].n_vertices} vertices")
        axis.legend(loc="upper left")
        figure.savefig(path)
    return path


def _latency(rows: list[Latency], path: Path) -> Path:
    masks = list(dict.fromkeys(row.mask for row in rows))
    cases = dict.fromkeys((row.n_vertices, row.threads) for row in rows)
    colours = dict(zip(cases, (m.colour for m in (MOTION, PLAIN, BIHARMONIC)), strict=False))
    with new_figure(12, 5) as figure:
        axes = figure.subplots(1, len(masks), sharey=True)
        for axis, mask in zip(axes, masks, strict=True):
            for row in rows:
                if row.mask != mask:
                    continue
                # The logarithmic axis cannot show the last share, 100 %.
                shares = np.array(sorted(map(float, row.percentiles)))[:-1]
                times = [1e3 * row.percentiles[f"{share:.6g}"] for share in shares]
                colour = colours[row.n_vertices, row.threads]
                dash = "-" if row.others == "idle" else "--"
                threads = "one thread" if row.threads == 1 else f"{row.threads} threads"
                label = f"{row.n_vertices} vertices, {threads}, other cores {row.others}"
                axis.plot(1 - shares / 100, times, dash, color=colour, label=label)
            known = mask if "%" not in mask else f"{mask} known"
            axis.set(
                title=known, xscale="log", yscale="log", xlabel="share of frames that take longer"
            )
            axis.invert_xaxis()
        axes[0].set_ylabel("time of a frame / ms")
        axes[0].legend(loc="upper left")
        figure.savefig(path)
    return path
