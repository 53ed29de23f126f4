"""The pictures of README and of three pages of docs, of a figure that walks and does a handstand.

Each function draws that of a page; methods of libraries that are not installed are left out.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import dynmesh
from dynmesh._arrays import Mask, Positions
from dynmesh.draw import figures
from dynmesh.draw.figures import View
from dynmesh.topology import vertex_normals

from .. import tracking
from ..harness import nmsve_cell, progress
from ..methods import BIHARMONIC, DETAIL, MOTION, Method, trained
from ..pictures import ERRORS, Panel, sheet, surface, view_of
from ..runner import run, vertex_error
from ..subjects import Subject, scenario_masks

_OUTSIDE, _INSIDE, _DOTS = "#5b9bd0", "#2c4964", "#2f78b7"  # what was observed
_CAMERAS = 2
_OTHER = 12  # frames between two that are put together


def readme(subject: Subject, folder: Path) -> None:
    """The moving picture of README."""
    methods = {"dynmesh": DETAIL, "libigl": BIHARMONIC}
    numbers = range(1, subject.n_frames, 3)
    completions(subject, numbers, methods, folder / "readme" / "walker.webp", with_truth=False)


def hidden_side(subject: Subject, folder: Path) -> None:
    """What the methods make of the side that the camera does not see."""
    methods = {"motion": MOTION, "detail": DETAIL, "libigl": BIHARMONIC}
    numbers = [subject.frame_at(0.6)]
    completions(subject, numbers, methods, folder / "method" / "hidden_side.png")


def training(subject: Subject, folder: Path, frames: Positions) -> None:
    """The same frame without and with training frames."""
    methods = {"detail": DETAIL, "detail, trained": trained(frames)}
    numbers = [subject.frame_at(0.546)]
    completions(subject, numbers, methods, folder / "training" / "walker.png")


def completions(
    figure: Subject,
    numbers: Sequence[int],
    methods: Mapping[str, Method],
    path: Path,
    *,
    with_truth: bool = True,
) -> None:
    """Complete what a camera sees of a whole sequence, and draw some of its frames."""
    subject = replace(figure, azimuth=200)
    masks = scenario_masks("camera", subject)
    widest, truth = view_of(subject, numbers), subject.vertices
    views = {n: widest.around(truth[n]) for n in numbers}
    seen = [observed(subject, truth[n], masks[n], view) for n, view in views.items()]
    panels = [Panel(seen, "observed", f"{100 * np.mean(masks[1:]):.0f} % of the vertices")]
    if with_truth:
        panels.append(
            Panel([surface(subject, truth[n], view) for n, view in views.items()], "true")
        )
    for title, method in progress(methods.items(), path.name):
        try:
            found = run(subject, method, masks, keep=numbers)
        except ImportError as error:
            print(f"{path}: {title} is left out: {error}", file=sys.stderr)
            continue
        images = [
            surface(subject, frame, views[n], vertex_error(subject, n, frame))
            for n, frame in found.frames.items()
        ]
        panels.append(Panel(images, title, f"NMSVE x 1e4: {nmsve_cell(found.error)}"))
    sheet([panels], path, ERRORS)


def observed(subject: Subject, points: Positions, known: Mask, view: View) -> figures.Image:
    """Draw the triangles that were observed, dark from inside."""
    whole = known[subject.faces].all(axis=1)
    inside = vertex_normals(subject.faces, points.astype(np.float64)) @ view.axes[2] < 0
    colours = (_OUTSIDE, _INSIDE)
    return figures.render(subject.faces[whole], points, view, inside.astype(float), colours)


def whole_frame(figure: Subject, folder: Path) -> None:
    """Put a whole frame together, and draw what two frames saw, the result and its error."""
    shown = figure.frame_at(0.144)
    subject = replace(figure, vertices=figure.vertices[:50], azimuth=0)
    n, vertices = subject.n_frames, subject.vertices
    masks = dynmesh.losses.patch_known(subject.faces, n + 1, subject.n_vertices, 0.4, lifetime=10)
    known = np.array(list(masks))[1:]
    whole = dynmesh.whole_frames.whole_frame(subject.faces, vertices, known, frame=shown)
    view = view_of(subject, [shown])
    panels = []
    for number in (max(shown - _OTHER, 0), shown):
        around = view.around(vertices[number])
        image = observed(subject, vertices[number], known[number], around)
        share = f"{100 * known[number].mean():.0f} % of the vertices"
        panels.append(Panel([image], f"frame {number}", share))
    put_together = surface(
        subject, whole.positions, view, vertex_error(subject, shown, whole.positions)
    )
    panels += [
        Panel([put_together], f"frame {shown}, put together", f"from {n} frames; error in colour"),
        Panel([surface(subject, vertices[shown], view)], "truth"),
    ]
    sheet([panels], folder / "method" / "whole_frame.png", ERRORS)


def track(figure: Subject, folder: Path) -> None:
    """Track points without correspondences up to one frame, and draw it beside the truth."""
    shown = figure.frame_at(0.6)
    subject = replace(figure, vertices=figure.vertices[: shown + 1], azimuth=40)
    # The cameras circle the positions of all frames, so that no point leaves the pictures.
    cameras = dynmesh.losses.orbit(subject.box, _CAMERAS, up=subject.up_vector)
    scans = list(
        dynmesh.losses.scan_points(subject.vertices, subject.faces, cameras, outliers=0.01)
    )
    view, scan = view_of(subject, [shown]), scans[-1]
    ahead = scan.points[scan.normals @ view.axes[2] > 0]
    dots = np.ones(len(ahead), np.bool_)
    points = figures.render(subject.faces[:0], ahead, view, np.zeros(len(ahead)), (_DOTS,), dots)
    panels = [
        Panel([points], "scan", f"{len(scan.points)} points, {_CAMERAS} cameras"),
        Panel([surface(subject, subject.vertices[shown], view)], "true"),
    ]
    register = tracking.methods(subject)
    for label in ("dynmesh", "rigid ICP (trimesh)"):
        frame = subject.vertices[0]
        for later in progress(scans[1:], label):
            frame = register[label](frame, later)
        error = vertex_error(subject, shown, frame)
        caption = f"off by {100 * np.mean(error):.2f} % on average"
        panels.append(Panel([surface(subject, frame, view, error)], label, caption))
    sheet([panels], folder / "track" / "walker.png", ERRORS)
