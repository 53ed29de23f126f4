"""The figure of method detail in docs/method.md."""

from collections.abc import Callable
from pathlib import Path

from gallery import Scale, draw_sheet

import dynmesh
from dynmesh.draw import figures
from dynmesh.draw.figures import View
from dynmesh.sequence import Mask, Positions
from dynmesh.study.libigl import Harmonic
from dynmesh.study.losses import scenario_masks
from dynmesh.study.measure import vertex_error
from dynmesh.study.style import nmsve_caption
from dynmesh.study.subjects import Subject

Complete = Callable[[Positions, Mask], Positions]

ERRORS = Scale(
    0.05,
    0.01,
    "distance from the true place / % of the diagonal",
    {f"{tick:g}": tick for tick in (0.05, 0.1, 0.2, 0.5, 1, 2, 5)},
)


def draw_hidden_side(subject: Subject, number: int, azimuth: float, folder: Path) -> None:
    """One frame of a subject that one camera saw, from the side that it did not see.

    Raises:
        ImportError: libigl is missing.
    """
    faces, first, truth = subject.faces, subject.vertices[0], subject.vertices[number]
    methods: dict[str, Complete] = {
        "motion": dynmesh.Completer(faces, first).push,
        "detail": dynmesh.Completer(faces, first, method="detail").push,
        "libigl, biharmonic": Harmonic(faces, first, order=2).complete,
    }
    view = View.of(truth, subject.up, azimuth, (640, 500))
    masks = scenario_masks("camera", subject, 0)
    surfaces = [figures.render(faces, truth, view)]
    errors = [figures.render(faces, truth, view, known=masks[number])]
    captions = ["blue: seen, red: hidden"]
    for complete_frame in methods.values():
        for n in range(1, number + 1):
            frame = complete_frame(subject.vertices[n], masks[n])
        values = vertex_error(subject, number, frame)
        nmsve = dynmesh.metrics.nmsve(faces, truth, frame) / subject.diagonal
        surfaces.append(figures.render(faces, frame, view))
        errors.append(figures.render(faces, frame, view, values=values, limit=ERRORS.limit))
        captions.append(nmsve_caption(float(nmsve)))
    draw_sheet(
        surfaces + errors,
        ["original", *methods],
        [f"frame {number}", "error"],
        folder,
        "hidden_side",
        ERRORS,
        [""] * len(surfaces) + captions,
    )
