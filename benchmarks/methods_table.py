"""Prints how true and how fast method detail is beside motion and libigl, as two tables.

    python -m benchmarks.methods_table FOLDER [NAME ...]

FOLDER holds sequences as .npz; NAME:FRAMES takes the first FRAMES of one. Vertices are lost at
random, four shares of them known, or to a camera that circles the scene. Errors are NMSVE, mean
over the frames after the first; times are medians, in one thread.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

import dynmesh
from dynmesh import degrade
from dynmesh.draw.heatmap import likely_up
from dynmesh.sequence import Mask
from dynmesh.study.measure import Subject, run
from dynmesh.study.methods import (
    ARAP,
    ARAP_FROM_PREVIOUS,
    BIHARMONIC,
    DETAIL,
    LIA_ON_MOTION,
    MOTION,
    Method,
)
from dynmesh.study.plan import PAPER_SHARES, scenario_masks
from dynmesh.study.style import percent

from .markdown import ABSENT, Line, bold_below_one, milliseconds, number, table

RIVALS = {
    LIA_ON_MOTION: "LIA on motion",
    BIHARMONIC: "biharmonic on motion",
    ARAP: "ARAP from frame 0",
    ARAP_FROM_PREVIOUS: "ARAP from the previous frame",
}


@dataclass(frozen=True)
class Outcome:
    """Mean NMSVE in bounding-box diagonals, median seconds; NaN where the method gave up."""

    error: float
    seconds: float


def measure(subject: Subject, method: Method, masks: list[Mask]) -> Outcome:
    """One method with one loss."""
    try:
        measured = run(subject, method, masks)
    except RuntimeError:
        return Outcome(float("nan"), float("nan"))
    return Outcome(float(measured.nmsve.mean()), float(np.median(measured.seconds)))


def losses(subject: Subject) -> dict[str, list[Mask]]:
    """Known masks by name."""
    shape = subject.n_frames, subject.n_vertices
    masks = {percent(s): list(degrade.random_known(*shape, s, seed=0)) for s in PAPER_SHARES}
    return masks | {"camera": scenario_masks("camera", subject, 0)}


def subject_of(folder: Path, name: str) -> Subject:
    """NAME or NAME:FRAMES."""
    stem, _, frames = name.partition(":")
    sequence = dynmesh.read(folder / f"{stem}.npz")
    up = likely_up(sequence.vertices[0], sequence.up_axis)
    return Subject.of(stem, sequence, up, 0.0, int(frames) if frames else None)


def error_cells(outcomes: dict[Method, Outcome]) -> Line:
    """Motion's error times 10 000, and the others' relative to it: bold if better than detail."""
    motion, detail = outcomes[MOTION].error, outcomes[DETAIL].error
    cells = [number(1e4 * motion), _relative(detail, motion)]
    for rival in RIVALS:
        error = outcomes[rival].error
        cell = _relative(error, motion)
        cells.append(f"**{cell}**" if error < detail else cell)
    return tuple(cells)


def _relative(error: float, reference: float) -> str:
    if np.isnan(error):
        return "fails"
    return f"{error / reference:.3f}" if reference > 0 else ABSENT


def time_cells(outcomes: dict[Method, Outcome]) -> Line:
    """Milliseconds, and how many times as long as detail the biharmonic takes."""
    times = [outcomes[method].seconds for method in (MOTION, DETAIL, *RIVALS)]
    ratio = outcomes[BIHARMONIC].seconds / outcomes[DETAIL].seconds
    return (*map(milliseconds, times), bold_below_one(ratio))


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", help="all sequences, unless given")
    arguments = parser.parse_args()
    names = arguments.names or sorted(path.stem for path in arguments.folder.glob("*.npz"))
    columns = ["detail", *RIVALS.values()]
    errors: list[Line] = [("NMSVE", "known", "motion, x 1e4", *columns)]
    times: list[Line] = [("ms a frame", "known", "motion", *columns, "biharmonic, times detail")]
    for name in names:
        subject = subject_of(arguments.folder, name)
        title = f"{subject.name}, {subject.n_frames} frames"
        progress = track(losses(subject).items(), title, console=Console(stderr=True))
        for loss, masks in progress:
            outcomes = {m: measure(subject, m, masks) for m in (MOTION, DETAIL, *RIVALS)}
            errors.append((title, loss, *error_cells(outcomes)))
            times.append((title, loss, *time_cells(outcomes)))
    print(f"{table(errors)}\n\n{table(times)}")


if __name__ == "__main__":
    main()
