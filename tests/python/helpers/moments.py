"""Subjects that move in scans, with what else happens: of each frame its truth and its scan."""

from typing import Any, NamedTuple

import numpy as np
from meshes import Array, Mesh
from scans_of_meshes import TORUS, edge, scan_of
from scipy.spatial.transform import Rotation

import dynmesh

N_POINTS = 4000


class Moment(NamedTuple):
    """A frame: where the subject is, and what is given to a tracker.

    Attributes:
        truth: (k, 3), in the mean edges of the template.
        scan: the arguments of Tracker.push.
        images: those of Tracker.push_depth, instead.
    """

    truth: Array
    scan: tuple[Any, ...] = ()
    viewpoints: Array | None = None
    images: tuple[Any, ...] = ()

    def pushed(self, tracker: dynmesh.Tracker) -> Array:
        if self.images:
            return np.asarray(tracker.push_depth(*self.images))
        return np.asarray(tracker.push(*self.scan, viewpoints=self.viewpoints))


class Subject:
    """A mesh in units of its mean edge, and the frames in which it moves."""

    def __init__(self, name: str, n: int = 12) -> None:
        if name == "torus":
            self.faces, frames = TORUS.faces, np.stack([TORUS.vertices] * n)
        else:
            made = dynmesh.synth.sequence(name)  # type: ignore[arg-type]
            self.faces = made.faces.astype(np.int64)
            frames = made.vertices[:n].astype(np.float64)
        self.mesh = Mesh(self.faces, frames[0])
        self.frames = frames / edge(self.mesh)
        self.mesh = Mesh(self.faces, self.frames[0])
        self.size = float(np.ptp(self.frames[0], axis=0).max())


def turned(degrees: float, points: Array, axis: str = "z") -> Array:
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    turn = Rotation.from_euler(axis, degrees, degrees=True)
    return np.asarray(turn.apply(points - middle) + middle)


def measured(subject: Subject, truth: Array, rng: np.random.Generator, n: int = N_POINTS) -> Moment:
    """Points on all sides, with normals."""
    return Moment(truth, scan_of(Mesh(subject.faces, truth), truth, n, rng, noise=0.05))


def among(moment: Moment, points: Array, normals: Array) -> Moment:
    """The same moment, with points of something else."""
    ours, directions = moment.scan
    both = np.concatenate([ours, points]), np.concatenate([directions, normals])
    return moment._replace(scan=both)


def plane(middle: Array, size: float, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """The top of a table."""
    points = middle + size * rng.uniform(-1, 1, (n, 3)) * [1, 1, 0]
    return points, np.tile([0.0, 0, 1], (n, 1))


def garbage(_: Subject, truth: Array, rng: np.random.Generator) -> Moment:
    """Points anywhere around the subject."""
    low, high = truth.min(axis=0), truth.max(axis=0)
    spare = 0.2 * (high - low)
    return Moment(truth, (rng.uniform(low - spare, high + spare, (N_POINTS, 3)), None))
