"""The figures of the paper that show meshes: 8, 10 and 11."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, to_hex
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dynmesh.draw import figures
from dynmesh.draw.figures import (
    HEATMAP,
    HEATMAP_RANGE,
    KNOWN_COLOUR,
    MISSING_COLOUR,
    SURFACE_COLOUR,
    Image,
    View,
)
from dynmesh.sequence import Positions

from ..methods import LIA, LSM, MOTION
from ..runner import Run, vertex_error
from ..style import new_figure, nmsve_caption, save
from ..subjects import PAPER_SHARES, Subject, percent
from .study import Study, pictured_frames

_PANEL_WIDTH = 3.0  # inches
_HEAT = [to_hex(colour) for colour in colormaps[HEATMAP](np.linspace(0, 1, 256))]


def draw(study: Study, folder: Path) -> None:
    """Draw all pictures of one sequence."""
    figure8(study, folder)
    figure10(study, folder)
    figure11(study, folder)


def figure8(study: Study, folder: Path) -> None:
    """Draw known and missing vertices, and heatmaps of the error, at four shares."""
    subject = study.subject
    number = pictured_frames(subject)["figure8"]
    runs = [study.at(MOTION, share) for share in PAPER_SHARES]
    view = view_of(subject, [number])
    dots = [observed(subject, number, run, view) for run in runs]
    heat, limit = heatmaps(subject, number, runs, view)
    images = figures.cropped([*dots, *heat])
    titles = [f"{percent(share)} known" for share in PAPER_SHARES]
    captions = [nmsve_caption(run.nmsve[number - 1]) for run in runs]
    sheet(
        f"{subject.name}, frame {number}: known (blue) and missing (red); error after completion",
        [images[: len(runs)], images[len(runs) :]],
        [titles, [""] * len(runs)],
        [[""] * len(runs), captions],
        folder / f"figure8_{subject.name}.png",
        limit,
    )


def figure10(study: Study, folder: Path) -> None:
    """Draw the original, motion, LIA and LSM side by side."""
    subject = study.subject
    chosen = [
        (share, pictured_frames(subject)[f"figure10 {percent(share)}, {which}"])
        for share in (0.3, 0.5)
        for which in ("first", "second")
    ]
    view = view_of(subject, [number for _, number in chosen])
    images: list[Image] = []
    captions: list[list[str]] = []
    for share, number in chosen:
        runs = [study.at(method, share) for method in (MOTION, LIA, LSM)]
        images += surfaces(subject, number, [run.frames[number] for run in runs], view)
        errors = [nmsve_caption(run.nmsve[number - 1]) for run in runs]
        captions.append([f"frame {number}, {percent(share)} known", *errors])
    images = figures.cropped(images)
    rows = [images[first : first + 4] for first in range(0, len(images), 4)]
    titles = [["original", MOTION.label, LIA.label, LSM.label], *[[""] * 4] * (len(rows) - 1)]
    sheet(subject.name, rows, titles, captions, folder / f"figure10_{subject.name}.png")


def figure11(study: Study, folder: Path) -> None:
    """Draw reconstructions at four shares beside the original."""
    subject = study.subject
    number = pictured_frames(subject)["figure11"]
    runs = [study.at(MOTION, share) for share in PAPER_SHARES]
    frames = [run.frames[number] for run in runs]
    row = figures.cropped(surfaces(subject, number, frames, view_of(subject, [number])))
    captions = ["", *(nmsve_caption(run.nmsve[number - 1]) for run in runs)]
    titles = ["original", *(f"{percent(share)} known" for share in PAPER_SHARES)]
    heading = f"{subject.name}, frame {number}, completed by motion"
    sheet(heading, [row], [titles], [captions], folder / f"figure11_{subject.name}.png")


def view_of(subject: Subject, numbers: list[int]) -> View:
    """Return a view that is large enough for each of the frames."""
    views = [View.of(subject.vertices[n], subject.up, subject.azimuth) for n in numbers]
    half = np.max([(view.box[1] - view.box[0]) / 2 for view in views], axis=0)
    return replace(views[0], box=np.stack([-half, half])).around(subject.vertices[numbers[0]])


def surfaces(
    subject: Subject, number: int, completed: Sequence[Positions], view: View
) -> list[Image]:
    """Draw the true surface of a frame, and completed ones."""
    truth = subject.vertices[number]
    return [
        figures.render(
            subject.faces, frame, view.around(truth), np.zeros(len(frame)), (SURFACE_COLOUR,)
        )
        for frame in (truth, *completed)
    ]


def observed(subject: Subject, number: int, run: Run, view: View) -> Image:
    """Draw the true surface of a frame, blue around known and red around missing vertices."""
    known = run.masks[number].astype(float)
    colours = (MISSING_COLOUR, KNOWN_COLOUR)
    return figures.render(subject.faces, subject.vertices[number], view, known, colours)


def heatmaps(
    subject: Subject, number: int, runs: Sequence[Run], view: View
) -> tuple[list[Image], float]:
    """Draw errors on one scale, which ends at the 99th percentile of the worst method."""
    frames = [run.frames[number] for run in runs]
    errors: list[NDArray[np.float64]] = [vertex_error(subject, number, frame) for frame in frames]
    limit = max(float(np.percentile(error, 99)) for error in errors) or 1.0
    images = [
        figures.render(subject.faces, frame, view, _place(error / limit), _HEAT)
        for frame, error in zip(frames, errors, strict=True)
    ]
    return images, limit


def _place(share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where shares of the largest error are on its logarithmic scale, from 0 to 1."""
    return np.asarray(1 - np.log(np.clip(share, HEATMAP_RANGE, 1)) / np.log(HEATMAP_RANGE))


def sheet(
    heading: str,
    rows: list[list[Image]],
    titles: list[list[str]],
    captions: list[list[str]],
    path: Path,
    limit: float | None = None,
) -> None:
    """Draw pictures in rows, with titles and captions, and a colour bar if there is a limit."""
    columns = len(titles[0])
    width = _PANEL_WIDTH * columns + (0.9 if limit is not None else 0)
    heights = [_PANEL_WIDTH * row[0].shape[0] / row[0].shape[1] for row in rows]
    # Panels of tall subjects are made smaller, so that the figure fits on a page.
    shrink = min(1.0, 10.5 / sum(heights), 4.2 / max(heights))
    heights = [height * shrink for height in heights]
    with new_figure(max(width, 10.5), sum(heights) + 0.45 * len(rows) + 0.8) as figure:
        axes = figure.subplots(len(rows), columns, squeeze=False, height_ratios=heights)
        figure.suptitle(heading)
        for axis in axes.ravel():
            axis.set(xticks=[], yticks=[])
            axis.grid(visible=False)
            axis.spines[:].set_visible(False)
        for row, images, heads, texts in zip(axes, rows, titles, captions, strict=True):
            for axis, image, head, text in zip(row, images, heads, texts, strict=False):
                axis.imshow(image, interpolation="antialiased")
                axis.set_title(head, fontsize=12)
                axis.set_xlabel(text)
        if limit is not None:
            _colour_bar(figure, axes.ravel(), limit)
        save(figure, path, is_chart=False)


def _colour_bar(figure: Figure, axes: NDArray[np.object_], limit: float) -> None:
    scale = LogNorm(100 * limit * HEATMAP_RANGE, 100 * limit)
    colours = ScalarMappable(scale, HEATMAP)
    bar = figure.colorbar(
        colours, ax=axes.tolist(), extend="both", shrink=0.6 if len(axes) > 6 else 0.85, pad=0.01
    )
    bar.set_label("error / % of diagonal")
