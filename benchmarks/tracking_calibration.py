"""Prints how well the standard errors of tracking describe its errors, as a table.

    python -m benchmarks.tracking_calibration FOLDER [NAME ...] [--training]

At most 40 frames of each sequence are scanned as by benchmarks.tracking_table. The table shows,
over all vertices with a finite standard error, the shares that are within the intervals of 90 % of
the true surface (1.645 standard errors, at the nearest true vertex and along its normal), of all
vertices, of observed ones and of the others; the root mean square of this distance over that of the
standard errors; the share that is within 2.5 standard errors of its true position; and the rank
correlation of standard errors and distances from the true position, the mean over frames. With
--training, the first half of each sequence is a training sequence for the second.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import spatial, stats

from dynmesh import Tracker
from dynmesh.jobs.true_surface import vertex_normals
from dynmesh.sequence import Positions
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import Line, mean

from .calibration import cell
from .harness import Table, parser, progress, sequences, show
from .tracking import around, point_scans, push, taken

NORMAL_90 = 1.645
POSITION_90 = 2.5

Floats = NDArray[np.float64]


def measure(subject: Subject, cameras: int, training: Positions | None) -> list[float]:
    """Return the numbers of a row."""
    truth = subject.vertices
    tracker = Tracker(subject.faces, truth[0], training=training, uncertainty=True)
    scans = point_scans(subject, truth, around(subject, truth, cameras))
    columns: list[list[Floats]] = []
    ranks = []
    for frame, scan in zip(truth, progress(scans, subject.name, len(truth)), strict=True):
        found = push(tracker, scan)
        bars = np.asarray(tracker.standard_error, np.float64)
        nearest = spatial.cKDTree(frame).query(found)[1]
        normals = vertex_normals(subject.faces, frame.astype(np.float64))[nearest]
        off = np.abs(((found - frame[nearest]) * normals).sum(axis=1))
        distance = np.linalg.norm(found - frame, axis=1)
        finite = np.isfinite(bars)
        seen = tracker.observed.astype(np.float64)
        columns.append([values[finite] for values in (bars, off, distance, seen)])
        ranks.append(stats.spearmanr(bars[finite], distance[finite])[0])
    bars, off, distance, seen = (np.concatenate(values) for values in zip(*columns, strict=True))
    within = off <= NORMAL_90 * bars
    return [
        float(within.mean()),
        mean(within[seen == 1].tolist()),
        mean(within[seen == 0].tolist()),
        float(np.sqrt((off**2).mean() / (bars**2).mean())),
        float((distance <= POSITION_90 * bars).mean()),
        float(np.mean(ranks)),
    ]


def main() -> None:
    """Measure, and print the table."""
    made = parser(__doc__)
    made.add_argument("--cameras", type=int, nargs="+", default=[4, 1])
    made.add_argument("--frames", type=int, default=40)
    made.add_argument("--training", action="store_true", help="train the first half")
    arguments = made.parse_args()
    head = ("surface, 90 %", "observed", "others", "ratio", "position, 90 %", "rank")
    lines: list[Line] = [("sequence", "cameras", *head)]
    for sequence in sequences(arguments):
        subject, training = taken(sequence, arguments.frames, training=arguments.training)
        for n in arguments.cameras:
            row = measure(subject, n, training)
            lines.append((subject.name, str(n), *map(cell, row)))
    show(arguments, Table("tracking-calibration", lines))


if __name__ == "__main__":
    main()
