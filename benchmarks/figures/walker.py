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
from dynmesh.topology import mean_edge_of, vertex_normals

from .. import rivals, tracking
from ..harness import nmsve_cell, progress
from ..methods import BIHARMONIC, DETAIL, MOTION, Method, trained
from ..pictures import EDGES, ERRORS, Panel, sheet, surface, view_of
from ..runner import run, vertex_error
from ..subjects import Subject, scenario_masks

_OUTSIDE, _INSIDE, _DOTS = "#5b9bd0", "#2c4964", "#2f78b7"  # what was observed
_CAMERAS = 4
_OTHER = 12  # frames between two that are put together


def readme(subject: Subject, folder: Path) -> None:
    """The moving picture of README, whose letters can be read on a phone."""
    methods = {"dynmesh": DETAIL, "libigl": BIHARMONIC}
    panels, errors = completed(subject, range(1, subject.n_frames, 3), methods, "readme")
    seen, *others = (panel._replace(caption="") for panel in panels)
    truth, ours, *rivals = others
    if rivals:
        times = errors["libigl"] / errors["dynmesh"]
        ours = ours._replace(caption=f"{times:.0f} times\nsmaller error")
    path = folder / "readme" / "walker.webp"
    sheet([[truth, seen._replace(title="seen"), ours, *rivals]], path, font=24)


def hidden_side(subject: Subject, folder: Path) -> None:
    """What the methods make of the side that the camera does not see."""
    methods = {"motion": MOTION, "detail": DETAIL, "libigl": BIHARMONIC}
    numbers = [subject.frame_at(0.6)]
    completions(subject, numbers, methods, folder / "method" / "hidden_side.webp")


def training(subject: Subject, folder: Path, frames: Positions) -> None:
    """The same frame without and with training frames."""
    methods = {"detail": DETAIL, "detail, trained": trained(frames)}
    numbers = [subject.frame_at(0.546)]
    completions(subject, numbers, methods, folder / "training" / "walker.webp")


def completions(
    subject: Subject, numbers: Sequence[int], methods: Mapping[str, Method], path: Path
) -> None:
    """Complete what a camera sees of a whole sequence, and draw some of its frames."""
    panels, _ = completed(subject, numbers, methods, path.name)
    sheet([panels], path, ERRORS, font=20)


def completed(
    figure: Subject, numbers: Sequence[int], methods: Mapping[str, Method], name: str
) -> tuple[list[Panel], dict[str, float]]:
    """Return pictures of what was observed, the truth and completions, and the errors of these."""
    subject = replace(figure, azimuth=200)
    masks = scenario_masks("camera", subject)
    widest, truth = view_of(subject, numbers), subject.vertices
    views = {n: widest.around(truth[n]) for n in numbers}
    seen = [observed(subject, truth[n], masks[n], view) for n, view in views.items()]
    panels = [
        Panel(seen, "observed", f"{100 * np.mean(masks[1:]):.0f} % of the vertices"),
        Panel([surface(subject, truth[n], view) for n, view in views.items()], "true"),
    ]
    errors = {}
    for title, method in progress(methods.items(), name):
        try:
            found = run(subject, method, masks, keep=numbers)
        except ImportError as error:
            print(f"{name}: {title} is left out: {error}", file=sys.stderr)
            continue
        images = [
            surface(subject, frame, views[n], vertex_error(subject, n, frame))
            for n, frame in found.frames.items()
        ]
        errors[title] = found.error
        panels.append(Panel(images, title, f"NMSVE x 1e4: {nmsve_cell(found.error)}"))
    return panels, errors


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
    sheet([panels], folder / "method" / "whole_frame.webp", ERRORS)


def track(subject: Subject, folder: Path) -> None:
    """Track points without correspondences, and draw the last frame beside others and the truth.

    The scans and the errors are those of docs/tables/rivals-tracking.csv.
    """
    around = dynmesh.losses.orbit(subject.box, _CAMERAS, up=subject.up_vector)(0)
    scans = list(
        dynmesh.losses.scan_points(subject.vertices, subject.faces, around, points=rivals.POINTS)
    )
    shown = len(scans) - 1
    view, scan, truth = view_of(subject, [shown]), scans[-1], subject.vertices[shown]
    ahead = scan.points[scan.normals @ view.axes[2] > 0]
    dots = np.ones(len(ahead), np.bool_)
    points = figures.render(subject.faces[:0], ahead, view, np.zeros(len(ahead)), (_DOTS,), dots)
    panels = [
        Panel([points], "scan", f"{len(scan.points)} points,\n{_CAMERAS} cameras"),
        Panel([surface(subject, truth, view)], "true"),
    ]
    edge = mean_edge_of(subject.vertices[0], subject.faces)
    register = tracking.methods(subject)
    named = {"dynmesh": "dynmesh", "nricp_amberg (trimesh)": "non-rigid ICP"}
    for label, title in named.items():
        frame, errors = subject.vertices[0], []
        for n, later in progress(enumerate(scans[1:], 1), title):
            frame = register[label](frame, later)
            errors.append(np.linalg.norm(frame - subject.vertices[n], axis=1) / edge)
        caption = f"off by\n{np.mean(errors):.2g} edges"
        image = surface(subject, frame, view, errors[-1] / 100, EDGES)
        panels.append(Panel([image], title, caption))
    sheet([panels], folder / "track" / "hand.webp", EDGES, unit="mean edges", font=20)
