"""The figures with curves and bars: 7 and 9 of the paper, and 12 to 14 beyond it."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .baselines import BEYOND
from .completion import Method
from .fits import LinearFit
from .losses import PAPER_SHARES, SCENARIOS
from .measure import Run
from .methods import COMPARED, LIA_ON_MOTION, MOTION, ONCE
from .sequence_study import Study
from .style import NMSVE_LABEL, new_figure, save
from .tables import NMSVE_UNIT, percent

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

_LARGEST_SHOWN = 1e5  # in the unit of the figures; larger errors are outside the picture


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
    """Draw the error and time of the methods of the paper, and the error along the frames."""
    methods = {study.subject.name: list(COMPARED) for study in studies}
    return _compared(studies, methods, folder, "figure9", with_bands=True)


def figure14(studies: list[Study], folder: Path) -> Path:
    """Draw the same for motion, detail and baselines, without bands, which would overlap."""
    methods = {
        study.subject.name: [MOTION, *study.beyond[:1], LIA_ON_MOTION, *study.beyond[1:]]
        for study in studies
    }
    return _compared(studies, methods, folder, "figure14_detail_and_libigl", with_bands=False)


def _compared(
    studies: list[Study],
    methods: dict[str, list[Method]],
    folder: Path,
    name: str,
    *,
    with_bands: bool,
) -> Path:
    labels: dict[str, Artist] = {}
    with new_figure(15, 4.8 * len(studies) + 0.7) as figure:
        axes = figure.subplots(len(studies), 3, squeeze=False)
        for row, study in zip(axes, studies, strict=True):
            for method in methods[study.subject.name]:
                shares = study.shares(method)
                runs = [study.grid[method.key, share] for share in shares]
                if with_bands:
                    _bands(row[0], shares, [_shown(r) for r in runs], method, (10, 90))
                    _bands(row[1], shares, [1e3 * r.seconds for r in runs], method, (25, 75))
                _line(row[0], shares, [_shown(r).mean() for r in runs], method)
                _line(row[1], shares, [1e3 * np.median(r.seconds) for r in runs], method)
                _along_frames(row[2], study.grid[method.key, 0.3], method)
            row[0].set(ylabel=NMSVE_LABEL, title=_title(study))
            row[1].set(ylabel="time per frame / ms")
            row[2].set(ylabel=NMSVE_LABEL, title=f"{percent(0.3)} known", xlabel="frame")
            for axis in row[:2]:
                axis.set(xlabel="known vertices / %")
            for axis in row:
                axis.set_yscale("log")
            handles = row[0].get_legend_handles_labels()
            labels |= dict(zip(handles[1], handles[0], strict=True))
        figure.legend(labels.values(), labels.keys(), loc="outside lower center", ncols=len(labels))
        return save(figure, folder, name, is_chart=True)


def figure12(studies: list[Study], folder: Path) -> Path:
    """Draw the error of all methods if vertices are hidden from a camera or by patches."""
    methods = [*COMPARED, *(m for m in BEYOND if any(m in study.beyond for study in studies))]
    width = 0.86 / len(methods)
    with new_figure(13.5, 5.2) as figure:
        axes = figure.subplots(1, len(SCENARIOS), sharey=True)
        for axis, (name, words) in zip(axes, SCENARIOS.items(), strict=True):
            for index, method in enumerate(methods):
                measured = [i for i, s in enumerate(studies) if (name, method.key) in s.scenarios]
                runs = [studies[i].scenarios[name, method.key] for i in measured]
                centres = np.array(measured) + width * (index - (len(methods) - 1) / 2)
                means = [_shown(run).mean() for run in runs]
                below, above = zip(*(_spread(_shown(r), (10, 90)) for r in runs), strict=True)
                axis.bar(
                    centres,
                    means,
                    0.92 * width,
                    color=method.colour,
                    label=method.label,
                    hatch="///" if method.dash == "--" else None,
                    edgecolor="white",
                    yerr=(
                        np.clip(means - np.array(below), 0, None),
                        np.clip(above - np.array(means), 0, None),
                    ),
                    ecolor="#555555",
                )
            axis.set_xticks(range(len(studies)), [study.subject.name for study in studies])
            axis.set(title=words, yscale="log")
            axis.grid(visible=False, axis="x")
        axes[0].set(ylabel=NMSVE_LABEL)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        return save(figure, folder, "figure12_camera_and_patches", is_chart=True)


def figure13(studies: list[Study], folder: Path) -> Path:
    """Draw the error of the two readings of the weights along the frames."""
    with new_figure(13.5, 4.0 * len(studies) + 0.6) as figure:
        axes = figure.subplots(len(studies), len(PAPER_SHARES), sharey="row", squeeze=False)
        for row, study in zip(axes, studies, strict=True):
            for axis, share in zip(row, PAPER_SHARES, strict=True):
                _along_frames(axis, study.grid[MOTION.key, share], MOTION, "re-estimated")
                _along_frames(axis, study.once[share], ONCE, "once only")
                axis.set(yscale="log", xlabel="frame", title=f"{percent(share)} known")
            curves = [_shown(study.grid[MOTION.key, share]) for share in PAPER_SHARES]
            errors = np.concatenate([*curves, *(_shown(run) for run in study.once.values())])
            errors = errors[errors > 0]
            if len(errors):
                row[0].set_ylim(0.7 * errors.min(), min(1.4 * errors.max(), _LARGEST_SHOWN))
            row[0].set(ylabel=f"{study.subject.name}: {NMSVE_LABEL}")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        return save(figure, folder, "figure13_two_readings", is_chart=True)


def linear_fit(study: Study) -> LinearFit:
    """Fit a line to milliseconds per frame over the number of unknown vertices."""
    return LinearFit.of(*_times(study))


def _shown(run: Run) -> Floats:
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
    fit = LinearFit.of(unknown, milliseconds)
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


def _along_frames(axis: "Axes", run: Run, method: Method, label: str | None = None) -> None:
    axis.plot(
        np.arange(1, len(run.nmsve) + 1),
        _shown(run),
        method.dash,
        color=method.colour,
        label=label or method.label,
        linewidth=1.3,
    )
