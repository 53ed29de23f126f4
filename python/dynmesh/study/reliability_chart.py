"""The reliability diagram of the error bars, figure 16."""

from pathlib import Path

from .losses import SCENARIOS
from .sequence_study import Study
from .style import new_figure, save

_COLOURS = ("#1b6ca8", "#7fb069", "#c44536", "#e6a02b")
_ALIKE = {"color": "#888888", "linestyle": "--", "linewidth": 1}


def figure16(studies: list[Study], folder: Path) -> Path:
    """Draw predicted against observed: the shares that intervals hold, and the size of errors."""
    with new_figure(10.5, 4.6 * len(studies) + 0.6) as figure:
        axes = figure.subplots(len(studies), 2, squeeze=False)
        for (intervals, sizes), study in zip(axes, studies, strict=True):
            intervals.plot([0, 100], [0, 100], **_ALIKE)
            ends: list[float] = []
            for colour, (name, found) in zip(_COLOURS, study.bars.items(), strict=False):
                words = SCENARIOS.get(name, f"{name} known")
                intervals.plot(
                    100 * found.nominal, 100 * found.held, color=colour, label=words, linewidth=1.6
                )
                shown = found.observed > 0  # nothing else can be shown on a logarithmic axis
                predicted = 100 * found.predicted[shown]
                observed = 100 * found.observed[shown]
                sizes.plot(predicted, observed, "o-", color=colour, markersize=4)
                ends += list(predicted)
            subject = study.subject
            intervals.set(
                xlabel="errors that an interval should hold / %",
                ylabel="errors that it holds / %",
                title=f"{subject.name}, {subject.n_vertices} vertices",
                xlim=(0, 100),
                ylim=(0, 100),
            )
            sizes.set(
                xlabel="predicted error / % of the diagonal",
                ylabel="true error / % of the diagonal",
                title="root mean squares",
            )
            if ends:
                sizes.set(xscale="log", yscale="log")
                sizes.plot([min(ends), max(ends)], [min(ends), max(ends)], **_ALIKE)
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
        return save(figure, folder, "figure16_error_bars", is_chart=True)
