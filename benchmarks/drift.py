"""Prints the error of a sequence that is played several times in a row, as a table.

    python -m benchmarks.drift [FILE] [--known SHARE ...] [--cycles N]

FILE begins again after its last frame. The default is the built-in walker, played forwards and
backwards, with 44 frames in each direction. Vertices are known at random. The table shows the mean
NMSVE times 10 000, in bounding-box diagonals of frame 0, of each cycle without its first frame.
"""

import argparse
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

import dynmesh
from dynmesh.study.losses import random_masks
from dynmesh.study.measure import run
from dynmesh.study.methods import DETAIL, MOTION, dynmesh_method
from dynmesh.study.subjects import Subject, from_file
from dynmesh.study.tables import Line, markdown, nmsve_cell

METHODS = {
    "motion": MOTION,
    "motion, 10 extra iterations": dynmesh_method(
        "motion_extra",
        "motion, 10 extra iterations",
        MOTION.colour,
        "--",
        method="motion",
        extra_iterations=10,
    ),
    "detail": DETAIL,
}


def walker_forwards_and_backwards() -> Subject:
    """Return one cycle that begins and ends without a jump."""
    walker = dynmesh.synth.walker(44)
    vertices = np.concatenate([walker.vertices, walker.vertices[-2:0:-1]])
    return Subject("walker", vertices, walker.faces, "z", 0)


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description="The error of a sequence played several times.")
    parser.add_argument("file", type=Path, nargs="?")
    parser.add_argument("--known", type=float, nargs="+", default=[0.1])
    parser.add_argument("--cycles", type=int, default=3)
    arguments = parser.parse_args()
    once = (
        from_file(arguments.file) if arguments.file is not None else walker_forwards_and_backwards()
    )
    subject = once.scaled().repeated(arguments.cycles)
    numbers = [f"cycle {n + 1}" for n in range(arguments.cycles)]
    lines: list[Line] = [("known", "method", *numbers)]
    rows = [(share, name) for share in arguments.known for name in METHODS]
    for share, name in track(rows, console=Console(stderr=True)):
        nmsve = run(subject, METHODS[name], random_masks(subject, share)).nmsve
        # Frame 0 has no error. Without the first frame of each cycle, all cycles have equal length.
        cycles = np.concatenate([[0.0], nmsve]).reshape(arguments.cycles, once.n_frames)[:, 1:]
        lines.append((f"{share:.0%}", name, *map(nmsve_cell, cycles.mean(axis=1))))
    print(markdown(lines))


if __name__ == "__main__":
    main()
