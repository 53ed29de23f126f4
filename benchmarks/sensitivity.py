"""Prints how far the error of method detail depends on each of its constants, as a table.

    python -m benchmarks.sensitivity [FILE ...]

FILE is a sequence. The default is the built-in walker and ocean. The first 60 frames of each are
completed, with every constant halved and doubled, one at a time. The table shows the mean NMSVE
over four losses (10 %, 30 % and 70 % of the vertices known at random, and what one camera sees),
each relative to that with the unchanged constants. script/bench builds the compiled part.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from dynmesh.sequence import Mask
from dynmesh.study.losses import losses
from dynmesh.study.measure import run
from dynmesh.study.subjects import Subject, built_in, from_file
from dynmesh.study.tables import Line, markdown

from .methods import varied_detail

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


def errors(
    subject: Subject, masks: dict[str, list[Mask]], constant: str, factor: float
) -> NDArray[np.float64]:
    """Return the mean NMSVE with each loss."""
    method = varied_detail(constant, factor)
    return np.array([run(subject, method, of_loss).nmsve.mean() for of_loss in masks.values()])


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("files", type=Path, nargs="*")
    parser.add_argument("--constants", nargs="+", default=CONSTANTS, help="only these constants")
    arguments = parser.parse_args()
    console = Console(stderr=True)
    rows: dict[str, list[str]] = {name: [] for name in arguments.constants}
    head = ["constant"]
    files = [from_file(file, FRAMES) for file in arguments.files]
    for subject in files or built_in(FRAMES):
        masks = losses(subject, SHARES, ("camera",))
        unchanged = errors(subject, masks, "pull", 1.0)
        for name in track(rows, subject.name, console=console):
            for factor in FACTORS:
                changed = errors(subject, masks, name, factor)
                rows[name].append(f"{np.mean(changed / unchanged):.3f}")
        head += [f"{subject.name}, halved", f"{subject.name}, doubled"]
    lines: list[Line] = [tuple(head), *((f"`{name}`", *cells) for name, cells in rows.items())]
    print(markdown(lines))


if __name__ == "__main__":
    main()
