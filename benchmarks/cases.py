"""Compares methods on sequences and losses, as tables.

    script/reproduce drift|methods|training|learning [FOLDER NAME[:FRAMES] ...]

Every table shows NMSVE, averaged over the frames after frame 0, times 10 000, in bounding-box
diagonals of frame 0, or relative to that of another method.
"""

import argparse
from dataclasses import replace

import numpy as np

import dynmesh

from .harness import ABSENT, Line, Table, by_row_and_column, nmsve_cell, sequences
from .methods import (
    ARAP_FROM_PREVIOUS,
    BASELINES,
    DETAIL,
    LIA_ON_MOTION,
    MOTION,
    Method,
    dynmesh_method,
    trained,
)
from .runner import Runs, run_all
from .subjects import PAPER_SHARES, Subject, losses_of

_FRAMES = 100
_TRAINING_FRAMES = 50

EXTRA = dynmesh_method(
    "motion, 10 extra iterations", "#0072b2", "--", method="motion", extra_iterations=10
)
LEARNING = dynmesh_method("detail, learning", "#882255", "-", method="detail", learn=True)


def drift(arguments: argparse.Namespace) -> list[Table]:
    """A sequence played three times, by cycle; the walker, forwards and backwards, by default."""
    walker = dynmesh.synth.walker(44)
    there_and_back = np.concatenate([walker.vertices, walker.vertices[-2:0:-1]])
    subjects = [Subject("walker", there_and_back, walker.faces, "z", 0)]
    if arguments.folder is not None:
        subjects = sequences(arguments)
    cycles = range(1, 4)
    lines: list[Line] = [("data", "known", "method", *(f"cycle {cycle}" for cycle in cycles))]
    for once in subjects:
        repeated = np.tile(once.scaled().vertices, (len(cycles), 1, 1))
        subject = replace(once, vertices=repeated)
        masks = losses_of(subject, arguments.known or (0.1,), ())
        methods = {"motion": MOTION, EXTRA.label: EXTRA, "detail": DETAIL}
        found = run_all(subject, methods.values(), masks)
        for loss in masks:
            for name, method in methods.items():
                # Frame 0 has no error. Without the first frame of each, cycles are of equal length.
                nmsve = np.concatenate([[0.0], found[method, loss].nmsve])
                by_cycle = nmsve.reshape(len(cycles), -1)[:, 1:].mean(axis=1)
                lines.append((subject.name, loss, name, *map(nmsve_cell, by_cycle)))
    return [Table("drift", lines)]


def relative_to_motion(arguments: argparse.Namespace) -> list[Table]:
    """Other methods relative to motion."""
    others = (DETAIL, LIA_ON_MOTION, *BASELINES, ARAP_FROM_PREVIOUS)
    labels = ["detail", *(method.label for method in others[1:])]
    lines: list[Line] = [("NMSVE", "known", "motion, x 1e4", *labels)]
    for subject in sequences(arguments):
        title = f"{subject.name}, {subject.n_frames} frames"
        masks = losses_of(subject, arguments.known or PAPER_SHARES, ("camera",))
        found = run_all(subject, (MOTION, *others), masks)
        for loss in masks:
            cells = [_ratio(found, loss, method, MOTION, 3) for method in others]
            lines.append((title, loss, nmsve_cell(found[MOTION, loss].error), *cells))
    return [Table("methods", lines)]


def training(arguments: argparse.Namespace) -> list[Table]:
    """Detail after training relative to that without, on the second halves of sequences.

    At most 50 frames of the first half are the training frames, evenly, and the first 50 frames of
    the second half are completed.
    """
    halves = []
    for subject in sequences(arguments):
        half = subject.n_frames // 2
        chosen = np.unique(np.linspace(0, half - 1, _TRAINING_FRAMES).astype(int))
        second = subject.vertices[half : half + _TRAINING_FRAMES]
        halves.append((replace(subject, vertices=second), trained(subject.vertices[chosen])))
    return [Table("training", _relative_to_detail(arguments, halves))]


def learning(arguments: argparse.Namespace) -> list[Table]:
    """Detail that learns from the frames that it completed, relative to that without."""
    subjects = [(subject, LEARNING) for subject in sequences(arguments, _FRAMES)]
    return [Table("learning", _relative_to_detail(arguments, subjects))]


def _relative_to_detail(
    arguments: argparse.Namespace, subjects: list[tuple[Subject, Method]]
) -> list[Line]:
    cells = {}
    for subject, method in subjects:
        masks = losses_of(subject, arguments.known or (0.1, 0.3))
        found = run_all(subject, (DETAIL, method), masks)
        for loss in masks:
            cells[subject.name, loss] = _ratio(found, loss, method, DETAIL, 2)
    return by_row_and_column("sequence", cells)


def _ratio(found: Runs, loss: str, method: Method, reference: Method, digits: int) -> str:
    error = found[reference, loss].error
    if (method, loss) not in found or error == 0:
        return ABSENT
    return f"{found[method, loss].error / error:.{digits}f}"
