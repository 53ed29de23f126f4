"""Prints how far the error of method detail depends on each of its constants, as a table.

    python -m benchmarks.sensitivity [FILE ...]

FILE is a sequence; without any, the built-in walker and ocean are taken, 60 frames of each. Every
constant is halved and doubled, one at a time. Shown is the mean NMSVE over four losses (10 %, 30 %
and 70 % of the vertices known at random, and what one camera sees), each relative to that with the
constants as they are. The compiled part is built by script/bench.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

import dynmesh
from dynmesh import degrade
from dynmesh.draw.heatmap import likely_up
from dynmesh.sequence import Mask
from dynmesh.study.measure import Subject
from dynmesh.study.plan import scenario_masks

from .markdown import Line, table
from .subjects import CppSubject

CONSTANTS = (
    "rounds",
    "caution - 1",
    "caution_of_change - 1",
    "least_explained",
    "averagings",
    "pull",
    "least_blend",
    "largest_blend",
    "newest",
    "least_area",
)
FACTORS = (0.5, 2.0)
FRAMES = 60
SHARES = (0.1, 0.3, 0.7)


def subjects(files: list[Path]) -> Iterator[Subject]:
    """What is completed."""
    if not files:
        yield Subject.of("walker", dynmesh.synth.walker(), "z", 0, FRAMES)
        yield Subject.of("ocean", dynmesh.synth.ocean(FRAMES), "z", 0, FRAMES)
    for file in files:
        sequence = dynmesh.read(file)
        up = likely_up(sequence.vertices[0], sequence.up_axis)
        yield Subject.of(file.stem, sequence, up, 0, FRAMES)


def losses(subject: Subject) -> list[Mask]:
    """(n, k) each."""
    shape = subject.n_frames, subject.n_vertices
    masks = [np.stack(list(degrade.random_known(*shape, share, seed=0))) for share in SHARES]
    return [*masks, np.stack(list(scenario_masks("camera", subject, 0)))]


def errors(subject: Subject, masks: list[Mask], varied: tuple[str, float]) -> list[float]:
    """The mean NMSVE with each loss."""
    frames = np.ascontiguousarray(subject.vertices, np.float32)
    faces = np.ascontiguousarray(subject.faces, np.int32)
    means = []
    for mask in masks:
        completer = CppSubject(faces, frames[0], varied=varied)
        sums = 0.0
        for number in range(1, len(frames)):
            completer.push(frames, np.ascontiguousarray(mask), np.array([number]))
            sums += float(dynmesh.metrics.nmsve(faces, frames[number], completer.completed))
        means.append(sums / (len(frames) - 1))
    return means


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("files", type=Path, nargs="*")
    parser.add_argument("--constants", nargs="+", default=CONSTANTS, help="these alone")
    arguments = parser.parse_args()
    console = Console(stderr=True)
    rows: dict[str, list[str]] = {name: [] for name in arguments.constants}
    head = ["constant"]
    for subject in subjects(arguments.files):
        masks = losses(subject)
        as_they_are = np.array(errors(subject, masks, ("pull", 1.0)))
        for name in track(rows, subject.name, console=console):
            for factor in FACTORS:
                changed = np.array(errors(subject, masks, (name, factor)))
                rows[name].append(f"{np.mean(changed / as_they_are):.3f}")
        head += [f"{subject.name}, halved", f"{subject.name}, doubled"]
    lines: list[Line] = [tuple(head), *((f"`{name}`", *cells) for name, cells in rows.items())]
    print(table(lines))


if __name__ == "__main__":
    main()
