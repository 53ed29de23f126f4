"""Prints what learning on the way changes in the error of method detail, as tables.

    python -m benchmarks.learning_table FOLDER [NAME ...]
    python -m benchmarks.learning_table FOLDER NAME --cycles 10

FOLDER contains sequences in files NAME.npz, of which the first 100 frames are completed. With
--cycles, each sequence is played several times in a row, seen by one camera that circles it, and
every cycle has a row.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from dynmesh import Completer, metrics
from dynmesh.sequence import Mask
from dynmesh.study.losses import losses
from dynmesh.study.subjects import Subject, from_file
from dynmesh.study.tables import Line, markdown, nmsve_cell

Floats = NDArray[np.float64]

MOST_FRAMES = 100
"""Of a sequence that is completed once."""


def run(subject: Subject, masks: list[Mask], learn: bool) -> tuple[Floats, float]:
    """Return the NMSVE of every frame in diagonals, and the median seconds of a frame."""
    completer = Completer(subject.faces, subject.vertices[0], method="detail", learn=learn)
    nmsve, seconds = [], []
    for points, known in zip(subject.vertices[1:], masks[1:], strict=True):
        completed = completer.push(points, known)
        nmsve.append(metrics.nmsve(subject.faces, points[None], completed[None])[0])
        seconds.append(completer.report.seconds)
    return np.array(nmsve) / subject.diagonal, float(np.median(seconds))


def lines(subject: Subject, cycles: int) -> list[Line]:
    """Return a row for each loss, or for each cycle."""
    n_frames = subject.n_frames
    if cycles > 1:
        masks_by_loss = losses(subject.repeated(cycles), shares=(), scenarios=("camera",))
    else:
        masks_by_loss = losses(subject, shares=(0.1, 0.3))
    made: list[Line] = []
    for loss, masks in track(masks_by_loss.items(), subject.name, console=Console(stderr=True)):
        played = subject.repeated(cycles)
        plain, plain_seconds = run(played, masks, learn=False)
        learned, seconds = run(played, masks, learn=True)
        for cycle in range(cycles):
            frames = slice(max(cycle * n_frames - 1, 0), (cycle + 1) * n_frames - 1)
            error, of_plain = learned[frames].mean(), plain[frames].mean()
            made.append(
                (
                    subject.name,
                    loss,
                    str(cycle + 1),
                    nmsve_cell(float(of_plain)),
                    nmsve_cell(float(error)),
                    f"{error / of_plain:.2f}",
                    f"{seconds / plain_seconds:.2f}",
                )
            )
    return made


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", help="the sequences; the default is all of them")
    parser.add_argument("--cycles", type=int, default=1, help="how often a sequence is played")
    arguments = parser.parse_args()
    names = arguments.names or sorted(path.stem for path in arguments.folder.glob("*.npz"))
    made: list[Line] = [
        ("sequence", "known", "cycle", "detail, x 1e4", "learned, x 1e4", "learned / detail",
         "time / detail"),
    ]  # fmt: skip
    for name in names:
        subject = from_file(arguments.folder / f"{name}.npz")
        if arguments.cycles == 1:
            subject = replace(subject, vertices=subject.vertices[:MOST_FRAMES])
        made += lines(subject, arguments.cycles)
    print(markdown(made))


if __name__ == "__main__":
    main()
