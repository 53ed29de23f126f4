"""Prints what learning on the way changes in the error of method detail, as a table.

    python -m benchmarks.learning_table FOLDER [NAME ...]
    python -m benchmarks.learning_table FOLDER NAME --cycles 10

The first 100 frames of each sequence are completed. With --cycles, each sequence is played several
times in a row, seen by one camera that circles it, and every cycle has a row. A summary shows the
ratio of the errors alone, by the loss or by the cycle.
"""

import numpy as np

from dynmesh.study.losses import losses
from dynmesh.study.measure import run
from dynmesh.study.methods import DETAIL, dynmesh_method
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import Line, by_row_and_column, nmsve_cell

from .harness import Table, parser, progress, sequences, show

MOST_FRAMES = 100
"""Of a sequence that is completed once."""

LEARNING = dynmesh_method(
    "learning", "detail, learning", "#882255", "-", method="detail", learn=True
)


def lines(subject: Subject, cycles: int) -> list[Line]:
    """Return a row for each loss, or for each cycle."""
    rows: list[Line] = []
    n_frames, played = subject.n_frames, subject.repeated(cycles)
    kinds = losses(played, (), ("camera",)) if cycles > 1 else losses(played, (0.1, 0.3))
    for loss, masks in progress(kinds.items(), subject.name):
        plain, learned = (run(played, method, masks) for method in (DETAIL, LEARNING))
        time = np.median(learned.seconds) / np.median(plain.seconds)
        for cycle in range(cycles):
            frames = slice(max(cycle * n_frames - 1, 0), (cycle + 1) * n_frames - 1)
            of_plain, error = plain.nmsve[frames].mean(), learned.nmsve[frames].mean()
            cells = nmsve_cell(of_plain), nmsve_cell(error), f"{error / of_plain:.2f}"
            rows.append((subject.name, loss, str(cycle + 1), *cells, f"{time:.2f}"))
    return rows


def main() -> None:
    """Measure, and print the table."""
    made = parser(__doc__)
    made.add_argument("--cycles", type=int, default=1, help="how often a sequence is played")
    arguments = made.parse_args()
    head = ("sequence", "known", "cycle", "detail, x 1e4", "learned, x 1e4", "learned / detail",
            "time / detail")  # fmt: skip
    once = arguments.cycles == 1
    subjects = sequences(arguments, MOST_FRAMES if once else None)
    rows = [row for subject in subjects for row in lines(subject, arguments.cycles)]
    column, name = (1, "learning-summary") if once else (2, "learning-cycles")
    ratios = {(row[0], row[column]): row[5] for row in rows}
    summary = by_row_and_column("sequence" if once else "cycle", ratios)
    show(arguments, Table("learning", [head, *rows]), Table(name, summary))


if __name__ == "__main__":
    main()
