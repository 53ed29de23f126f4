"""Prints the error of both readings of the weights and of detail on recordings, as a table.

    python -m benchmarks.nmsve_table FOLDER [NAME ...]

FOLDER contains sequences in files NAME.npz. The first 100 frames of each are scaled to a
bounding-box diagonal of 1 and completed in double precision from vertices that are known at random.
The table shows the mean NMSVE times 10 000.
"""

import argparse
from pathlib import Path

from rich.console import Console
from rich.progress import track

from dynmesh.study.losses import PAPER_SHARES, random_masks
from dynmesh.study.measure import run
from dynmesh.study.methods import DETAIL, MOTION, ONCE
from dynmesh.study.subjects import from_file
from dynmesh.study.tables import Line, markdown, nmsve_cell

FRAMES = 100

METHODS = {"re-estimated": MOTION, "once only": ONCE, "detail": DETAIL}


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description="The error of both readings of the weights.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", default=["crane", "horse_gallop"])
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    rows = [(name, share) for name in arguments.names for share in PAPER_SHARES]
    lines: list[Line] = [("data", "known", *METHODS)]
    for name, share in track(rows, console=Console(stderr=True)):
        subject = from_file(arguments.folder / f"{name}.npz", FRAMES).scaled()
        masks = list(random_masks(subject, share, arguments.seed))
        runs = [run(subject, method, masks) for method in METHODS.values()]
        lines.append((name, f"{share:.0%}", *(nmsve_cell(r.nmsve.mean()) for r in runs)))
    print(markdown(lines))


if __name__ == "__main__":
    main()
