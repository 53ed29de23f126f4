"""Prints what a rehearsal changes in the error of method detail, as a table.

    python -m benchmarks.rehearsal_table FOLDER [NAME ...]
    python -m benchmarks.rehearsal_table --learning

FOLDER contains sequences in files NAME.npz. The rehearsal is the first half of each, at most 50
frames of it, evenly; vertices are lost in the second half, of which at most the first 50 frames are
completed. The last rows show rehearsals that are of no use: noise, and moves of other vertices.
With --learning, it prints instead how long completers take to learn 75 frames of an ocean.
"""

import argparse
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from dynmesh import Completer, metrics, synth
from dynmesh.sequence import Mask, Positions
from dynmesh.study.losses import losses
from dynmesh.study.measure import run
from dynmesh.study.methods import DETAIL
from dynmesh.study.rivals import BIHARMONIC
from dynmesh.study.subjects import Subject, from_file
from dynmesh.study.tables import Line, markdown, nmsve_cell, number

MOST_FRAMES = 50
"""Of the rehearsal, and of the frames that are completed."""


def halves(subject: Subject) -> tuple[Positions, Subject]:
    """Return the rehearsal and the frames that are completed."""
    half = subject.n_frames // 2
    take = subject.vertices[np.unique(np.linspace(0, half - 1, MOST_FRAMES).astype(int))]
    return take, replace(subject, vertices=subject.vertices[half : half + MOST_FRAMES])


def useless(take: Positions, seed: int = 0) -> Iterator[tuple[str, Positions]]:
    """Yield rehearsals that say nothing about the subject."""
    rng = np.random.default_rng(seed)
    still = np.broadcast_to(take[0], take.shape)
    spread = np.abs(take - take[0]).mean()
    yield "noise", (still + spread * rng.normal(size=take.shape)).astype(take.dtype)
    order = rng.permutation(len(take[0]))
    yield "moves of other vertices", still + (take - take[0])[:, order]


def error(subject: Subject, masks: list[Mask], take: Positions) -> tuple[float, float, float]:
    """Return the mean NMSVE in diagonals with this rehearsal, the trust and the median seconds."""
    completer = Completer(subject.faces, subject.vertices[0], method="detail", rehearsal=take)
    completed, trust, seconds = [], [], []
    for points, known in zip(subject.vertices[1:], masks[1:], strict=True):
        completed.append(completer.push(points, known))
        trust.append(completer.report.trust)
        seconds.append(completer.report.seconds)
    nmsve = metrics.nmsve(subject.faces, subject.vertices[1:], np.stack(completed))
    return float(nmsve.mean()) / subject.diagonal, float(np.mean(trust)), float(np.median(seconds))


def line(name: str, loss: str, subject: Subject, masks: list[Mask], take: Positions) -> Line:
    """Return a row of the table."""
    detail, biharmonic = (run(subject, method, masks) for method in (DETAIL, BIHARMONIC))
    plain = float(detail.nmsve.mean())
    rehearsed, trust, seconds = error(subject, masks, take)
    return (
        name,
        loss,
        number(float(biharmonic.nmsve.mean()) / plain),
        nmsve_cell(plain),
        nmsve_cell(rehearsed),
        f"{rehearsed / plain:.2f}",
        f"{trust:.2f}",
        f"{seconds / np.median(detail.seconds):.2f}",
    )


def learning() -> list[Line]:
    """Return the processor time that completers of meshes of two sizes take to learn."""
    lines: list[Line] = [("vertices", "without a rehearsal, s", "with 75 frames, s")]
    for grid in (100, 316):
        ocean = synth.ocean(75, grid=grid)
        seconds = []
        for rehearsal in (None, ocean.vertices):
            begun = time.thread_time()
            Completer(ocean.faces, ocean.vertices[0], method="detail", rehearsal=rehearsal)
            seconds.append(f"{time.thread_time() - begun:.2f}")
        lines.append((str(grid * grid), *seconds))
    return lines


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--learning", action="store_true", help="measure the time of learning")
    parser.add_argument("names", nargs="*", help="the sequences; the default is all of them")
    arguments = parser.parse_args()
    if arguments.learning:
        print(markdown(learning()))
        return
    if arguments.folder is None:
        parser.error("a folder of sequences is needed")
    names = arguments.names or sorted(path.stem for path in arguments.folder.glob("*.npz"))
    lines: list[Line] = [
        ("sequence", "known", "libigl / detail", "detail, x 1e4", "rehearsed, x 1e4",
         "rehearsed / detail", "trust", "time / detail"),
    ]  # fmt: skip
    for name in names:
        take, subject = halves(from_file(arguments.folder / f"{name}.npz"))
        masks_by_loss = losses(subject, shares=(0.1, 0.3))
        for loss, masks in track(masks_by_loss.items(), name, console=Console(stderr=True)):
            lines.append(line(name, loss, subject, masks, take))
        for what, other in useless(take):
            loss, masks = next(iter(masks_by_loss.items()))
            lines.append(line(f"{name}, rehearsed by {what}", loss, subject, masks, other))
    print(markdown(lines))


if __name__ == "__main__":
    main()
