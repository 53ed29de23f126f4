"""Compares with other libraries on the built-in subjects, and on some of its own, in few frames.

    script/reproduce rivals

Completion: NMSVE of what dynmesh and libigl offer. Tracking: the mean error in mean edges of what
dynmesh and trimesh offer. The last column shows how dynmesh compares with the best of the others:
below 1, it is more accurate. A test measures the same again.
"""

import argparse
from collections.abc import Iterable, Iterator
from typing import get_args

import numpy as np

from dynmesh import losses, synth
from dynmesh._arrays import Mask

from .harness import ABSENT, Line, Table, nmsve_cell, number, progress
from .methods import ARAP_FROM_PREVIOUS, BASELINES, DETAIL, MOTION
from .runner import followed, run_all
from .subjects import Subject, deep_holes, flippers, losses_of
from .tracking import methods

NAMES: tuple[synth.Name, ...] = get_args(synth.Name)
COMPLETED = range(0, 25, 3)  # frames
CLOTHS = {"cloth 30 x 30": (30, 1), "cloth 45 x 45": (45, 2)}  # vertices along a side, and a seed
TRACKED = range(0, 9, 4)
POINTS = 5000
LARGEST = 5000  # vertices of subjects that are tracked; rivals take minutes for larger ones
COMPLETED_NAMES = (*NAMES, *CLOTHS, "flippers")

Case = tuple[Subject, dict[str, list[Mask]]]
"""A subject and the known masks of its frames, by the names of the losses."""


def subjects(frames: range, names: Iterable[synth.Name] = NAMES) -> list[Subject]:
    """Return some frames of built-in subjects."""
    found = []
    for name in names:
        sequence = synth.sequence(name, frames=175 if name == "walker" else frames[-1] + 1)
        chosen = sequence.vertices[list(frames)].astype(np.float64)
        found.append(Subject(name, chosen, sequence.faces, "z", 0.0))
    return found


def cloth(name: str) -> Subject:
    """Return some frames of a cloth of another size."""
    grid, seed = CLOTHS[name]
    sequence = synth.cloth(COMPLETED[-1] + 1, grid=grid, seed=seed)
    return Subject(name, sequence.vertices[COMPLETED].astype(np.float64), sequence.faces, "z", 0.0)


def cases(names: Iterable[str]) -> Iterator[Case]:
    """Yield what is completed of subjects of these names."""
    for name in names:
        if name == "flippers":
            subject = flippers()
            yield subject, {"deep holes": deep_holes(subject)}
        else:
            built_in = subjects(COMPLETED, [known for known in NAMES if known == name])
            subject = cloth(name) if name in CLOTHS else built_in[0]
            yield subject, losses_of(subject, (0.1, 0.3), ("camera",))


def completion(chosen: Iterable[Case]) -> Table:
    """Errors of completion, and that of detail relative to the best of libigl."""
    rivals = (*BASELINES, ARAP_FROM_PREVIOUS)
    compared = (DETAIL, MOTION, *rivals)
    labels = ("detail", "motion", *(rival.label for rival in rivals))
    lines: list[Line] = [("subject", "known", *labels, "detail / best of libigl")]
    for subject, masks in chosen:
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
        scans = losses.scan_points(subject.vertices, subject.faces, around, points=POINTS)
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
    return [completion(cases(COMPLETED_NAMES)), tracking(subjects(TRACKED))]
