"""The figures with curves: 7 and 9 of the paper, and 14 with further methods."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy.stats import linregress

from ..harness import NMSVE_UNIT
from ..methods import BASELINES, COMPARED, DETAIL, LIA_ON_MOTION, MOTION, Method
from ..runner import Run
from ..style import NMSVE_LABEL, new_figure, save
from ..subjects import percent
from .study import Study, time_of_unknown

Floats = NDArray[np.float64]


def draw(studies: list[Study], folder: Path) -> None:
    """Draw all charts."""
    figure7(studies, folder)
    compared(studies, COMPARED, folder / "figure9.webp", with_bands=True)
    methods = (MOTION, DETAIL, LIA_ON_MOTION, *BASELINES)  # whose bands would overlap
    compared(studies, methods, folder / "figure14_detail_and_libigl.webp", with_bands=False)


def figure7(studies: list[Study], folder: Path) -> None:
    """Draw iterations and time against the share known, and time against the unknown vertices."""
    with new_figure(13.5, 4.2 * len(studies)) as figure:
        axes = figure.subplots(len(studies), 3, squeeze=False)
        for row, study in zip(axes, studies, strict=True):
            shares, runs = np.array([*study.sweep]), [*study.sweep.values()]
            iterations, time, line = row
            for axis, values, percentiles in (
                (iterations, np.array([r.iterations for r in runs]), (0, 100)),
                (time, np.array([1e3 * r.seconds for r in runs]), (25, 75)),
            ):
                _band(axis, shares, values, MOTION, percentiles, opacity=0.25)
                medians = np.median(values, axis=1)
                axis.plot(100 * shares, medians, color=MOTION.colour, marker="o", markersize=4)
                axis.set(xlabel="known vertices / %", xlim=(0, 100), ylim=(0, None))
            iterations.set(ylabel="iterations per frame", title=_title(study))
            time.set(ylabel="time per frame / ms")
            _fitted_line(line, study)
        save(figure, folder / "figure7.webp", is_chart=True)


def _fitted_line(axis: Axes, study: Study) -> None:
    unknown, times = time_of_unknown(study)
    fit = linregress(unknown, times)
    axis.plot(unknown, times, "o", color=MOTION.colour, markersize=5, label="median")
    ends = np.array([0, unknown.max()])
    label = f"line, R² = {fit.rvalue**2:.3f}"
    axis.plot(ends, fit.slope * ends + fit.intercept, color="#333333", linewidth=1.2, label=label)
    axis.set(xlabel="unknown vertices", ylabel="time per frame / ms", ylim=(0, None))
    axis.legend(loc="upper left")


def compared(
    studies: list[Study], methods: Sequence[Method], path: Path, *, with_bands: bool
) -> None:
    """Draw error and time, and the error along the frames, in a row for each sequence."""
    labels: dict[str, Artist] = {}
    with new_figure(15, 4.8 * len(studies) + 0.7) as figure:
        axes = figure.subplots(len(studies), 3, squeeze=False)
        for row, study in zip(axes, studies, strict=True):
            for method in methods:
                if not (shares := study.shares(method)):
                    continue
                at = np.array(shares)
                runs = [study.at(method, share) for share in shares]
                errors = np.array([shown(run) for run in runs])
                times = np.array([1e3 * run.seconds for run in runs])
                if with_bands:
                    _band(row[0], at, errors, method, (10, 90), opacity=0.12)
                    _band(row[1], at, times, method, (25, 75), opacity=0.12)
                style: dict[str, Any] = {"color": method.colour, "label": method.label}
                row[0].plot(100 * at, errors.mean(axis=1), method.dash, **style)
                row[1].plot(100 * at, np.median(times, axis=1), method.dash, **style)
                along = shown(study.at(method, 0.3))
                numbers = np.arange(1, len(along) + 1)
                row[2].plot(numbers, along, method.dash, **style, linewidth=1.3)
            row[0].set(ylabel=NMSVE_LABEL, title=_title(study))
            row[1].set(ylabel="time per frame / ms")
            row[2].set(ylabel=NMSVE_LABEL, title=f"{percent(0.3)} known", xlabel="frame")
            for axis in row[:2]:
                axis.set(xlabel="known vertices / %")
            for axis in row:
                axis.set_yscale("log")
            handles = row[0].get_legend_handles_labels()
            labels |= dict(zip(handles[1], handles[0], strict=True))
        figure.legend(labels.values(), labels.keys(), loc="outside lower center", ncols=4)
        save(figure, path, is_chart=True)


def shown(run: Run) -> Floats:
    """Return NMSVE in the unit of the figures."""
    return run.nmsve / NMSVE_UNIT


def _title(study: Study) -> str:
    return f"{study.subject.name}, {study.subject.n_vertices} vertices"


def _band(
    axis: Axes,
    shares: Floats,
    values: Floats,
    method: Method,
    percentiles: tuple[int, int],
    *,
    opacity: float,
) -> None:
    low, high = np.percentile(values, percentiles, axis=1)
    axis.fill_between(100 * shares, low, high, color=method.colour, alpha=opacity, linewidth=0)
