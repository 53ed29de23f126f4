"""What the benchmarks of tracking share: how a scan is tracked, and errors."""

import numpy as np
from numpy.typing import NDArray

from dynmesh import Tracker
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.scans import PointScan, Scan
from dynmesh.sequence import Positions

from .subjects import Subject


def push(tracker: Tracker, scan: Scan) -> Positions:
    """Track a scan."""
    if isinstance(scan, PointScan):
        return tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
    return tracker.push_depth(scan.depth, scan.intrinsics, scan.poses)


def errors(subject: Subject, tracked: Positions, truth: Positions) -> NDArray[np.float64]:
    """Return (k,) distances from the true vertices, in mean edges of frame 0 of a subject."""
    edge = mean_edge_of(subject.vertices[0], subject.faces)
    return np.asarray(np.linalg.norm(tracked - truth, axis=1) / edge)
