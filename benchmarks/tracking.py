"""Measures tracking beside other libraries, and at several resolutions.

    script/reproduce tracking|tracking-resolutions|tracking-colours FOLDER [NAME ...] [--frames N]

The template is frame 0, and every frame after it is registered from the result for the last one.
The scans are points by cameras around the subject: beside other libraries, which take up to a
minute for a frame, 20 000 with noise of 0.02 mean edges; else 15 000 with noise of 0.05, by cameras
six diagonals away. Errors are mean distances from the true place of a vertex, in mean edges of
frame 0.
"""

import argparse
import time
from collections.abc import Callable
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import trimesh.registration
from scipy.spatial import cKDTree

from dynmesh import Tracker, losses
from dynmesh._arrays import Positions
from dynmesh.scans import PointScan
from dynmesh.topology import mean_edge_of, unit
from dynmesh.tracker import Resolution
from dynmesh.tracking.placing import push_scan

from .harness import Line, Table, number, progress, sequences
from .runner import followed
from .subjects import Subject

registration: Any = trimesh.registration  # has no types

Register = Callable[[Positions, PointScan], Positions]
"""Takes the mesh of the last frame and a scan, and returns the mesh as it lies in the scan."""

RESOLUTIONS: tuple[Resolution, ...] = ("best", 2500, 1250)


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


def baselines(arguments: argparse.Namespace) -> list[Table]:
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


def resolutions(arguments: argparse.Namespace) -> list[Table]:
    """The error and the time of tracking at several resolutions, on one thread.

    Times are the median of a frame in queries of scipy's cKDTree for 10 000 of 20 000 points.
    """
    head = [cell for resolution in RESOLUTIONS for cell in (str(resolution), "queries")]
    lines: list[Line] = [("sequence", "cameras", *head)]
    for subject, n in product(sequences(arguments, 21), arguments.cameras):
        around = losses.orbit(subject.box, n, distance=6.0, up=subject.up_vector)(0)
        later = subject.vertices[1:]
        scans = [*losses.scan_points(later, subject.faces, around, points=15_000, noise=0.05)]
        cells: list[str] = []
        for resolution in RESOLUTIONS:
            tracker = Tracker(subject.faces, subject.vertices[0], resolution=resolution)
            found = followed(subject, scans, lambda _, scan: push_scan(tracker, scan))  # noqa: B023
            queries = np.median(found[:, 1]) / _seconds_of_query()
            cells += [number(float(found[:, 0].mean())), number(float(queries))]
        lines.append((subject.name, str(n), *cells))
    return [Table("tracking-resolutions", lines)]


def colours(arguments: argparse.Namespace) -> list[Table]:
    """How far a mesh slides along itself in 30 frames, with and without colours.

    The texture is a sum of waves of 3 to 12 mean edges in frame 0, with noise of 0.02 of its range.
    The cells are the error of frame 1, and those of frame 30.
    """
    lines: list[Line] = [("sequence", "cameras", "frame 1", "frame 30", "with colours")]
    for subject in sequences(arguments, 31):
        rest = subject.vertices[0] / mean_edge_of(subject.vertices[0], subject.faces)
        rng = np.random.default_rng(0)
        for n in arguments.cameras:
            around = losses.orbit(subject.box, n, up=subject.up_vector)(0)
            at = losses.scan_points(subject.vertices[1:], subject.faces, around, colours=rest)
            scans = [scan._replace(colours=_texture(scan.colours, rng)) for scan in at]
            errors = []
            for seen in ([scan._replace(colours=None) for scan in scans], scans):
                tracker = Tracker(subject.faces, subject.vertices[0])
                found = followed(subject, seen, lambda _, scan: push_scan(tracker, scan))  # noqa: B023
                errors.append(found[:, 0])
            plain, coloured = errors
            cells = (number(float(error)) for error in (plain[0], plain[-1], coloured[-1]))
            lines.append((subject.name, str(n), *cells))
    return [Table("tracking-colours", lines)]


def _texture(places: Any, rng: np.random.Generator) -> Positions:
    """(n, 3) colours from 0 to about 1 at places in frame 0, in mean edges."""
    waves = np.random.default_rng(1)
    lengths = np.exp(waves.uniform(np.log(3), np.log(12), (3, 12)))
    directions = unit(waves.standard_normal((36, 3))).reshape(3, 12, 3)
    phases = waves.uniform(0, 2 * np.pi, (3, 12))
    along = np.einsum("nx,cwx->ncw", places, 2 * np.pi * directions / lengths[..., None])
    colours = 0.5 + 0.1 * np.sin(along + phases).sum(axis=2)
    noisy = colours + 0.02 * rng.standard_normal(colours.shape)
    return np.asarray(noisy, np.asarray(places).dtype)


def _seconds_of_query() -> float:
    points = np.random.default_rng(0).random((20_000, 3))
    tree = cKDTree(points)
    times = []
    for _ in range(9):
        begun = time.perf_counter()
        tree.query(points[:10_000] + 0.005)
        times.append(time.perf_counter() - begun)
    return float(np.median(times))
