"""Prints whether a mesh is found again after half of its scans was missing, as a table.

    python -m benchmarks.tracking_gaps FOLDER [NAME ...] [--starts 10 20 30]

Each sequence is scanned as by benchmarks.tracking_table, by four cameras. For ten frames from each
start, the points on one side of the median of the vertices are missing, for both sides and all
three axes. Errors are mean distances from the true vertices, in mean edges of frame 0: of the
hidden half in the last frame of the gap, and of all vertices in the first frame after it, in the
fourth, and in the sixteenth. "Moved" is the farthest that a vertex moves during the gap. Found are
the trials in which the error after the gap is below 1.
"""

import numpy as np

from dynmesh import Tracker
from dynmesh.files.scans import PointScan
from dynmesh.sequence import Positions
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import Line, number

from .harness import Table, parser, progress, sequences, show
from .tracking import around, errors, point_scans, push

GAP = 10
AFTER = (1, 4, 16)
"""The frames after the gap whose errors are shown."""


def after_a_gap(
    subject: Subject,
    tracker: Tracker,
    truth: Positions,
    scans: list[PointScan],
    axis: int,
    side: int,
) -> list[float]:
    """Track through a gap; `truth` begins with the frame before it, `scans` with its first one."""
    cut = np.median(truth[0][:, axis])
    found = []
    for n, (frame, scan) in enumerate(zip(truth[1:], scans, strict=True), start=1):
        if n <= GAP:
            kept = side * scan.points[:, axis] > side * cut
            normals = None if scan.normals is None else scan.normals[kept]
            scan = scan._replace(points=scan.points[kept], normals=normals)
        error = errors(subject, push(tracker, scan), frame)
        if n == GAP:
            found.append(float(error[side * frame[:, axis] < side * cut].mean()))
        if n - GAP in AFTER:
            found.append(float(error.mean()))
    return found


def row(subject: Subject, scans: list[PointScan], start: int) -> Line:
    """Track up to a start, and on through every gap from there."""
    frames, end = subject.vertices, start + GAP + AFTER[-1]
    tracker = Tracker(subject.faces, frames[0])
    for scan in scans[:start]:
        push(tracker, scan)
    before = tracker.state()
    trials = []
    sides = [(axis, side) for axis in range(3) for side in (1, -1)]
    for axis, side in progress(sides, f"{subject.name}, {start}"):
        tracker.restore(before)
        part = frames[start : end + 1]
        trials.append(after_a_gap(subject, tracker, part, scans[start:end], axis, side))
    means = [number(float(mean)) for mean in np.mean(trials, axis=0)]
    moved = number(float(errors(subject, frames[start + GAP], frames[start]).max()))
    found = " / ".join(str(n) for n in (np.array(trials)[:, 1:] < 1).sum(axis=0))
    return subject.name, str(start), moved, *means, f"{found} of {len(sides)}"


def main() -> None:
    """Measure, and print the table."""
    made = parser(__doc__)
    made.add_argument("--starts", type=int, nargs="+", default=[10, 20], metavar="FRAME")
    arguments = made.parse_args()
    lines: list[Line] = [
        ("sequence", "start", "moved", "hidden half", *(f"{n} after" for n in AFTER), "found")
    ]
    for subject in sequences(arguments):
        needed = max(arguments.starts) + GAP + AFTER[-1]
        if subject.n_frames <= needed:
            made.error(f"{subject.name} has {subject.n_frames} frames; {needed + 1} are needed")
        frames = subject.vertices[1 : needed + 1]
        scans = list(point_scans(subject, frames, around(subject, frames, 4)))
        lines += [row(subject, scans, start) for start in arguments.starts]
    show(arguments, Table("tracking-gaps", lines))


if __name__ == "__main__":
    main()
