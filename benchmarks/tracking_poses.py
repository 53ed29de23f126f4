"""Prints whether tracking recovers from templates in another pose than the first scan, as a table.

    python -m benchmarks.tracking_poses FOLDER [NAME ...]

FOLDER contains sequences in files NAME.npz. The first frames of each are scanned by simulated
cameras around it, and tracked with templates in eight poses of the sequence. Counted are those that
a rigid motion had to move into the first scan, by their typical distance from it after the motion
and by the mean distance from the true vertex in the last frame, both in mean edges.
"""

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np

import dynmesh
from dynmesh import degrade
from dynmesh.study.tables import Line, markdown

FRAMES, POSES, POINTS = 8, 8, 5000
DISTANCES = (0.0, 1.0, 1.5, 2.5, np.inf)
ERRORS = (0.0, 1.0, 3.0, np.inf)


def measure(sequence: dynmesh.Sequence, cameras: int) -> list[tuple[float, float]]:
    """Return the distance and the error of each template that was moved."""
    frames, faces = sequence.vertices.astype(np.float64), sequence.faces
    truth = frames[:FRAMES]
    scans = list(degrade.scan_points(truth, faces, cameras, points=POINTS))
    found = []
    for pose in np.linspace(0, len(frames) - 1, POSES).astype(int):
        motion = dynmesh.find_alignment(faces, frames[pose], scans[0].points)
        if motion.lies_in_scan:
            continue
        tracker = dynmesh.Tracker(faces, frames[pose] @ motion.rotation.T + motion.shift)
        for scan in scans:
            tracked = tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
        off = np.linalg.norm(tracked - truth[-1], axis=1).mean() / motion.mean_edge
        found.append((motion.after, float(off)))
    return found


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", help="the sequences; the default is all of them")
    parser.add_argument("--cameras", type=int, nargs="+", default=[4, 1])
    arguments = parser.parse_args()
    names = arguments.names or sorted(path.stem for path in arguments.folder.glob("*.npz"))
    found = [
        row
        for name in names
        for cameras in arguments.cameras
        for row in measure(dynmesh.read(arguments.folder / f"{name}.npz"), cameras)
    ]
    lines: list[Line] = [("distance after the motion", "error below 1", "1 to 3", "more")]
    for low, high in pairwise(DISTANCES):
        errors = [error for distance, error in found if low <= distance < high]
        counts, _ = np.histogram(errors, ERRORS)
        lines.append((f"{low:g} to {high:g}", *map(str, counts.tolist())))
    print(markdown(lines))


if __name__ == "__main__":
    main()
