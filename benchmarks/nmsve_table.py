"""Prints the error of both readings of the weights and of detail, as a table.

    python -m benchmarks.nmsve_table [FOLDER NAME ...] [--known SHARE ...]

The first 100 frames of each sequence are scaled to a bounding-box diagonal of 1 and completed in
double precision from vertices that are known at random. The table shows the mean NMSVE times
10 000.
"""

from dynmesh.study.losses import PAPER_SHARES, random_masks
from dynmesh.study.measure import run
from dynmesh.study.methods import DETAIL, MOTION
from dynmesh.study.tables import Line, nmsve_cell

from .baselines import ONCE
from .harness import Table, parser, progress, sequences, show

FRAMES = 100

METHODS = {"re-estimated": MOTION, "once only": ONCE, "detail": DETAIL}


def main() -> None:
    """Measure, and print the table."""
    arguments = parser(__doc__, known=PAPER_SHARES).parse_args()
    lines: list[Line] = [("data", "known", *METHODS)]
    for sequence in sequences(arguments, FRAMES):
        subject = sequence.scaled()
        for share in progress(arguments.known, subject.name):
            masks = list(random_masks(subject, share))
            runs = [run(subject, method, masks) for method in METHODS.values()]
            cells = [nmsve_cell(measured.nmsve.mean()) for measured in runs]
            lines.append((subject.name, f"{share:.0%}", *cells))
    name = "two-readings" if arguments.folder is None else "two-readings-recordings"
    show(arguments, Table(name, lines))


if __name__ == "__main__":
    main()
