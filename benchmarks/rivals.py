"""Compares with other libraries on the built-in subjects, in a few frames of each.

    script/reproduce rivals

Completion: NMSVE of what dynmesh and libigl offer. Tracking: the mean error in mean edges of what
dynmesh and trimesh offer. The last column shows how dynmesh compares with the best of the others:
below 1, it is more accurate. A test measures the same again.
"""

import argparse
from collections.abc import Iterable
from typing import get_args

import numpy as np

from dynmesh import losses, synth

from .harness import ABSENT, Line, Table, nmsve_cell, number, progress
from .methods import ARAP_FROM_PREVIOUS, BASELINES, DETAIL, MOTION
from .runner import followed, run_all
from .subjects import Subject, losses_of
from .tracking_baselines import methods

NAMES: tuple[synth.Name, ...] = get_args(synth.Name)
COMPLETED = range(0, 25, 3)  # frames
TRACKED = range(0, 9, 4)
_POINTS = 5000
LARGEST = 5000  # vertices of subjects that are tracked; rivals take minutes for larger ones


def subjects(frames: range, names: Iterable[synth.Name] = NAMES) -> list[Subject]:
    """Return some frames of built-in subjects."""
    found = []
    for name in names:
        sequence = synth.sequence(name, frames=175 if name == "walker" else frames[-1] + 1)
        chosen = sequence.vertices[list(frames)].astype(np.float64)
        found.append(Subject(name, chosen, sequence.faces, "z", 0.0))
    return found


def completion(chosen: Iterable[Subject]) -> Table:
    """Errors of completion, and that of detail relative to the best of libigl."""
    rivals = (*BASELINES, ARAP_FROM_PREVIOUS)
    compared = (DETAIL, MOTION, *rivals)
    labels = ("detail", "motion", *(rival.label for rival in rivals))
    lines: list[Line] = [("subject", "known", *labels, "detail / best of libigl")]
    for subject in chosen:
        masks = losses_of(subject, (0.1, 0.3), ("camera",))
        found = run_all(subject, compared, masks)
        for loss in masks:
            errors = [
                found[method, loss].error if (method, loss) in found else np.nan
                for method in compared
            ]
            cells = [nmsve_cell(error) for error in errors]
            lines.append((subject.name, loss, *cells, _relative(errors[0], errors[2:])))
    return Table("rivals-completion", lines)


def tracking(chosen: Iterable[Subject]) -> Table:
    """Errors of tracking scans by four cameras, and ours relative to the best of trimesh."""
    lines: list[Line] = []
    for subject in chosen:
        if subject.n_vertices > LARGEST:
            continue
        around = losses.orbit(subject.box, 4, up=subject.up_vector)(0)
        scans = losses.scan_points(subject.vertices, subject.faces, around, points=_POINTS)
        _, *later = scans
        errors = {
            label: float(followed(subject, later, register)[:, 0].mean())
            for label, register in progress(methods(subject).items(), subject.name)
        }
        ours, *rivals = errors.values()
        lines = lines or [("subject", *errors, "dynmesh / best of trimesh")]
        cells = [number(error) for error in errors.values()]
        lines.append((subject.name, *cells, _relative(ours, rivals)))
    return Table("rivals-tracking", lines)


def _relative(ours: float, rivals: list[float]) -> str:
    return ABSENT if np.isnan(rivals).all() else f"{ours / np.nanmin(rivals):.3f}"


def tables(_: argparse.Namespace) -> list[Table]:
    """Errors on the built-in subjects, relative to those of libigl and trimesh."""
    return [completion(subjects(COMPLETED)), tracking(subjects(TRACKED))]
