"""Prints how well a mesh is tracked at rest, in motion, and with other things in its scans.

    script/reproduce tracking-conditions FOLDER [NAME ...] [--frames 21] [--cloth FILE]

The scans are 15 000 points a frame with noise of 0.05 mean edges, by cameras six diagonals away.
"still" repeats frame 0: the columns are the error of the third frame and of the last one. "moving"
is the mean error over the frames, alone, with 5 % of the points off by ten edges, with a floor half
an edge below the subject, and with a second subject beside the first; "depth" are images in which
as many pixels show the subject, and with "flying pixels" those beside a jump in depth lie anywhere
between its two sides. Errors are mean distances from the true vertices, in mean edges of frame 0.
"queries" is the median time of a frame over that of scipy's cKDTree for 10 000 of 20 000 points, on
one thread each.

--cloth names a recording of a cloth, with `points`, `offsets`, `template_vertices` and
`template_faces`; the second table has, at its end, the median distance of the points from the
surface, the share of the edges within 10 % of their length, and how far the two corners that were
held have moved.
"""

import argparse
import time
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dynmesh import Tracker, losses
from dynmesh._arrays import Positions
from dynmesh.geometry import mean_edge_of
from dynmesh.scans import DepthScan, PointScan, Scan
from dynmesh.tracking.placing import push_scan

from .harness import Line, Table, number, sequences
from .runner import followed
from .subjects import Subject

POINTS = 15_000
NOISE = 0.05
FAR = 6.0
"""Of the cameras, in diagonals."""
HELD = (0, 992)
"""The corners of the recorded cloth that were held."""


def with_floor(scan: PointScan, subject: Subject) -> PointScan:
    """Add a floor half an edge below everything that the subject reaches."""
    up = np.array(subject.up_vector)
    rng = np.random.default_rng(0)
    low, high = subject.box
    floor = rng.uniform(low, high, (len(scan.points) // 2, 3))
    height = low @ up - 0.5 * mean_edge_of(subject.vertices[0], subject.faces)
    floor += (height - floor @ up)[:, None] * up
    return PointScan(
        np.concatenate([scan.points, floor]),
        np.concatenate([scan.normals, np.broadcast_to(up, floor.shape)]),
        scan.viewpoints,
    )


def with_second(scan: PointScan, subject: Subject) -> PointScan:
    """Add the same subject a second time, beside the first, with two edges between them."""
    along = np.zeros(3)
    across = int(np.argmin(subject.up_vector))
    width = float(np.ptp(scan.points[:, across]))
    along[across] = width + 2 * mean_edge_of(subject.vertices[0], subject.faces)
    return PointScan(
        np.concatenate([scan.points, scan.points + along]),
        np.concatenate([scan.normals, scan.normals]),
        scan.viewpoints,
    )


def depth_scans(subject: Subject, cameras: list[losses.Camera]) -> list[DepthScan]:
    """Return depth images of which about as many pixels as POINTS show the subject."""
    images = partial(losses.depth_images, faces=subject.faces, cameras=cameras, noise=NOISE)
    (small,) = images(subject.vertices[:1], width=640, height=480)
    larger = np.sqrt(POINTS / np.count_nonzero(small.depth))
    return list(images(subject.vertices[1:], width=round(640 * larger), height=round(480 * larger)))


def with_flying_pixels(scan: DepthScan, subject: Subject) -> DepthScan:
    """Let pixels beside a jump in depth lie anywhere between its two sides."""
    rng = np.random.default_rng(0)
    images = []
    for depth in np.stack(scan.depth):
        beside = np.roll(depth, 1, axis=1)
        jumps = np.abs(depth - beside) > mean_edge_of(subject.vertices[0], subject.faces)
        flies = jumps & (depth > 0) & (beside > 0)
        images.append(np.where(flies, depth + rng.random(depth.shape) * (beside - depth), depth))
    return DepthScan(images, scan.intrinsics, scan.poses)


def tracked(subject: Subject, scans: Iterable[Scan]) -> NDArray[np.float64]:
    """Return the error and the seconds of each frame: (n, 2)."""
    tracker = Tracker(subject.faces, subject.vertices[0])
    return followed(subject, scans, lambda _, scan: push_scan(tracker, scan))


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


def rows_of(subject: Subject, n: int) -> Line:
    """Return the row of a subject and a number of cameras."""
    around = losses.orbit(subject.box, n, distance=FAR, up=subject.up_vector)
    cameras = around(0)  # in all frames
    scan = partial(
        losses.scan_points, faces=subject.faces, cameras=cameras, points=POINTS, noise=NOISE
    )
    still = replace(subject, vertices=np.repeat(subject.vertices[:1], subject.n_frames, axis=0))
    at_rest = tracked(still, scan(still.vertices[1:]))[:, 0]
    clean = list(scan(subject.vertices[1:]))
    moving = tracked(subject, clean)
    depth = depth_scans(subject, cameras)

    def mean(scans: Iterable[Scan]) -> str:
        return number(float(tracked(subject, scans)[:, 0].mean()))

    return (
        subject.name,
        str(n),
        number(float(at_rest[:3][-1])),
        number(float(at_rest[-1])),
        number(float(moving[:, 0].mean())),
        mean(scan(subject.vertices[1:], outliers=0.05)),
        mean(with_floor(one, subject) for one in clean),
        mean(with_second(one, subject) for one in clean),
        mean(depth),
        mean(with_flying_pixels(one, subject) for one in depth),
        number(float(np.median(moving[:, 1]) / seconds_of_query())),
    )


def cloth(path: Path) -> Line:
    """Return the row of the recorded cloth."""
    with np.load(path) as stored:
        points, offsets = stored["points"].astype(np.float64), stored["offsets"]
        template: Positions = stored["template_vertices"].astype(np.float64)
        faces = stored["template_faces"]
    tracker = Tracker(faces, template)
    for first, end in pairwise(offsets):
        tracked = tracker.push(points[first:end], viewpoints=np.zeros((1, 3)))
    mesh = trimesh.Trimesh(tracked, faces, process=False)
    last = points[offsets[-2] :]
    fine = mesh.subdivide().subdivide()
    nearest = cKDTree(fine.vertices).query(last)[1]
    off = last - fine.vertices[nearest]
    distance = np.abs((off * fine.vertex_normals[nearest]).sum(axis=1))
    edges = mesh.edges_unique
    now, before = (
        np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1) for x in (tracked, template)
    )
    held = np.linalg.norm(tracked[list(HELD)] - template[list(HELD)], axis=1)
    kept = np.mean(np.abs(now / before - 1) < 0.1)
    return number(1e3 * float(np.median(distance))), f"{kept:.1%}", number(1e3 * float(held.max()))


def tables(arguments: argparse.Namespace) -> list[Table]:
    """How well a mesh is tracked at rest, in motion, and with other things in its scans."""
    lines: list[Line] = [
        ("sequence", "cameras", "still, third", "still, last", "moving", "outliers", "floor",
         "second subject", "depth", "flying pixels", "queries")
    ]  # fmt: skip
    for subject in sequences(arguments, 21):
        lines += [rows_of(subject, n) for n in arguments.cameras]
    found = [Table("tracking-conditions", lines)]
    if arguments.cloth:
        head = ("points to surface, mm", "edges within 10 %", "corners, mm")
        found.append(Table("tracking-cloth", [head, cloth(arguments.cloth)]))
    return found
