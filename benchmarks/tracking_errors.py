"""Measures how well the standard errors of tracked vertices describe their errors, as a table.

    script/reproduce tracking-errors FOLDER [NAME ...] [--frames 41]

The scans are those of tracking-resolutions. The table shows the shares of the vertices, seen
and unseen, whose distance from the true vertex, along the true normal, is within the intervals of
50 % and 90 %, and more than three standard errors.
"""

import argparse

import numpy as np

from dynmesh import Tracker, losses
from dynmesh.evaluation import Floats
from dynmesh.geometry import vertex_normals
from dynmesh.tracking.placing import push_scan

from .harness import ABSENT, Line, Table, sequences
from .subjects import Subject
from .tracking_resolutions import FAR, NOISE, POINTS

NORMAL_50, NORMAL_90 = 0.674, 1.645


def shares(errors: list[Floats]) -> Line:
    """Return the cells of errors in standard errors."""
    off = np.concatenate(errors)
    if len(off) == 0:
        return (ABSENT,) * 3
    within = [f"{np.mean(off <= limit):.2f}" for limit in (NORMAL_50, NORMAL_90)]
    return (*within, f"{np.mean(off > 3):.1%}")


def row_of(subject: Subject, n: int) -> Line:
    """Return the row of a subject and a number of cameras."""
    cameras = losses.orbit(subject.box, n, distance=FAR, up=subject.up_vector)(0)
    scans = losses.scan_points(
        subject.vertices[1:], subject.faces, cameras, points=POINTS, noise=NOISE
    )
    tracker = Tracker(subject.faces, subject.vertices[0], uncertainty=True)
    seen: list[Floats] = []
    unseen: list[Floats] = []
    for truth, scan in zip(subject.vertices[1:], scans, strict=True):
        off = push_scan(tracker, scan).astype(np.float64) - truth
        along = np.abs((off * vertex_normals(subject.faces, truth)).sum(axis=1))
        errors = along / tracker.standard_error
        seen.append(errors[tracker.observed])
        unseen.append(errors[~tracker.observed & np.isfinite(tracker.standard_error)])
    return (subject.name, str(n), *shares(seen), *shares(unseen))


def tables(arguments: argparse.Namespace) -> list[Table]:
    """How well the standard errors of tracked vertices describe their errors."""
    head = ("sequence", "cameras", "seen: 50 %", "90 %", "beyond 3", "unseen: 50 %", "90 %",
            "beyond 3")  # fmt: skip
    subjects = sequences(arguments, 41)
    rows = [row_of(subject, n) for subject in subjects for n in arguments.cameras]
    return [Table("tracking-errors", [head, *rows])]
