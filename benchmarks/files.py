"""Measures files that are completed from both sides, and whole frames that are put together.

    script/reproduce both-sides|whole-frame FOLDER [NAME[:FRAMES] ...]

Errors are distances from the true position, in mean edges: from both sides, where frame 0 is whole,
of all vertices that were lost; of a frame that is put together, where none is whole, of those that
it lacks and others know. The intervals are those within which 90 % of them are expected to be. The
smooth fill is what one frame gives alone. The last columns compare the sequence completed from the
result with that completed from the true frame.
"""

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import dynmesh
from dynmesh._arrays import Mask, Positions
from dynmesh.metrics import vertex_error
from dynmesh.topology import mean_edge_of

from .harness import Line, Table, progress, sequences
from .subjects import Subject, losses_of


def _both_sides(subject: Subject, loss: str, known: Mask, folder: Path) -> Line:
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


def both_sides(arguments: argparse.Namespace) -> list[Table]:
    """How much smaller errors are when files are completed from both sides."""
    head = ("sequence", "known", "error forwards", "from both sides", "ratio",
            "within 2.5 standard errors", "times as long")  # fmt: skip
    rows: list[Line] = []
    with tempfile.TemporaryDirectory() as folder:
        for subject in sequences(arguments, 50):
            for loss, masks in progress(losses_of(subject, (0.1, 0.3)).items(), subject.name):
                rows.append(_both_sides(subject, loss, np.array(masks), Path(folder)))
    ratios = [float(row[4]) for row in rows]
    mean, worst = np.exp(np.log(ratios).mean()), max(ratios)
    rows.append(("geometric mean", "", "", "", f"{mean:.2f}", "", ""))
    rows.append(("worst", "", "", "", f"{worst:.2f}", "", ""))
    return [Table("both-sides", [head, *rows])]


def completed(subject: Subject, known: Mask, start: int, points: Positions) -> Positions:
    """The frames completed from one of them, forwards and backwards."""
    made = subject.vertices.copy()
    made[start] = points
    for numbers in (range(start + 1, len(made)), range(start - 1, -1, -1)):
        completer = dynmesh.Completer(subject.faces, points)
        for number in numbers:
            completer.push(subject.vertices[number], known[number], out=made[number])
    return made


def _whole_frame(subject: Subject, loss: str, known: Mask) -> Line:
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


def whole_frame(arguments: argparse.Namespace) -> list[Table]:
    """How near to the truth a whole frame is that is put together from incomplete ones."""
    head = ("sequence", "known", "known in the frame", "in any frame", "error", "smooth fill",
            "within 2.5 standard errors", "doubtful", "completed from it / from the truth",
            "seconds")  # fmt: skip
    rows: list[Line] = []
    for subject in sequences(arguments, 51):  # frame 0 loses nothing and is left out
        kinds = losses_of(subject, (0.3, 0.9))
        short = replace(subject, vertices=subject.vertices[1:])
        for loss, masks in progress(kinds.items(), subject.name):
            rows.append(_whole_frame(short, loss, np.array(masks[1:])))
    return [Table("whole-frame", [head, *rows])]
