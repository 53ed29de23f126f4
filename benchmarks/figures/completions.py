"""Pictures of what was observed, of what is true, and of what methods make of it."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dynmesh.draw.figures import View
from dynmesh.sequence import Positions

from ..harness import nmsve_cell, progress
from ..methods import BIHARMONIC, DETAIL, MOTION, Method, trained
from ..runner import run, vertex_error
from ..subjects import Subject, scenario_masks
from .strip import Panel, draw_observed, draw_surface, save

Shown = tuple[tuple[str, Method], ...]
BESIDE_BIHARMONIC: Shown = (("dynmesh", DETAIL), ("libigl", BIHARMONIC))


@dataclass(frozen=True)
class Picture:
    """One picture: a column for what was observed, one for the truth, and one for each method.

    Attributes:
        file: its path in the folder of figures; .png is a still picture, .webp a moving one.
        frames: the numbers of the frames that are shown.
        azimuth: the direction from which it is taken, in degrees around the up axis.
        methods: of dynmesh, and the one of libigl that is the most accurate here.
        size: of each column in pixels, before white margins are cut off.
        with_truth: whether there is a column for the truth.
    """

    file: str
    frames: Sequence[int]
    azimuth: float
    methods: Shown = BESIDE_BIHARMONIC
    size: tuple[int, int] = (360, 480)
    with_truth: bool = True


HIDDEN_SIDE = Picture(
    "method/hidden_side.png",
    [104],
    200,
    (("motion", MOTION), ("detail", DETAIL), ("libigl", BIHARMONIC)),
)
WALKER = Picture("readme/walker.webp", range(1, 175, 3), 200, with_truth=False)


def training(training: Positions) -> Picture:
    """The picture of docs/guides/training.md: the same frame without and with training."""
    methods = (("detail", DETAIL), ("detail, trained", trained(training)))
    return Picture("training/walker.png", [95], 200, methods)


def draw(picture: Picture, subject: Subject, folder: Path) -> None:
    """Completes what a camera sees of a whole sequence, and draws some of its frames.

    Methods of libraries that are not installed are left out, with a message.
    """
    masks = scenario_masks("camera", subject)
    widest, truth = view_of(picture, subject), subject.vertices
    views = {n: widest.around(truth[n]) for n in picture.frames}
    known = f"{100 * np.mean(masks[1:]):.0f} % of the vertices"
    seen = [draw_observed(subject.faces, truth[n], masks[n], view) for n, view in views.items()]
    panels = [Panel("observed", known, seen)]
    if picture.with_truth:
        true = [draw_surface(subject.faces, truth[n], view) for n, view in views.items()]
        panels.append(Panel("true", "", true))
    for title, method in progress(picture.methods, picture.file):
        try:
            found = run(subject, method, masks, keep=picture.frames)
        except ImportError as error:
            print(f"{picture.file}: {title} is left out: {error}", file=sys.stderr)
            continue
        images = [
            draw_surface(subject.faces, frame, views[n], vertex_error(subject, n, frame))
            for n, frame in found.frames.items()
        ]
        panels.append(Panel(title, f"NMSVE x 1e4: {nmsve_cell(found.error)}", images))
    save(panels, folder / picture.file)


def view_of(picture: Picture, subject: Subject) -> View:
    """A view at a scale in which every frame fits, with room for wrong completions."""
    frames = subject.vertices[list(picture.frames)]
    half = 1.1 * np.max([np.ptp(points, axis=0) / 2 for points in frames], axis=0)
    view = View.of(frames[0], subject.up, picture.azimuth, picture.size)
    return replace(view, box=np.stack([-half, half]))
