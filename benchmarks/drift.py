"""Prints the error of a sequence that is played several times in a row, as a table.

    python -m benchmarks.drift [FOLDER NAME] [--known SHARE ...] [--cycles N]

The sequence begins again after its last frame. The default is the built-in walker, played forwards
and backwards, with 44 frames in each direction. Vertices are known at random. The table shows the
mean NMSVE times 10 000, in bounding-box diagonals of frame 0, of each cycle without its first
frame.
"""

import numpy as np

import dynmesh
from dynmesh.study.losses import random_masks
from dynmesh.study.measure import run
from dynmesh.study.methods import DETAIL, MOTION, dynmesh_method
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import Line, nmsve_cell

from .harness import Table, parser, progress, sequences, show

EXTRA = dynmesh_method(
    "motion_extra",
    "motion, 10 extra iterations",
    MOTION.colour,
    "--",
    method="motion",
    extra_iterations=10,
)
METHODS = {"motion": MOTION, EXTRA.label: EXTRA, "detail": DETAIL}


def walker_forwards_and_backwards() -> Subject:
    """Return one cycle that begins and ends without a jump."""
    walker = dynmesh.synth.walker(44)
    vertices = np.concatenate([walker.vertices, walker.vertices[-2:0:-1]])
    return Subject("walker", vertices, walker.faces, "z", 0)


def main() -> None:
    """Measure, and print the table."""
    made = parser(__doc__, known=[0.1])
    made.add_argument("--cycles", type=int, default=3)
    arguments = made.parse_args()
    built_in = arguments.folder is None
    (once,) = [walker_forwards_and_backwards()] if built_in else sequences(arguments)
    subject = once.scaled().repeated(arguments.cycles)
    lines: list[Line] = [
        ("known", "method", *(f"cycle {n + 1}" for n in range(arguments.cycles))),
    ]
    for share in arguments.known:
        for name, method in progress(METHODS.items(), f"{share:.0%}"):
            nmsve = run(subject, method, random_masks(subject, share)).nmsve
            # Frame 0 has no error. Without the first frame of each, all cycles have equal length.
            cycles = np.concatenate([[0.0], nmsve]).reshape(arguments.cycles, -1)[:, 1:]
            lines.append((f"{share:.0%}", name, *map(nmsve_cell, cycles.mean(axis=1))))
    show(arguments, Table("drift" if built_in else f"drift-{subject.name}", lines))


if __name__ == "__main__":
    main()
