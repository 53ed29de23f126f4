"""Prints how well the standard errors of tracking describe its errors, as a table.

    python -m benchmarks.tracking_calibration FOLDER [NAME ...] [--training]

FOLDER contains sequences in files NAME.npz. At most 40 frames of each are scanned by simulated
cameras around it, as by benchmarks.tracking_table. The table shows, over all vertices with a finite
standard error, the shares that are within the intervals of 90 % of the true surface (1.645 standard
errors, at the nearest true vertex and along its normal), of all vertices, of observed ones and of
the others; the root mean square of this distance over that of the standard errors; the share that
is within 2.5 standard errors of its true position; and the rank correlation of standard errors and
distances from the true position, the mean over frames. With --training, the first half of each
sequence is a training sequence for the second.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dynmesh import Tracker
from dynmesh._extras import require
from dynmesh.files.scans import PointScan
from dynmesh.sequence import Positions
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import Line, markdown

from .tracking_table import around, scans_of, taken

MOST_FRAMES = 40
NORMAL_90 = 1.645
PLACE_90 = 2.5

Floats = NDArray[np.float64]


def vertex_normals(frame: Positions, subject: Subject) -> Floats:
    """Return the unit normals of the vertices, (k, 3)."""
    corners = frame[subject.faces].astype(np.float64)
    of_faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros((len(frame), 3))
    for corner in subject.faces.T:
        np.add.at(normals, corner, of_faces)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.maximum(length, np.finfo(float).tiny))


def measure(subject: Subject, cameras: int, training: Positions | None) -> list[float]:
    """Return the numbers of a row."""
    spatial = require("scipy.spatial", extra="reproduce")
    stats = require("scipy.stats", extra="reproduce")
    truth = subject.vertices
    tracker = Tracker(subject.faces, truth[0], training=training, uncertainty=True)
    rig = around(subject, truth, cameras)
    columns: list[list[Floats]] = []
    ranks = []
    for frame, scan in zip(truth, scans_of(subject, truth, rig, depth=False), strict=True):
        assert isinstance(scan, PointScan)
        found = tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
        bars = np.asarray(tracker.standard_error, np.float64)
        nearest = spatial.cKDTree(frame).query(found)[1]
        normals = vertex_normals(frame, subject)[nearest]
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
        float(within[seen == 1].mean()),
        float(within[seen == 0].mean()),
        float(np.sqrt((off**2).mean() / (bars**2).mean())),
        float((distance <= PLACE_90 * bars).mean()),
        float(np.mean(ranks)),
    ]


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", help="the sequences; the default is all of them")
    parser.add_argument("--cameras", type=int, nargs="+", default=[4, 1])
    parser.add_argument("--frames", type=int, default=MOST_FRAMES)
    parser.add_argument("--training", action="store_true", help="train the first half")
    arguments = parser.parse_args()
    names = arguments.names or sorted(path.stem for path in arguments.folder.glob("*.npz"))
    head = ("surface, 90 %", "observed", "others", "ratio", "position, 90 %", "rank")
    lines: list[Line] = [("sequence", "cameras", *head)]
    for name in names:
        subject, training = taken(arguments.folder / f"{name}.npz", arguments)
        for n in arguments.cameras:
            row = measure(subject, n, training.get("trained"))
            lines.append((name, str(n), *(f"{value:.2f}" for value in row)))
    print(markdown(lines))


if __name__ == "__main__":
    main()
