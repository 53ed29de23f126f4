"""The pictures of docs/gallery.md."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from completion import Completed, complete
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray
from png import save_png

from dynmesh.draw import figures
from dynmesh.draw.figures import Image, View
from dynmesh.study.losses import random_masks
from dynmesh.study.style import new_figure, nmsve_caption
from dynmesh.study.subjects import Subject


@dataclass(frozen=True)
class Scale:
    """One logarithmic scale of colours for all pictures of one quantity.

    Attributes:
        limit: the value that has the last colour.
        unit: what values are divided by on the bar.
        label: of the bar.
        ticks: on the bar, by what is written there.
    """

    limit: float
    unit: float
    label: str
    ticks: dict[str, float]

    def draw(self, figure: Figure, axes: NDArray[Any]) -> None:
        """Puts the bar at the right of the axes."""
        last = self.limit / self.unit
        colours = ScalarMappable(LogNorm(last * figures.HEATMAP_RANGE, last), figures.HEATMAP)
        bar = figure.colorbar(
            colours, ax=axes.ravel().tolist(), extend="both", shrink=0.7, aspect=28, pad=0.02
        )
        bar.set_label(self.label)
        bar.ax.minorticks_off()
        bar.set_ticks(list(self.ticks.values()), labels=list(self.ticks))


ERRORS = Scale(
    0.02,
    0.01,
    "distance from the true place / % of the diagonal",
    {f"{tick:g}": tick for tick in (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2)},
)
COUNTS = Scale(
    40, 1, "edges, frames", {"0": 0.4} | {f"{tick:g}": tick for tick in (1, 2, 5, 10, 20, 40)}
)


def draw_losses(
    subject: Subject, number: int, by_loss: dict[str, Completed], view: View, folder: Path
) -> None:
    """What is known, what was completed and the error, for each way to lose vertices."""
    truth = subject.vertices[number]
    images: list[Image] = []
    captions: list[str] = []
    for frame in by_loss.values():
        images.append(figures.render(subject.faces, truth, view, known=frame.known))
        images.append(figures.render(subject.faces, frame.points, view))
        images.append(heatmap(subject, frame, view))
        captions += ["", "", nmsve_caption(frame.nmsve)]
    columns = ["known and missing", f"completed frame {number}", "error"]
    draw_sheet(images, columns, list(by_loss), folder, f"{subject.name}_losses", ERRORS, captions)


def draw_generations_and_ages(
    subject: Subject, number: int, by_loss: dict[str, Completed], view: View, folder: Path
) -> None:
    """How far each vertex is from an observation, in edges and in frames."""
    truth = subject.vertices[number]
    counts = [frame.generation for frame in by_loss.values()]
    counts += [frame.age for frame in by_loss.values()]
    images = [
        figures.render(subject.faces, truth, view, values=count.astype(float), limit=COUNTS.limit)
        for count in counts
    ]
    rows = ["generation", "age in frames"]
    draw_sheet(images, list(by_loss), rows, folder, "generations_and_ages", COUNTS)


def draw_strip(subject: Subject, numbers: list[int], azimuth: float, folder: Path) -> None:
    """Frames along a sequence of which a tenth is known."""
    frames = complete(subject, random_masks(subject, 0.1))
    half = np.max([np.ptp(subject.vertices[number], axis=0) / 2 for number in numbers], axis=0)
    widest = replace(View.of(subject.vertices[0], subject.up, azimuth), box=np.stack([-half, half]))
    rows: dict[str, list[Image]] = {"known and missing": [], "completed": [], "error": []}
    for number in numbers:
        truth, frame = subject.vertices[number], frames[number - 1]
        view = widest.around(truth)
        known = figures.render(subject.faces, truth, view, known=frame.known)
        completed = figures.render(subject.faces, frame.points, view)
        for row, image in zip(
            rows.values(), (known, completed, heatmap(subject, frame, view)), strict=True
        ):
            row.append(image)
    images = [image for row in rows.values() for image in row]
    titles = [f"frame {number}" for number in numbers]
    draw_sheet(images, titles, list(rows), folder, f"{subject.name}_strip", ERRORS)


def draw_readings(subject: Subject, numbers: list[int], azimuth: float, folder: Path) -> None:
    """Both readings of the weights beside the original."""
    readings = [complete(subject, random_masks(subject, 0.1), revisit=r) for r in (True, False)]
    images = []
    for number in numbers:
        truth = subject.vertices[number]
        view = View.of(truth, subject.up, azimuth)
        for points in (truth, *(frames[number - 1].points for frames in readings)):
            images.append(figures.render(subject.faces, points, view))
    titles = ["original", "re-estimated", "once only"]
    rows = [f"frame {number}" for number in numbers]
    draw_sheet(images, titles, rows, folder, f"{subject.name}_readings")


def heatmap(subject: Subject, frame: Completed, view: View) -> Image:
    """The error, on the one scale."""
    return figures.render(subject.faces, frame.points, view, values=frame.error, limit=ERRORS.limit)


def draw_sheet(
    images: list[Image],
    columns: list[str],
    rows: list[str],
    folder: Path,
    name: str,
    scale: Scale | None = None,
    captions: list[str] | None = None,
) -> None:
    """Pictures row by row, a caption under each, and the bar of their colours."""
    images = figures.cropped(images)
    panel = 10 / len(columns)
    tall = min(panel * images[0].shape[0] / images[0].shape[1], 3.6)
    with new_figure(11.4, (tall + 0.35) * len(rows) + 0.4) as figure:
        axes = figure.subplots(len(rows), len(columns), squeeze=False)
        texts = captions or [""] * len(images)
        for axis, image, text in zip(axes.ravel(), images, texts, strict=True):
            axis.imshow(image, interpolation="antialiased")
            axis.set_xlabel(text)
            axis.set(xticks=[], yticks=[])
            axis.grid(visible=False)
            axis.spines[:].set_visible(False)
        for axis, title in zip(axes[0], columns, strict=True):
            axis.set_title(title, fontsize=12)
        for axis, title in zip(axes[:, 0], rows, strict=True):
            axis.set_ylabel(title)
        if scale is not None:
            scale.draw(figure, axes)
        save_png(figure, folder, name, is_chart=False)
