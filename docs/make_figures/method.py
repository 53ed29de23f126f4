"""The figures of docs/method.md."""

from pathlib import Path
from typing import Any

import numpy as np
from completion import Completed, complete
from png import save_png

import dynmesh
from dynmesh.study.losses import random_masks
from dynmesh.study.methods import MOTION, ONCE
from dynmesh.study.style import NMSVE_LABEL, new_figure
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import NMSVE_UNIT, percent

SHARE_COLOURS = {0.1: "#cc3311", 0.3: "#0072b2", 0.5: "#009e73"}


def draw_generations(folder: Path) -> None:
    """A small sheet from above: anchors, and satellites by generation."""
    sheet = dynmesh.synth.ocean(2, grid=14)
    known = np.random.default_rng(6).random(14 * 14) < 0.1
    completer = dynmesh.Completer(sheet.faces, sheet.vertices[0], method="motion")
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
        save_png(figure, folder, "generations", is_chart=True)


def draw_two_readings(subjects: list[Subject], folder: Path) -> None:
    """Error against frame, re-estimated and once only."""
    with new_figure(11, 6.4) as figure:
        axes = figure.subplots(2, len(subjects), sharex=True, sharey=True)
        for column, subject in zip(axes.T, subjects, strict=True):
            for axis, share in zip(column, (0.1, 0.3), strict=True):
                for revisit, label, method in (
                    (True, "re-estimated", MOTION),
                    (False, "once only", ONCE),
                ):
                    frames = complete(
                        subject, random_masks(subject, share), revisit=revisit, method="motion"
                    )
                    plot_error(axis, frames, color=method.colour, ls=method.dash, label=label)
                axis.set(title=f"{subject.name}, {percent(share)} known", ylim=(0.1, 1e4))
            column[-1].set_xlabel("frame")
        for axis in axes[:, 0]:
            axis.set_ylabel(NMSVE_LABEL)
        axes[0, 0].legend(loc="upper left")
        save_png(figure, folder, "two_readings", is_chart=True)


def draw_drift(subjects: list[Subject], folder: Path) -> None:
    """Error against frame, and against the time since a vertex was last observed."""
    with new_figure(14, 5.2) as figure:
        axes = figure.subplots(1, len(subjects) + 1)
        for axis, subject in zip(axes, subjects, strict=False):
            for share, colour in SHARE_COLOURS.items():
                frames = complete(subject, random_masks(subject, share), method="motion")
                plot_error(axis, frames, color=colour, label=f"{percent(share)} known")
                if subject is subjects[0]:
                    plot_error_by_age(axes[-1], frames, color=colour)
                frames = complete(
                    subject, random_masks(subject, share), extra_iterations=10, method="motion"
                )
                label = f"{percent(share)} known, 10 extra iterations"
                plot_error(axis, frames, color=colour, ls="--", label=label)
            frames = complete(subject, random_masks(subject, 0.1), whole_every=50, method="motion")
            label = "10 % known, every 50th frame whole"
            plot_error(axis, frames, color=SHARE_COLOURS[0.1], ls=":", label=label)
            axis.set(title=subject.name, xlabel="frame", ylim=(0.05, 40))
        axes[0].set_ylabel(NMSVE_LABEL)
        axes[-1].set(title=f"{subjects[0].name}, by age", yscale="log", ylabel="error / diagonal")
        axes[-1].set_xlabel("frames since the vertex was last observed")
        figure.legend(
            *axes[0].get_legend_handles_labels(),
            loc="outside lower center",
            ncols=4,
            columnspacing=1,
        )
        save_png(figure, folder, "drift", is_chart=True)


def plot_error(axis: Any, frames: list[Completed], **style: Any) -> None:
    """NMSVE times 10 000 of each frame; one that is zero breaks the line."""
    numbers = np.arange(1, len(frames) + 1)
    nmsve = np.array([frame.nmsve for frame in frames]) / NMSVE_UNIT
    axis.plot(numbers, np.where(nmsve > 0, nmsve, np.nan), linewidth=1.3, **style)
    axis.set_yscale("log")


def plot_error_by_age(axis: Any, frames: list[Completed], **style: Any) -> None:
    """The mean over all vertices of one age, where there are a thousand of them."""
    age = np.concatenate([frame.age for frame in frames])
    error = np.concatenate([frame.error for frame in frames])
    count = np.bincount(age)
    ages = np.flatnonzero(count >= 1000)[1:]  # those of age 0 are exact
    axis.plot(ages, np.bincount(age, error)[ages] / count[ages], **style)
