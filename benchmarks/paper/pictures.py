"""The figures of the paper that show meshes: 8, 10 and 11."""

from pathlib import Path

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm

from dynmesh.draw import figures
from dynmesh.draw.figures import HEATMAP_RANGE, KNOWN_COLOUR, MISSING_COLOUR

from ..methods import LIA, LSM, MOTION
from ..pictures import HEATMAP, Panel, sheet, surface, view_of
from ..runner import vertex_error
from ..style import nmsve_caption
from ..subjects import PAPER_SHARES, percent, random_masks
from .study import FIGURE8, FIGURE10, FIGURE11, Study

_TITLES = [f"{percent(share)} known" for share in PAPER_SHARES]


def draw(study: Study, folder: Path) -> None:
    """Draw all pictures of one sequence."""
    figure8(study, folder)
    figure10(study, folder)
    figure11(study, folder)


def figure8(study: Study, folder: Path) -> None:
    """Draw known and missing vertices, and heatmaps of the error, at four shares.

    The errors are on one scale, which ends at the 99th percentile of the worst share.
    """
    subject = study.subject
    number = subject.frame_at(FIGURE8)
    view, truth = view_of(subject, [number]), subject.vertices[number]
    runs = [study.at(MOTION, share) for share in PAPER_SHARES]
    errors = [vertex_error(subject, number, run.frames[number]) for run in runs]
    limit = 100 * np.percentile(errors, 99, axis=1).max() or 1.0
    heat = ScalarMappable(LogNorm(HEATMAP_RANGE * limit, limit, clip=True), HEATMAP)
    above, below = [], []
    for share, title, run, error in zip(PAPER_SHARES, _TITLES, runs, errors, strict=True):
        known = [*random_masks(subject, share)][number].astype(float)
        dots = figures.render(subject.faces, truth, view, known, (MISSING_COLOUR, KNOWN_COLOUR))
        above.append(Panel([dots], title))
        heatmap = surface(subject, run.frames[number], view, error, heat)
        below.append(Panel([heatmap], caption=nmsve_caption(run.nmsve[number - 1])))
    heading = "known (blue) and missing (red); error after completion"
    path = folder / f"figure8_{subject.name}.webp"
    sheet([above, below], path, heat, f"{subject.name}, frame {number}: {heading}")


def figure10(study: Study, folder: Path) -> None:
    """Draw the original, motion, LIA and LSM side by side."""
    subject = study.subject
    numbers = [subject.frame_at(place) for _, place in FIGURE10]
    widest = view_of(subject, numbers)
    rows: list[list[Panel]] = []
    for number, (share, _) in zip(numbers, FIGURE10, strict=True):
        truth = subject.vertices[number]
        view = widest.around(truth)
        row = [
            Panel(
                [surface(subject, truth, view)],
                "original",
                f"frame {number}, {percent(share)} known",
            )
        ]
        for method in (MOTION, LIA, LSM):
            run = study.at(method, share)
            image = surface(subject, run.frames[number], view)
            row.append(Panel([image], method.label, nmsve_caption(run.nmsve[number - 1])))
        rows.append(row if not rows else [panel._replace(title="") for panel in row])
    sheet(rows, folder / f"figure10_{subject.name}.webp", heading=subject.name)


def figure11(study: Study, folder: Path) -> None:
    """Draw reconstructions at four shares beside the original."""
    subject = study.subject
    number = subject.frame_at(FIGURE11)
    view = view_of(subject, [number])
    row = [Panel([surface(subject, subject.vertices[number], view)], "original")]
    for share, title in zip(PAPER_SHARES, _TITLES, strict=True):
        run = study.at(MOTION, share)
        image = surface(subject, run.frames[number], view)
        row.append(Panel([image], title, nmsve_caption(run.nmsve[number - 1])))
    heading = f"{subject.name}, frame {number}, completed by motion"
    sheet([row], folder / f"figure11_{subject.name}.webp", heading=heading)
