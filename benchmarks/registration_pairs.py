"""Pairs of a template and a scan: made from a sequence, or read from a folder."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import dynmesh
from dynmesh import degrade
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.scans import PointScan
from dynmesh.sequence import Positions
from dynmesh.tracking.single_scan import open_single

from .subjects import Subject
from .tracking import around

POINTS = 20_000
NOISE = 0.05
OUTLIERS = 0.05
SCANS = ("whole", "4 cameras", "1 camera", "half", "outliers")

_WORDS = (("src", "tar"), ("src", "tgt"), ("source", "target"), ("template", "scan"))
"""In the names of files, what differs between a template and its scan."""


class Pair(NamedTuple):
    """A template, a scan, and where the vertices are in it.

    Attributes:
        subject: of which frame 0 is the template.
        scan: the points.
        truth: (k, 3) the true positions, or None if they are not known.
        kind: what the scan shows, one of SCANS.
        pose: what is said of the pose.
    """

    subject: Subject
    scan: PointScan
    truth: Positions | None
    kind: str
    pose: str


def near_and_far(subject: Subject) -> dict[str, int]:
    """Return a frame in which the shape is near that of frame 0, and one in which it is far.

    They are those at the tenth part and at nine tenths of all frames, by how far vertices are from
    frame 0 after the best rigid motion.
    """
    first = subject.vertices[0].astype(np.float64)
    off = []
    for frame in subject.vertices[1:].astype(np.float64):
        arms = first - first.mean(axis=0), frame - frame.mean(axis=0)
        turned = Rotation.align_vectors(arms[1], arms[0])[0].apply(arms[0])
        off.append(np.linalg.norm(turned - arms[1], axis=1).mean())
    order = 1 + np.argsort(off)
    return {"near": int(order[len(order) // 10]), "far": int(order[9 * len(order) // 10])}


def of_sequence(subject: Subject, pose: str, frame: int, kinds: list[str]) -> Iterator[Pair]:
    """Yield a pair for each kind of scan of a frame."""
    rng = np.random.default_rng(frame)
    truth = subject.vertices[frame].astype(np.float64)
    edge = mean_edge_of(subject.vertices[0], subject.faces)
    whole = spread(subject, truth, rng)
    for kind in kinds:
        scan = whole
        if kind.endswith(("camera", "cameras")):
            cameras = around(subject, truth[None], int(kind.split()[0]), float(frame))
            (scan,) = degrade.scan_points(
                [truth], subject.faces, cameras, points=POINTS, noise=0.02
            )
        if kind == "half":
            along = whole.points @ rng.standard_normal(3)
            kept = along > np.median(along)
            assert whole.normals is not None
            scan = PointScan(whole.points[kept], whole.normals[kept], None)
        if kind == "outliers":
            far = rng.random(len(whole.points)) < OUTLIERS
            points = whole.points.copy()
            points[far] += 10 * edge * rng.standard_normal((int(far.sum()), 3))
            scan = PointScan(points, whole.normals, None)
        yield Pair(subject, scan, truth, kind, pose)


def spread(subject: Subject, positions: Positions, rng: np.random.Generator) -> PointScan:
    """Return points spread over the surface, with normals and noise."""
    corners = positions[subject.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    chosen = rng.choice(len(areas), POINTS, p=areas / areas.sum())
    points = np.einsum("nc,ncx->nx", rng.dirichlet([1, 1, 1], POINTS), corners[chosen])
    noise = NOISE * mean_edge_of(subject.vertices[0], subject.faces)
    points += noise * rng.standard_normal(points.shape)
    return PointScan(points, normals[chosen] / areas[chosen, None], None)


def of_folder(folder: Path) -> Iterator[Pair]:
    """Yield the pairs of files of which the names differ by src and tar, tgt, or the like.

    The true positions are not known.

    Raises:
        ValueError: there are none.
    """
    any_found = False
    for file in sorted(path for path in folder.rglob("*") if path.is_file()):
        for ours, theirs in _WORDS:
            if ours not in file.stem:
                continue
            wanted = file.stem.replace(ours, theirs)
            for other in sorted(file.parent.glob(f"{wanted}.*")):
                template = dynmesh.read(file)
                name = str(file.relative_to(folder))
                subject = Subject(name, template.vertices[:1], template.faces, "z", 0.0)
                (scan,) = open_single(other, None)
                if isinstance(scan, PointScan):
                    any_found = True
                    yield Pair(subject, scan, None, "whole", "given")
    if not any_found:
        raise ValueError(f"{folder}: has no pairs of files such as man_src.obj and man_tar.ply")
