"""Prints the error and the time of tracking at both resolutions, as a table.

    script/reproduce tracking-resolutions FOLDER [NAME ...] [--frames 21]

The scans are 15 000 points a frame with noise of 0.05 mean edges, by cameras six diagonals away.
Errors are mean distances from the true vertices, in mean edges of frame 0; times are the median of
a frame in queries of scipy's cKDTree for 10 000 of 20 000 points, on one thread each.
"""

import argparse
import time

import numpy as np
from scipy.spatial import cKDTree

from dynmesh import Tracker, losses
from dynmesh.tracker import Resolution
from dynmesh.tracking.placing import push_scan

from .harness import Line, Table, number, sequences
from .runner import followed
from .subjects import Subject

POINTS = 15_000
NOISE = 0.05
FAR = 6.0
"""Of the cameras, in diagonals."""

RESOLUTIONS: tuple[Resolution, ...] = ("best", 2500, 1250)


def seconds_of_query() -> float:
    """Return the median time of a query of 10 000 of 20 000 points."""
    points = np.random.default_rng(0).random((20_000, 3))
    tree = cKDTree(points)
    times = []
    for _ in range(9):
        begun = time.perf_counter()
        tree.query(points[:10_000] + 0.005)
        times.append(time.perf_counter() - begun)
    return float(np.median(times))


def row_of(subject: Subject, n: int) -> Line:
    """Return the row of a subject and a number of cameras."""
    cameras = losses.orbit(subject.box, n, distance=FAR, up=subject.up_vector)(0)
    scans = list(
        losses.scan_points(subject.vertices[1:], subject.faces, cameras, points=POINTS, noise=NOISE)
    )
    cells: list[str] = []
    for resolution in RESOLUTIONS:
        tracker = Tracker(subject.faces, subject.vertices[0], resolution=resolution)
        found = followed(subject, scans, lambda _, scan: push_scan(tracker, scan))  # noqa: B023
        queries = np.median(found[:, 1]) / seconds_of_query()
        cells += [number(float(found[:, 0].mean())), number(float(queries))]
    return subject.name, str(n), *cells


def tables(arguments: argparse.Namespace) -> list[Table]:
    """The error and the time of tracking at both resolutions."""
    head = ["sequence", "cameras"]
    for resolution in RESOLUTIONS:
        head += [str(resolution), "queries"]
    subjects = sequences(arguments, 21)
    rows = [row_of(subject, n) for subject in subjects for n in arguments.cameras]
    return [Table("tracking-resolutions", [tuple(head), *rows])]
