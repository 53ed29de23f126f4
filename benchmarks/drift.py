"""Prints the error of a sequence that is played again and again, as a table.

    python -m benchmarks.drift [FILE] [--known SHARE ...] [--cycles N]

FILE begins anew after its last frame. Without it, the built-in walker goes to and fro, in 44 frames
each way. Vertices are known at random; shown is the mean of NMSVE times 10 000, in bounding-box
diagonals of frame 0, over each cycle, its first frame left out.
"""

import argparse
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

import dynmesh
from dynmesh.settings import Settings

from .cycles import error_of_cycles
from .markdown import Line, table

WAYS: dict[str, Settings] = {
    "motion": {},
    "motion, 10 extra iterations": {"extra_iterations": 10},
    "detail": {"method": "detail"},
}


def walker_to_and_fro() -> dynmesh.Sequence:
    """One cycle, without a jump at its end."""
    walker = dynmesh.synth.walker(44)
    vertices = np.concatenate([walker.vertices, walker.vertices[-2:0:-1]])
    return dynmesh.Sequence(vertices, walker.faces)


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description="The error of a sequence played for long.")
    parser.add_argument("file", type=Path, nargs="?")
    parser.add_argument("--known", type=float, nargs="+", default=[0.1])
    parser.add_argument("--cycles", type=int, default=3)
    arguments = parser.parse_args()
    sequence = walker_to_and_fro() if arguments.file is None else dynmesh.read(arguments.file)
    numbers = [f"cycle {n + 1}" for n in range(arguments.cycles)]
    lines: list[Line] = [("known", "method", *numbers)]
    rows = [(share, way) for share in arguments.known for way in WAYS]
    for share, way in track(rows, console=Console(stderr=True)):
        errors = error_of_cycles(sequence, share, WAYS[way], cycles=arguments.cycles)
        lines.append((f"{share:.0%}", way, *(f"{1e4 * error:.3g}" for error in errors)))
    print(table(lines))


if __name__ == "__main__":
    main()
