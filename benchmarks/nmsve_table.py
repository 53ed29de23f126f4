"""Prints the error of both readings of the paper's weights, and of method detail, as a table.

    python benchmarks/nmsve_table.py FOLDER [NAME ...]

FOLDER holds sequences as .npz. Each is scaled to a unit bounding-box diagonal of its first frame
and completed from random vertices, picked anew in each of its first 100 frames; shown is the mean
of NMSVE times 10 000.
"""

import argparse
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

import dynmesh
from dynmesh.evaluation import bounding_box_diagonal
from dynmesh.streaming import Settings

SHARES = (0.1, 0.3, 0.5, 0.7)
FRAMES = 100


READINGS: tuple[Settings, ...] = ({}, {"revisit": False}, {"method": "detail"})


def mean_nmsve(sequence: dynmesh.Sequence, share: float, seed: int, settings: Settings) -> float:
    """The mean over the frames after the first, in bounding-box diagonals."""
    truth = sequence.vertices[:FRAMES].astype(np.float64)
    truth = truth / bounding_box_diagonal(truth[0])
    masks = dynmesh.degrade.random_known(len(truth), truth.shape[1], share, seed=seed)
    completed = np.stack(list(dynmesh.complete(sequence.faces, truth, masks, **settings)))
    return float(dynmesh.metrics.nmsve(sequence.faces, truth[1:], completed[1:]).mean())


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description="The error of both readings of the weights.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", default=["crane", "horse_gallop"])
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    rows = [(name, share) for name in arguments.names for share in SHARES]
    lines = ["| data | known | re-estimated | once only | detail |", "|---|---|---|---|---|"]
    for name, share in track(rows, console=Console(stderr=True)):
        sequence = dynmesh.read(arguments.folder / f"{name}.npz")
        errors = [1e4 * mean_nmsve(sequence, share, arguments.seed, s) for s in READINGS]
        cells = " | ".join(f"{error:.3g}" for error in errors)
        lines.append(f"| {name} | {share:.0%} | {cells} |")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
