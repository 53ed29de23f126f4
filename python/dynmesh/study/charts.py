"""The figures with curves: 7 and 9 of the paper."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .completion import Method
from .fits import LinearFit, fit_line
from .measure import Run
from .methods import MOTION
from .sequence_study import Study
from .style import NMSVE_LABEL, new_figure, save
from .tables import NMSVE_UNIT, percent

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]


def figure7(studies: list[Study], folder: Path) -> Path:
    """Draw iterations and time against the share known, and time against the unknown vertices."""
    with new_figure(13.5, 4.2 * len(studies)) as figure:
        axes = figure.subplots(len(studies), 3, squeeze=False)
        for row, study in zip(axes, studies, strict=True):
            shares = np.array(sorted(study.sweep))
            runs = [study.sweep[share] for share in shares]
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
        return save(figure, folder, "figure7", is_chart=True)


def figure9(studies: list[Study], folder: Path) -> Path:
    """Draw the error and time of all methods, and the error along the frames."""
    return compared(studies, studies[0].methods, folder, "figure9", with_bands=True)


def compared(
    studies: list[Study],
    methods: Sequence[Method],
    folder: Path,
    name: str,
    *,
    with_bands: bool,
) -> Path:
    """Draw a row for each sequence, with the methods that were measured on it."""
    labels: dict[str, Artist] = {}
    with new_figure(15, 4.8 * len(studies) + 0.7) as figure:
        axes = figure.subplots(len(studies), 3, squeeze=False)
        for row, study in zip(axes, studies, strict=True):
            for method in methods:
                if not (shares := study.shares(method)):
                    continue
                at = np.array(shares)
                runs = [study.grid[method.key, share] for share in shares]
                errors = np.array([shown(run) for run in runs])
                times = np.array([1e3 * run.seconds for run in runs])
                if with_bands:
                    _band(row[0], at, errors, method, (10, 90), opacity=0.12)
                    _band(row[1], at, times, method, (25, 75), opacity=0.12)
                style: dict[str, Any] = {"color": method.colour, "label": method.label}
                row[0].plot(100 * at, errors.mean(axis=1), method.dash, **style)
                row[1].plot(100 * at, np.median(times, axis=1), method.dash, **style)
                along_frames(row[2], study.grid[method.key, 0.3], method)
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
        return save(figure, folder, name, is_chart=True)


def linear_fit(study: Study) -> LinearFit:
    """Fit a line to milliseconds per frame over the number of unknown vertices."""
    return fit_line(*_times(study))


def shown(run: Run) -> Floats:
    """Return NMSVE in the unit of the figures."""
    return run.nmsve / NMSVE_UNIT


def _times(study: Study) -> tuple[Floats, Floats]:
    runs = study.sweep.values()
    unknown = np.array([run.unknown.mean() for run in runs])
    return unknown, np.array([1e3 * np.median(run.seconds) for run in runs])


def _title(study: Study) -> str:
    return f"{study.subject.name}, {study.subject.n_vertices} vertices"


def _band(
    axis: "Axes",
    shares: Floats,
    values: Floats,
    method: Method,
    percentiles: tuple[int, int],
    *,
    opacity: float,
) -> None:
    low, high = np.percentile(values, percentiles, axis=1)
    axis.fill_between(100 * shares, low, high, color=method.colour, alpha=opacity, linewidth=0)


def _fitted_line(axis: "Axes", study: Study) -> None:
    unknown, milliseconds = _times(study)
    fit = fit_line(unknown, milliseconds)
    ends = np.array([0, unknown.max()])
    axis.plot(unknown, milliseconds, "o", color=MOTION.colour, markersize=5, label="median")
    label = f"line, R² = {fit.r_squared:.3f}"
    axis.plot(ends, fit.slope * ends + fit.intercept, color="#333333", linewidth=1.2, label=label)
    axis.set(xlabel="unknown vertices", ylabel="time per frame / ms", ylim=(0, None))
    axis.legend(loc="upper left")


def along_frames(axis: "Axes", run: Run, method: Method, label: str | None = None) -> None:
    """Draw the error of a run along the frames."""
    axis.plot(
        np.arange(1, len(run.nmsve) + 1),
        shown(run),
        method.dash,
        color=method.colour,
        label=label or method.label,
        linewidth=1.3,
    )
