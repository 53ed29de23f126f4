"""The figures of docs/method.md."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dynmesh import Completer, metrics, synth
from dynmesh.sequence import Mask
from dynmesh.study.completion import Method
from dynmesh.study.losses import random_masks
from dynmesh.study.measure import run
from dynmesh.study.methods import MOTION
from dynmesh.study.style import NMSVE_LABEL, new_figure, save_png
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import NMSVE_UNIT, percent

from ..drift import EXTRA

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHARE_COLOURS = {0.1: "#cc3311", 0.3: "#0072b2", 0.5: "#009e73"}


def draw_generations(folder: Path) -> None:
    """Draw a small sheet from above: anchors, and satellites by generation."""
    sheet = synth.ocean(2, grid=14)
    known = np.random.default_rng(6).random(14 * 14) < 0.1
    completer = Completer(sheet.faces, sheet.vertices[0], method="motion")
    completer.push(sheet.vertices[1], known)
    x, y = np.meshgrid(np.arange(14), np.arange(14), indexing="ij")
    colours = ["#0072b2", "#fdd49e", "#fc8d59", "#d7301f", "#7f0000", "#000000"]
    with new_figure(6.6, 5) as figure:
        axis = figure.subplots()
        axis.triplot(x.ravel(), y.ravel(), sheet.faces, color="#bbbbbb", linewidth=0.7)
        for generation in range(completer.generation.max() + 1):
            chosen = completer.generation == generation
            label = "anchor" if generation == 0 else f"generation {generation}"
            size = 110 if generation == 0 else 60
            axis.scatter(
                x.ravel()[chosen],
                y.ravel()[chosen],
                size,
                colours[generation],
                marker="s" if generation == 0 else "o",
                label=label,
                edgecolor="#333333",
                linewidth=0.6,
                zorder=3,
            )
        axis.set_aspect("equal")
        axis.set_axis_off()
        figure.legend(loc="outside right center")
        save_png(figure, folder / "generations.png", is_chart=True)


def draw_drift(subjects: list[Subject], folder: Path) -> None:
    """Draw error against frame, and against the time since a vertex was last observed."""
    with new_figure(14, 5.2) as figure:
        axes = figure.subplots(1, len(subjects) + 1)
        for axis, subject in zip(axes, subjects, strict=False):
            for share, colour in SHARE_COLOURS.items():
                label = f"{percent(share)} known"
                plot_error(axis, subject, MOTION, share, "-", colour, label)
                label += ", 10 extra iterations"
                plot_error(axis, subject, EXTRA, share, "--", colour, label)
            label, colour = "10 % known, every 50th frame whole", SHARE_COLOURS[0.1]
            plot_error(axis, subject, MOTION, 0.1, ":", colour, label, whole_every=50)
            axis.set(title=subject.name, xlabel="frame", ylim=(0.05, 40))
        axes[0].set_ylabel(NMSVE_LABEL)
        for share, colour in SHARE_COLOURS.items():
            plot_error_by_age(axes[-1], subjects[0], share, colour)
        axes[-1].set(title=f"{subjects[0].name}, by age", yscale="log", ylabel="error / diagonal")
        axes[-1].set_xlabel("frames since the vertex was last observed")
        figure.legend(
            *axes[0].get_legend_handles_labels(),
            loc="outside lower center",
            ncols=4,
            columnspacing=1,
        )
        save_png(figure, folder / "drift.png", is_chart=True)


def plot_error(
    axis: "Axes",
    subject: Subject,
    method: Method,
    share: float,
    dash: str,
    colour: str,
    label: str,
    whole_every: int | None = None,
) -> None:
    """Draw NMSVE times 10 000 of each frame; one that is zero breaks the line."""

    def masks() -> Iterator[Mask]:
        for number, known in enumerate(random_masks(subject, share)):
            whole = whole_every is not None and number % whole_every == 0
            yield np.full_like(known, True) if whole else known

    nmsve = run(subject, method, masks()).nmsve / NMSVE_UNIT
    numbers = np.arange(1, len(nmsve) + 1)
    shown = np.where(nmsve > 0, nmsve, np.nan)
    axis.plot(numbers, shown, dash, color=colour, label=label, linewidth=1.3)
    axis.set_yscale("log")


def plot_error_by_age(axis: "Axes", subject: Subject, share: float, colour: str) -> None:
    """Draw the mean over all vertices of one age, where there are a thousand of them."""
    completer = Completer(subject.faces, subject.vertices[0], method="motion")
    count = np.zeros(subject.n_frames, np.int64)
    total = np.zeros(subject.n_frames)
    for number, known in enumerate(random_masks(subject, share)):
        if number == 0:
            continue
        truth = subject.vertices[number]
        error = metrics.vertex_error(truth, completer.push(truth, known)) / subject.diagonal
        count += np.bincount(completer.age, minlength=subject.n_frames)
        total += np.bincount(completer.age, error, subject.n_frames)
    ages = np.flatnonzero(count >= 1000)[1:]  # those of age 0 are exact
    axis.plot(ages, total[ages] / count[ages], color=colour)
