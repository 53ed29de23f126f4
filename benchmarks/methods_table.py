"""Prints the error and the time of detail, motion and baselines on recordings, as two tables.

    python -m benchmarks.methods_table FOLDER [NAME ...]

FOLDER contains sequences in files NAME.npz; NAME:FRAMES takes the first FRAMES of one. Vertices are
lost at random, at four shares of known vertices, or hidden from a camera that circles the scene.
The error is NMSVE, averaged over the frames after frame 0. The time is the median, in one thread.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from dynmesh.sequence import Mask
from dynmesh.study.baselines import ARAP_FROM_PREVIOUS, BASELINES, BIHARMONIC
from dynmesh.study.completion import Method
from dynmesh.study.losses import losses
from dynmesh.study.measure import run
from dynmesh.study.methods import DETAIL, LIA_ON_MOTION, MOTION
from dynmesh.study.subjects import Subject, from_file
from dynmesh.study.tables import (
    ABSENT,
    Line,
    bold_below_one,
    markdown,
    milliseconds,
    nmsve_cell,
)

OTHERS = (LIA_ON_MOTION, *BASELINES, ARAP_FROM_PREVIOUS)


@dataclass(frozen=True)
class Outcome:
    """Mean NMSVE in bounding-box diagonals and median seconds; NaN if the method failed."""

    error: float
    seconds: float


def measure(subject: Subject, method: Method, masks: list[Mask]) -> Outcome:
    """Measure one method with one loss."""
    try:
        measured = run(subject, method, masks)
    except RuntimeError:
        return Outcome(float("nan"), float("nan"))
    return Outcome(float(measured.nmsve.mean()), float(np.median(measured.seconds)))


def read(folder: Path, name: str) -> Subject:
    """Read the sequence NAME or NAME:FRAMES."""
    stem, _, frames = name.partition(":")
    return from_file(folder / f"{stem}.npz", int(frames) if frames else None)


def error_cells(outcomes: dict[Method, Outcome]) -> Line:
    """Return the error of motion and the others relative to it, in bold if better than detail."""
    motion, detail = outcomes[MOTION].error, outcomes[DETAIL].error
    cells = [nmsve_cell(motion), _relative(detail, motion)]
    for baseline in OTHERS:
        error = outcomes[baseline].error
        cell = _relative(error, motion)
        cells.append(f"**{cell}**" if error < detail else cell)
    return tuple(cells)


def _relative(error: float, reference: float) -> str:
    if np.isnan(error):
        return "fails"
    return f"{error / reference:.3f}" if reference > 0 else ABSENT


def time_cells(outcomes: dict[Method, Outcome]) -> Line:
    """Return milliseconds, and how many times as long as detail the biharmonic takes."""
    times = [outcomes[method].seconds for method in (MOTION, DETAIL, *OTHERS)]
    ratio = outcomes[BIHARMONIC].seconds / outcomes[DETAIL].seconds
    return (*map(milliseconds, times), bold_below_one(ratio))


def main() -> None:
    """Measure, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", help="the sequences; the default is all of them")
    arguments = parser.parse_args()
    names = arguments.names or sorted(path.stem for path in arguments.folder.glob("*.npz"))
    columns = ["detail", *(method.label for method in OTHERS)]
    errors: list[Line] = [("NMSVE", "known", "motion, x 1e4", *columns)]
    times: list[Line] = [("ms a frame", "known", "motion", *columns, "biharmonic, times detail")]
    for name in names:
        subject = read(arguments.folder, name)
        title = f"{subject.name}, {subject.n_frames} frames"
        masks_by_loss = losses(subject, scenarios=("camera",))
        for loss, masks in track(masks_by_loss.items(), title, console=Console(stderr=True)):
            outcomes = {m: measure(subject, m, masks) for m in (MOTION, DETAIL, *OTHERS)}
            errors.append((title, loss, *error_cells(outcomes)))
            times.append((title, loss, *time_cells(outcomes)))
    print(f"{markdown(errors)}\n\n{markdown(times)}")


if __name__ == "__main__":
    main()
