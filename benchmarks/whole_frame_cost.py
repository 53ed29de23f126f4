"""Prints how long a whole frame takes to be put together, and how much memory.

    python -m benchmarks.whole_frame_cost [--sides N ...] [--frames N]

The sequences are oceans of several sizes, of which 30 % of the vertices are known in each frame.
The time is compared with that of completing the same frames once in the same process.
"""

import resource
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import dynmesh
from dynmesh import degrade, synth
from dynmesh.study.tables import Line

from .harness import Table, parser, show


def line(side: int, n_frames: int) -> Line:
    """The row of a size, measured in a process of its own."""
    sequence = synth.ocean(n_frames, grid=side)
    known = np.stack(list(degrade.random_known(n_frames + 1, side**2, 0.3))[1:])  # 0 is whole
    began = time.perf_counter()
    completer = dynmesh.Completer(sequence.faces, sequence.vertices[0])
    made = np.empty_like(sequence.vertices[0])
    for points, mask in zip(sequence.vertices, known, strict=True):
        completer.push(points, mask, out=made)
    once = time.perf_counter() - began
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began = time.perf_counter()
    dynmesh.whole_frame(sequence.faces, sequence.vertices, known)
    seconds = time.perf_counter() - began
    more = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    given = sequence.vertices.nbytes / 2**20
    return (
        str(side**2), str(n_frames), f"{seconds / once:.0f}", f"{more:.0f}", f"{given:.0f}",
    )  # fmt: skip


def main() -> None:
    """Measure, and print the table."""
    asked = parser(__doc__, folder=False)
    asked.add_argument(
        "--sides", type=int, nargs="+", default=(50, 100, 200), help="vertices along a side"
    )
    asked.add_argument("--frames", type=int, default=60, help="frames of each sequence [60]")
    arguments = asked.parse_args()
    head = ("vertices", "frames", "times as long as completion", "more memory, MiB",
            "of the frames, MiB")  # fmt: skip
    rows = []
    for side in arguments.sides:
        with ProcessPoolExecutor(1) as apart:
            rows.append(apart.submit(line, side, arguments.frames).result())
    show(arguments, Table("whole-frame-cost", [head, *rows]))


if __name__ == "__main__":
    main()
