"""Prints how near to the truth other libraries bring a mesh, and in what time, as a table.

    script/reproduce tracking FOLDER [NAME ...] [--cameras 4 1] [--frames 3]

The scans are 20 000 points a frame with noise of 0.02 mean edges, by cameras around the subject.
The template is frame 0, and every frame after it is registered from the result for the last one. A
frame takes other libraries up to a minute. Errors are mean distances from the true place of a
vertex, in mean edges of frame 0.
"""

import argparse
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import trimesh.registration

from dynmesh import Tracker, losses
from dynmesh._arrays import Positions
from dynmesh.scans import PointScan
from dynmesh.tracking.placing import push_scan

from .harness import Line, Table, number, progress, sequences
from .runner import followed
from .subjects import Subject

registration: Any = trimesh.registration  # has no types

Register = Callable[[Positions, PointScan], Positions]
"""Takes the mesh of the last frame and a scan, and returns the mesh as it lies in the scan."""


def methods(subject: Subject) -> dict[str, Register]:
    """Return the tracker of dynmesh, and what trimesh offers, with its defaults."""
    tracker = Tracker(subject.faces, subject.vertices[0])

    def rigid(last: Positions, scan: PointScan) -> Positions:
        # From the scan to the mesh: the other way round, what the cameras do not see would be drawn
        # to what they see.
        matrix, _, _ = registration.icp(scan.points, last, max_iterations=50, scale=False)
        inverse = np.linalg.inv(matrix)
        return np.asarray(last @ inverse[:3, :3].T + inverse[:3, 3])

    def free(method: Any, last: Positions, scan: PointScan) -> Positions:
        mesh = trimesh.Trimesh(last, subject.faces, process=False)
        return np.asarray(method(mesh, scan.points, use_faces=False))

    return {
        "dynmesh": lambda _, scan: push_scan(tracker, scan),
        "rigid ICP (trimesh)": rigid,
        "nricp_amberg (trimesh)": partial(free, registration.nricp_amberg),
        "nricp_sumner (trimesh)": partial(free, registration.nricp_sumner),
    }


def tables(arguments: argparse.Namespace) -> list[Table]:
    """How near to the truth other libraries bring a mesh, and in what time."""
    lines: list[Line] = [("sequence", "cameras", "method", "error", "times dynmesh")]
    for subject in sequences(arguments, 3):
        for n in arguments.cameras:
            around = losses.orbit(subject.box, n, up=subject.up_vector)(0)
            _, *scans = losses.scan_points(subject.vertices, subject.faces, around)
            usual = 0.0
            for label, register in progress(methods(subject).items(), f"{subject.name}, {n}"):
                found = followed(subject, scans, register)
                error, seconds = found[:, 0].mean(), np.median(found[:, 1])
                usual = usual or seconds  # of dynmesh, the first one
                lines.append((subject.name, str(n), label, number(error), number(seconds / usual)))
    return [Table("tracking-baselines", lines)]
