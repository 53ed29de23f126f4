"""The pictures of error bars in docs/gallery.md: predicted errors beside true ones."""

from pathlib import Path

import numpy as np

import dynmesh

from ..runner import vertex_error
from ..subjects import Subject
from .gallery import Picture, losses_of, view_of
from .strip import Panel, draw_observed, draw_surface, save

RECORDED = (
    Picture("recorded/bars_camera.png", "ict_face_arkit", "camera", [30], 0, (), (460, 500)),
    Picture("recorded/bars_patches.png", "crane", "patches", [129], 60, (), (460, 616)),
)


def draw(picture: Picture, subject: Subject, folder: Path) -> None:
    """Completes a sequence up to one frame, and draws its true and its predicted errors."""
    (shown,) = picture.frames
    completer = dynmesh.Completer(
        subject.faces, subject.vertices[0], method="detail", uncertainty=True
    )
    masks = losses_of(picture.loss, subject)
    for number in range(1, shown + 1):
        truth, known = subject.vertices[number], masks[number]
        frame = completer.push(truth, known)
    error = vertex_error(subject, shown, frame)
    # That of a position is the root of three times that of a coordinate.
    predicted = np.sqrt(3) * completer.standard_error / subject.diagonal
    within = np.mean((error <= 2.5 / np.sqrt(3) * predicted)[completer.generation > 0])
    view = view_of(picture, subject).around(truth)
    panels = [
        Panel(
            "observed",
            f"{100 * known.mean():.0f} % of the vertices",
            [draw_observed(subject.faces, truth, known, view)],
        ),
        Panel("true error", "", [draw_surface(subject.faces, frame, view, error)]),
        Panel(
            "predicted error",
            f"{100 * within:.0f} % in intervals of 90 %",
            [draw_surface(subject.faces, frame, view, predicted)],
        ),
    ]
    save(panels, folder / picture.file)
