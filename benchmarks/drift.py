"""Prints the error of a sequence that is played again and again, as a table.

    python benchmarks/drift.py [FILE] [--known SHARE ...] [--cycles N]

FILE begins anew after its last frame. Without it, the built-in walker goes to and fro, in 44 frames
each way. Vertices are known at random; shown is the mean of NMSVE times 10 000, in bounding-box
diagonals of frame 0, over each cycle, its first frame left out.
"""

import argparse
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

import dynmesh
from dynmesh.evaluation import bounding_box_diagonal
from dynmesh.streaming import Settings

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


def error_of_cycles(
    sequence: dynmesh.Sequence, share: float, cycles: int, settings: Settings
) -> Iterator[float]:
    """The mean NMSVE of each, in bounding-box diagonals."""
    truth = sequence.vertices.astype(np.float64)
    truth = truth / bounding_box_diagonal(truth[0])
    n_frames, n_vertices, _ = truth.shape
    masks = dynmesh.degrade.random_known(cycles * n_frames, n_vertices, share)
    frames = (frame for _ in range(cycles) for frame in truth)
    completed = dynmesh.complete(sequence.faces, frames, masks, **settings)
    for _ in range(cycles):
        cycle = np.stack(list(islice(completed, n_frames)))
        yield float(dynmesh.metrics.nmsve(sequence.faces, truth[1:], cycle[1:]).mean())


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description="The error of a sequence played for long.")
    parser.add_argument("file", type=Path, nargs="?")
    parser.add_argument("--known", type=float, nargs="+", default=[0.1])
    parser.add_argument("--cycles", type=int, default=3)
    arguments = parser.parse_args()
    sequence = walker_to_and_fro() if arguments.file is None else dynmesh.read(arguments.file)
    numbers = [f"cycle {n + 1}" for n in range(arguments.cycles)]
    lines = ["| known | method | " + " | ".join(numbers) + " |", "|---" * (2 + len(numbers)) + "|"]
    rows = [(share, way) for share in arguments.known for way in WAYS]
    for share, way in track(rows, console=Console(stderr=True)):
        errors = error_of_cycles(sequence, share, arguments.cycles, WAYS[way])
        cells = " | ".join(f"{1e4 * error:.3g}" for error in errors)
        lines.append(f"| {share:.0%} | {way} | {cells} |")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
