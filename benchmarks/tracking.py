"""What the benchmarks of tracking share: cameras around a subject, scans, and errors."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dynmesh import Tracker, degrade
from dynmesh.degrade import Camera
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.scans import DepthScan, PointScan, Scan
from dynmesh.sequence import Positions

from .subjects import Subject

POINTS = 20_000
NOISE = 0.02
"""In mean edges of the first frame."""


def around(subject: Subject, frames: Positions, n: int, turn: float = 0.0) -> list[Camera]:
    """Return cameras around everywhere that the subject goes, turned by some degrees."""
    box = np.stack([frames.min(axis=(0, 1)), frames.max(axis=(0, 1))])
    return degrade.orbit(box, n, degrees_per_frame=turn, up=subject.up_vector)(1)


def point_scans(subject: Subject, frames: Positions, cameras: list[Camera]) -> Iterator[PointScan]:
    """Yield 20 000 points of each frame."""
    return degrade.scan_points(frames, subject.faces, cameras, points=POINTS, noise=NOISE)


def depth_scans(subject: Subject, frames: Positions, cameras: list[Camera]) -> Iterator[DepthScan]:
    """Yield depth images of each frame, of 640 x 480 pixels."""
    return degrade.depth_images(frames, subject.faces, cameras, noise=NOISE)


def push(tracker: Tracker, scan: Scan) -> Positions:
    """Track a scan."""
    if isinstance(scan, PointScan):
        return tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
    return tracker.push_depth(scan.depth, scan.intrinsics, scan.poses)


def errors(subject: Subject, tracked: Positions, truth: Positions) -> NDArray[np.float64]:
    """Return (k,) distances from the true vertices, in mean edges of frame 0 of a subject."""
    edge = mean_edge_of(subject.vertices[0], subject.faces)
    return np.asarray(np.linalg.norm(tracked - truth, axis=1) / edge)


def taken(subject: Subject, frames: int, *, training: bool) -> tuple[Subject, Positions | None]:
    """Return the frames to scan, and the first half of a sequence, if it is to be trained."""
    if not training:
        return replace(subject, vertices=subject.vertices[:frames]), None
    half = subject.n_frames // 2
    second = subject.vertices[half : half + frames]
    return replace(subject, vertices=second), subject.vertices[:half]
