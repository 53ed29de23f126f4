"""Prints whether a mesh is found again after half of its scans was missing, as a table.

    python -m benchmarks.tracking_gaps FOLDER [NAME ...] [--starts 10 20 30]

FOLDER contains sequences in files NAME.npz. Each is scanned by four simulated cameras around it,
20 000 points a frame with noise of 0.02 mean edges. For ten frames from each start, the points on
one side of the median of the vertices are missing, for both sides and all three axes. Errors are
mean distances from the true vertices, in mean edges of frame 0: of the hidden half in the last
frame of the gap, and of all vertices in the first frame after it, in the fourth, and in the
sixteenth. "Moved" is the farthest that a vertex moves during the gap. Found are the trials in
which the error after the gap is below 1.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from benchmarks.tracking_table import around, scans_of
from dynmesh import Tracker
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.files.scans import PointScan
from dynmesh.sequence import Positions
from dynmesh.study.subjects import from_file
from dynmesh.study.tables import Line, markdown, number

GAP = 10
AFTER = (1, 4, 16)
"""The frames after the gap whose errors are shown."""


def distances(a: Positions, b: Positions, mean_edge: float) -> NDArray[np.float64]:
    """Return (k,) how far vertices are apart, in mean edges."""
    return np.asarray(np.linalg.norm(a - b, axis=1) / mean_edge)


def after_a_gap(
    tracker: Tracker, truth: Positions, scans: list[PointScan], axis: int, side: int, edge: float
) -> list[float]:
    """Track through a gap; `truth` begins with the frame before it, `scans` with its first one."""
    cut = np.median(truth[0][:, axis])
    errors = []
    for n, (frame, scan) in enumerate(zip(truth[1:], scans, strict=True), start=1):
        kept = np.full(len(scan.points), True)
        if n <= GAP:
            kept = side * scan.points[:, axis] > side * cut
        points, normals = scan.points[kept], scan.normals
        tracked = tracker.push(
            points, None if normals is None else normals[kept], viewpoints=scan.viewpoints
        )
        error = distances(tracked, frame, edge)
        if n == GAP:
            errors.append(float(error[side * frame[:, axis] < side * cut].mean()))
        if n - GAP in AFTER:
            errors.append(float(error.mean()))
    return errors


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", help="the sequences; the default is all of them")
    parser.add_argument("--starts", type=int, nargs="+", default=[10, 20], metavar="FRAME")
    arguments = parser.parse_args()
    names = arguments.names or sorted(path.stem for path in arguments.folder.glob("*.npz"))
    lines: list[Line] = [
        ("sequence", "start", "moved", "hidden half", *(f"{n} after" for n in AFTER), "found")
    ]
    console = Console(stderr=True)
    for name in names:
        subject = from_file(arguments.folder / f"{name}.npz")
        frames = subject.vertices
        edge = mean_edge_of(frames[0], subject.faces)
        needed = max(arguments.starts) + GAP + AFTER[-1]
        if len(frames) <= needed:
            parser.error(f"{name} has {len(frames)} frames, but {needed + 1} are needed")
        cameras = around(subject, frames[1 : needed + 1], 4)
        scans = [
            scan
            for scan in scans_of(subject, frames[1 : needed + 1], cameras, depth=False)
            if isinstance(scan, PointScan)
        ]
        for start in arguments.starts:
            tracker = Tracker(subject.faces, frames[0])
            for scan in scans[:start]:
                tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
            before, end = tracker.state(), start + GAP + AFTER[-1]
            trials = []
            sides = [(axis, side) for axis in range(3) for side in (1, -1)]
            for axis, side in track(sides, f"{name}, {start}", console=console):
                tracker.restore(before)
                part = frames[start : end + 1]
                trials.append(after_a_gap(tracker, part, scans[start:end], axis, side, edge))
            errors = np.array(trials)
            moved = distances(frames[start + GAP], frames[start], edge).max()
            found = " / ".join(str(n) for n in (errors[:, 1:] < 1).sum(axis=0))
            lines.append(
                (
                    name,
                    str(start),
                    number(float(moved)),
                    *(number(float(e)) for e in errors.mean(axis=0)),
                    f"{found} of {len(sides)}",
                )
            )
    print(markdown(lines))


if __name__ == "__main__":
    main()
