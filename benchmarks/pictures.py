"""Pictures of meshes beside one another, still or moving, with errors on one scale of colours."""

import io
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, to_hex
from numpy.typing import NDArray
from PIL import Image

from dynmesh._arrays import Positions
from dynmesh.draw import figures
from dynmesh.draw.figures import SURFACE_COLOUR, View

from .style import new_figure, save, transparent
from .subjects import Subject

HEATMAP = ListedColormap(figures.heatmap(256))
ERRORS = ScalarMappable(LogNorm(0.1, 5, clip=True), HEATMAP)
"""The colours of errors in per cent of the bounding-box diagonal; the ends hold what is beyond."""

EDGES = ScalarMappable(LogNorm(0.1, 5, clip=True), HEATMAP)
"""The same of errors in mean edges."""

_WIDTH = 3.0  # of a panel, in inches
_PER_SECOND = 15  # frames of a moving picture
_MOVING_DPI = 75


class Panel(NamedTuple):
    """One of the pictures: as many images as the whole has frames, a title and a caption."""

    images: list[figures.Image]
    title: str = ""
    caption: str = ""


def view_of(subject: Subject, numbers: Sequence[int]) -> View:
    """Return a view at a scale in which frames fit, with room for wrong completions."""
    frames = subject.vertices[list(numbers)]
    half = 1.1 * np.ptp(frames, axis=1).max(axis=0) / 2
    return replace(
        View.of(frames[0], subject.up, subject.azimuth), box=np.stack([-half, half])
    ).around(frames[0])


def surface(
    subject: Subject,
    points: Positions,
    view: View,
    error: NDArray[np.float64] | None = None,
    scale: ScalarMappable = ERRORS,
) -> figures.Image:
    """Draw a surface, coloured by the errors of its vertices in diagonals if they are given."""
    if error is None:
        return figures.render(subject.faces, points, view, np.zeros(len(points)), (SURFACE_COLOUR,))
    places = np.asarray(scale.norm(100 * error))
    colours = [to_hex(colour) for colour in scale.cmap(np.linspace(0, 1, 256))]
    return figures.render(subject.faces, points, view, places, colours)


def sheet(
    rows: list[list[Panel]],
    path: Path,
    scale: ScalarMappable | None = None,
    heading: str = "",
    unit: str = "% of diagonal",
    font: float = 12,
) -> None:
    """Arrange pictures in rows, with a bar of colours if there is a scale of errors.

    White margins are cut off, from all alike. If panels have several images, the picture moves.
    """
    panels = [*chain(*rows)]
    images = iter(figures.cropped([image for panel in panels for image in panel.images]))
    frames = [*zip(*([next(images) for _ in panel.images] for panel in panels), strict=True)]
    height, width, _ = frames[0][0].shape
    # Panels of tall subjects are made smaller, so that the figure fits on a page.
    each = min(_WIDTH * height / width, 10.5 / len(rows), 4.2)
    across = _WIDTH * len(rows[0]) + (0.9 if scale else 0)
    with new_figure(max(across, 10.5), (each + font / 27) * len(rows) + 0.8) as figure:
        axes = figure.subplots(len(rows), len(rows[0]), squeeze=False)
        figure.suptitle(heading)
        for axis, panel in zip(axes.flat, panels, strict=True):
            axis.set(xticks=[], yticks=[])
            axis.set_xlabel(panel.caption, fontsize=font)
            axis.set_title(panel.title, fontsize=font)
            axis.grid(visible=False)
            axis.spines[:].set_visible(False)
        shown = [
            axis.imshow(image, interpolation="antialiased")
            for axis, image in zip(axes.flat, frames[0], strict=True)
        ]
        if scale:
            bar = figure.colorbar(
                scale, ax=axes, extend="both", shrink=0.6 if len(rows) > 1 else 0.85, pad=0.01
            )
            bar.set_label(f"error / {unit}", fontsize=font)
            bar.ax.tick_params(labelsize=font)
        if len(frames) == 1:
            save(figure, path, is_chart=False)
            return
        moving = []
        for frame in frames:
            for artist, image in zip(shown, frame, strict=True):
                artist.set_data(image)
            figure.savefig(file := io.BytesIO(), dpi=_MOVING_DPI)
            moving.append(transparent(Image.open(file), is_chart=False))
        path.parent.mkdir(parents=True, exist_ok=True)
        moving[0].save(
            path,
            save_all=True,
            append_images=moving[1:],
            duration=round(1000 / _PER_SECOND),
            loop=0,
            quality=55,
            alpha_quality=60,
            method=4,
        )
