"""Prints the error of both readings of the paper's weights, and of method detail, as a table.

    python -m benchmarks.nmsve_table FOLDER [NAME ...]

FOLDER holds sequences as .npz. Each is scaled to a unit bounding-box diagonal of its first frame
and completed from random vertices, picked anew in each of its first 100 frames; shown is the mean
of NMSVE times 10 000.
"""

import argparse
from pathlib import Path

from rich.console import Console
from rich.progress import track

import dynmesh
from dynmesh.settings import Settings
from dynmesh.study.plan import PAPER_SHARES

from .cycles import error_of_cycles
from .markdown import Line, table

FRAMES = 100

READINGS: tuple[Settings, ...] = ({}, {"revisit": False}, {"method": "detail"})


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description="The error of both readings of the weights.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", default=["crane", "horse_gallop"])
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    rows = [(name, share) for name in arguments.names for share in PAPER_SHARES]
    lines: list[Line] = [("data", "known", "re-estimated", "once only", "detail")]
    for name, share in track(rows, console=Console(stderr=True)):
        sequence = dynmesh.read(arguments.folder / f"{name}.npz")
        start = dynmesh.Sequence(sequence.vertices[:FRAMES], sequence.faces)
        errors = [next(error_of_cycles(start, share, s, seed=arguments.seed)) for s in READINGS]
        lines.append((name, f"{share:.0%}", *(f"{1e4 * error:.3g}" for error in errors)))
    print(table(lines))


if __name__ == "__main__":
    main()
