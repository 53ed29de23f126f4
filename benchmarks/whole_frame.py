"""Measures how near to the truth a whole frame is that is put together from incomplete ones.

    script/reproduce whole-frame FOLDER [NAME[:FRAMES] ...]

No frame is whole: all have lost vertices. The errors are those of the vertices that the frame lacks
and others know, in mean edges. The smooth fill is what one frame gives alone. The last columns
compare the sequence completed from the result with that completed from the true frame.
"""

import argparse
import time
from dataclasses import replace

import numpy as np

import dynmesh
from dynmesh._arrays import Mask, Positions
from dynmesh.metrics import vertex_error
from dynmesh.topology import mean_edge_of

from .harness import Line, Table, progress, sequences
from .subjects import Subject, losses_of

MOST_FRAMES = 51
"""Frame 0 loses nothing and is left out."""


def completed(subject: Subject, known: Mask, start: int, points: Positions) -> Positions:
    """The frames completed from one of them, forwards and backwards."""
    made = subject.vertices.copy()
    made[start] = points
    for numbers in (range(start + 1, len(made)), range(start - 1, -1, -1)):
        completer = dynmesh.Completer(subject.faces, points)
        for number in numbers:
            completer.push(subject.vertices[number], known[number], out=made[number])
    return made


def line(subject: Subject, loss: str, known: Mask) -> Line:
    """The row of a loss."""
    began = time.perf_counter()
    whole = dynmesh.whole_frames.whole_frame(subject.faces, subject.vertices, known)
    seconds = time.perf_counter() - began
    here, truth = whole.frame, subject.vertices[whole.frame]
    edge = mean_edge_of(truth, subject.faces)
    alone = dynmesh.whole_frames.whole_frame(
        subject.faces, subject.vertices[here : here + 1], known[[here]]
    )
    fused = whole.seen & ~whole.known
    off = vertex_error(truth, whole.positions)
    filled = vertex_error(truth, alone.positions)
    ours, theirs = (
        vertex_error(subject.vertices, completed(subject, known, here, start))[:, whole.seen].mean()
        for start in (whole.positions, truth)
    )
    inside = off[fused] <= 2.5 * whole.standard_error[fused]
    if not fused.any():  # the frame is whole, or no other one knows what it lacks
        of_fused = ("-", "-", "-")
    else:
        errors = (off[fused].mean() / edge, filled[fused].mean() / edge, inside.mean())
        of_fused = (f"{errors[0]:.4f}", f"{errors[1]:.3f}", f"{errors[2]:.2f}")
    return (
        subject.name, loss, f"{100 * whole.known.mean():.0f} %", f"{100 * whole.seen.mean():.0f} %",
        *of_fused, "yes" if whole.doubtful else "no", f"{ours / theirs:.2f}", f"{seconds:.1f}",
    )  # fmt: skip


def tables(arguments: argparse.Namespace) -> list[Table]:
    """How near to the truth a whole frame is that is put together from incomplete ones."""
    head = ("sequence", "known", "known in the frame", "in any frame", "error", "smooth fill",
            "within 2.5 standard errors", "doubtful", "completed from it / from the truth",
            "seconds")  # fmt: skip
    rows: list[Line] = []
    for subject in sequences(arguments, MOST_FRAMES):
        kinds = losses_of(subject, (0.3, 0.9))
        short = replace(subject, vertices=subject.vertices[1:])
        for loss, masks in progress(kinds.items(), subject.name):
            rows.append(line(short, loss, np.array(masks[1:])))
    return [Table("whole-frame", [head, *rows])]
