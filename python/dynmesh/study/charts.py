"""The figures with curves: 7 and 9 of the paper."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .completion import Method
from .fits import LinearFit, fit_line
from .measure import Run
from .methods import COMPARED, MOTION
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
            _band(
                iterations,
                100 * shares,
                [r.iterations.astype(np.float64) for r in runs],
                MOTION.colour,
                (0, 100),
            )
            iterations.set(ylabel="iterations per frame", title=_title(study), ylim=(0, None))
            _band(time, 100 * shares, [1e3 * r.seconds for r in runs], MOTION.colour, (25, 75))
            time.set(ylabel="time per frame / ms", ylim=(0, None))
            for axis in (iterations, time):
                axis.set(xlabel="known vertices / %", xlim=(0, 100))
            _fitted_line(line, study)
        return save(figure, folder, "figure7", is_chart=True)


def figure9(studies: list[Study], folder: Path) -> Path:
    """Draw the error and time of all methods, and the error along the frames."""
    return compared(studies, COMPARED, folder, "figure9", with_bands=True)


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
                runs = [study.grid[method.key, share] for share in shares]
                if with_bands:
                    _bands(row[0], shares, [shown(r) for r in runs], method, (10, 90))
                    _bands(row[1], shares, [1e3 * r.seconds for r in runs], method, (25, 75))
                _line(row[0], shares, [shown(r).mean() for r in runs], method)
                _line(row[1], shares, [1e3 * np.median(r.seconds) for r in runs], method)
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


def _spread(values: Floats, percentiles: tuple[float, float]) -> tuple[float, float]:
    low, high = np.percentile(values, percentiles)
    return float(low), float(high)


def _band(
    axis: "Axes", x: Floats, values: list[Floats], colour: str, percentiles: tuple[float, float]
) -> None:
    low, high = zip(*(_spread(v, percentiles) for v in values), strict=True)
    axis.fill_between(x, low, high, color=colour, alpha=0.25, linewidth=0)
    axis.plot(x, [np.median(v) for v in values], color=colour, marker="o", markersize=4)


def _fitted_line(axis: "Axes", study: Study) -> None:
    unknown, milliseconds = _times(study)
    fit = fit_line(unknown, milliseconds)
    ends = np.array([0, unknown.max()])
    axis.plot(unknown, milliseconds, "o", color=MOTION.colour, markersize=5, label="median")
    label = f"line, R² = {fit.r_squared:.3f}"
    axis.plot(ends, fit.slope * ends + fit.intercept, color="#333333", linewidth=1.2, label=label)
    axis.set(xlabel="unknown vertices", ylabel="time per frame / ms", ylim=(0, None))
    axis.legend(loc="upper left")


def _bands(
    axis: "Axes",
    shares: list[float],
    values: list[Floats],
    method: Method,
    percentiles: tuple[float, float],
) -> None:
    low, high = zip(*(_spread(v, percentiles) for v in values), strict=True)
    percents = 100 * np.array(shares)
    axis.fill_between(percents, low, high, color=method.colour, alpha=0.12, linewidth=0)


def _line(axis: "Axes", shares: list[float], values: list[float], method: Method) -> None:
    percents = 100 * np.array(shares)
    axis.plot(percents, values, method.dash, color=method.colour, label=method.label)


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
