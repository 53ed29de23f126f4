"""Measures how well the standard errors of method detail describe its errors, as a table.

    script/reproduce calibration FOLDER [NAME ...] [--frames 100]

Vertices are known at random (10 % and 30 %), seen by a circling camera, or hidden by patches (30 %,
each for ten frames). The table shows the shares of the filled-in vertices whose error is within the
intervals of 50 % and of 90 %.
"""

import argparse

import numpy as np

from dynmesh import Completer, losses
from dynmesh._arrays import Mask
from dynmesh.verbs.evaluate import Calibrating, Calibration

from .harness import Table, by_row_and_column, progress, sequences
from .subjects import Subject, losses_of

LIFETIME = 10


def cases(subject: Subject) -> dict[str, list[Mask]]:
    """Return the known masks by the name of the case."""
    shape = (subject.n_frames, subject.n_vertices)
    patches = losses.patch_known(subject.faces, *shape, 0.3, lifetime=LIFETIME)
    return losses_of(subject, (0.1, 0.3), ("camera",)) | {"patches": list(patches)}


def calibrated(subject: Subject, masks: list[Mask]) -> Calibration | None:
    """Complete the frames after frame 0, and compare; None if nothing was filled in."""
    completer = Completer(subject.faces, subject.vertices[0], method="detail", uncertainty=True)
    calibrating = Calibrating()
    for points, known in zip(subject.vertices[1:], masks[1:], strict=True):
        frame = completer.push(points, known)
        error = np.linalg.norm(frame.astype(np.float64) - points, axis=1)
        calibrating.add(error, completer.standard_error, filled=completer.generation > 0)
    return calibrating.result()


def tables(arguments: argparse.Namespace) -> list[Table]:
    """How well the standard errors of method detail describe its errors."""
    cells: dict[tuple[str, str], str] = {}
    for subject in sequences(arguments, 100):
        for case, masks in progress(cases(subject).items(), subject.name):
            if (found := calibrated(subject, masks)) is not None:
                cells[subject.name, case] = f"{found.coverage_50:.2f}, {found.coverage_90:.2f}"
    return [Table("calibration", by_row_and_column("sequence", cells))]
