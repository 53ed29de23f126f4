"""Measures how much smaller errors are when files are completed from both sides.

    script/reproduce both-sides FOLDER [NAME[:FRAMES] ...]

Frame 0 is whole. The errors are distances from the true position, in mean edges, of all vertices
that were lost. The intervals are those within which 90 % of them are expected to be.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

import dynmesh
from dynmesh._arrays import Mask
from dynmesh.metrics import vertex_error
from dynmesh.topology import mean_edge_of

from .harness import Line, Table, progress, sequences
from .subjects import Subject, losses_of

MOST_FRAMES = 50


def line(subject: Subject, loss: str, known: Mask, folder: Path) -> Line:
    """The row of a loss."""
    known[0] = True
    lost = ~known
    lossy, completed = folder / "lossy.npz", folder / "completed.npz"
    lossy.unlink(missing_ok=True)
    dynmesh.write(lossy, dynmesh.Sequence(subject.vertices, subject.faces, known))
    errors, seconds = [], []
    for bidirectional in (False, True):
        began = time.perf_counter()
        frames = dynmesh.complete(lossy, bidirectional=bidirectional, uncertainty=bidirectional)
        dynmesh.write(completed, frames)
        seconds.append(time.perf_counter() - began)
        made = dynmesh.read(completed)
        off = vertex_error(subject.vertices, made.vertices)[lost]
        errors.append(off.mean() / mean_edge_of(subject.vertices[0], subject.faces))
    assert made.standard_error is not None
    inside = off <= 2.5 * made.standard_error[lost]
    return (
        subject.name, loss, f"{errors[0]:.4f}", f"{errors[1]:.4f}", f"{errors[1] / errors[0]:.2f}",
        f"{inside.mean():.2f}", f"{seconds[1] / seconds[0]:.1f}",
    )  # fmt: skip


def tables(arguments: argparse.Namespace) -> list[Table]:
    """How much smaller errors are when files are completed from both sides."""
    head = ("sequence", "known", "error forwards", "from both sides", "ratio",
            "within 2.5 standard errors", "times as long")  # fmt: skip
    rows: list[Line] = []
    with tempfile.TemporaryDirectory() as folder:
        for subject in sequences(arguments, MOST_FRAMES):
            for loss, masks in progress(losses_of(subject, (0.1, 0.3)).items(), subject.name):
                rows.append(line(subject, loss, np.array(masks), Path(folder)))
    ratios = [float(row[4]) for row in rows]
    mean, worst = np.exp(np.log(ratios).mean()), max(ratios)
    rows.append(("geometric mean", "", "", "", f"{mean:.2f}", "", ""))
    rows.append(("worst", "", "", "", f"{worst:.2f}", "", ""))
    return [Table("both-sides", [head, *rows])]
