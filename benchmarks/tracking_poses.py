"""Prints whether tracking recovers from templates in another pose than the first scan, as a table.

    python -m benchmarks.tracking_poses FOLDER [NAME ...]

The first frames of each sequence are scanned by simulated cameras around it, and tracked with
templates in eight poses of the sequence. Counted are those that a rigid motion had to move into the
first scan, by their typical distance from it after the motion and by the mean distance from the
true vertex in the last frame, both in mean edges.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from dynmesh import Tracker, degrade, find_alignment
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import Line

from .harness import Table, parser, progress, sequences, show
from .tracking import errors, push

FRAMES, POSES, POINTS = 8, 8, 5000
DISTANCES = (0.0, 1.0, 1.5, 2.5, np.inf)
ERRORS = (0.0, 1.0, 3.0, np.inf)


def measure(subject: Subject, cameras: int) -> Iterator[tuple[float, float]]:
    """Yield the distance and the error of each template that was moved."""
    frames, faces = subject.vertices.astype(np.float64), subject.faces
    truth = frames[:FRAMES]
    scans = list(degrade.scan_points(truth, faces, cameras, points=POINTS))
    poses = np.linspace(0, len(frames) - 1, POSES).astype(int)
    for pose in progress(poses, f"{subject.name}, {cameras}"):
        motion = find_alignment(faces, frames[pose], scans[0].points)
        if motion.lies_in_scan:
            continue
        tracker = Tracker(faces, frames[pose] @ motion.rotation.T + motion.shift)
        for scan in scans:
            tracked = push(tracker, scan)
        yield motion.after, float(errors(subject, tracked, truth[-1]).mean())


def main() -> None:
    """Measure, and print the table."""
    made = parser(__doc__)
    made.add_argument("--cameras", type=int, nargs="+", default=[4, 1])
    arguments = made.parse_args()
    subjects = sequences(arguments)
    found = [row for s in subjects for n in arguments.cameras for row in measure(s, n)]
    lines: list[Line] = [("distance after the motion", "error below 1", "1 to 3", "more")]
    for low, high in pairwise(DISTANCES):
        within = [error for distance, error in found if low <= distance < high]
        counts, _ = np.histogram(within, ERRORS)
        lines.append((f"{low:g} to {high:g}", *map(str, counts.tolist())))
    show(arguments, Table("tracking-poses", lines))


if __name__ == "__main__":
    main()
