"""Runs methods over the losses of a sequence, and measures their time and error."""

import sys
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from dynmesh import metrics
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.sequence import Mask, Positions

from .harness import progress
from .methods import Method
from .subjects import Subject

Floats = NDArray[np.float64]

_FRAMES_AT_ONCE = 32  # measured together, because each call builds the cells anew


@dataclass(eq=False)
class Run:
    """One method on one sequence; entry i belongs to frame i + 1.

    Attributes:
        nmsve: NMSVE in bounding-box diagonals, or NaN if it was not measured.
        seconds: the time of the method alone.
        iterations: the number of iterations, or 0 if the method does not iterate.
        unknown: the number of unknown vertices.
        frames: the completed frames that were to be kept, by number.
        masks: the known masks of these frames.
        complete: whether every position of every frame is finite.
    """

    nmsve: Floats
    seconds: Floats
    iterations: NDArray[np.int64]
    unknown: NDArray[np.int64]
    frames: dict[int, Positions]
    masks: dict[int, Mask]
    complete: bool = True

    @property
    def error(self) -> float:
        """The mean NMSVE."""
        return float(self.nmsve.mean())

    @property
    def usual_seconds(self) -> float:
        """The median time of a frame."""
        return float(np.median(self.seconds))


Runs = dict[tuple[Method, str], Run]
"""The runs on a sequence, by the method and the name of the loss."""


def run(
    subject: Subject,
    method: Method,
    masks: Iterable[Mask],
    *,
    keep: Iterable[int] = (),
    with_error: bool = True,
    clock: Callable[[], float] = time.thread_time,
) -> Run:
    """Complete the frames after frame 0, and measure.

    Args:
        subject: the sequence.
        method: the method.
        masks: (k,) bool for every frame, that of frame 0 included.
        keep: the numbers of the frames to keep.
        with_error: whether NMSVE is measured.
        clock: tells the seconds, by default the processor time.

    Raises:
        ImportError, ValueError, RuntimeError: the method cannot complete the sequence.
    """
    n = subject.n_frames - 1
    none = np.zeros(n, np.int64)
    result = Run(np.full(n, np.nan), np.zeros(n), none, none.copy(), {}, {})
    kept = set(keep)
    complete = method.begin(subject.faces, subject.vertices[0])
    waiting: list[Positions] = []
    for number, known in enumerate(masks):
        if number == 0:
            continue
        points = subject.vertices[number]
        start = clock()
        frame, result.iterations[number - 1] = complete(points, known)
        result.seconds[number - 1] = clock() - start
        completed = frame.astype(points.dtype)  # a copy, as the method may overwrite the frame
        result.unknown[number - 1] = len(known) - np.count_nonzero(known)
        if number in kept:
            result.frames[number] = completed
            result.masks[number] = known
        result.complete = result.complete and bool(np.isfinite(completed).all())
        waiting.append(completed)
        if len(waiting) == _FRAMES_AT_ONCE or number == n:
            if with_error:
                first = number - len(waiting) + 1
                truth = subject.vertices[first : number + 1]
                nmsve = metrics.nmsve(subject.faces, truth, np.stack(waiting))
                result.nmsve[first - 1 : number] = nmsve / subject.diagonal
            waiting = []
    return result


def run_all(
    subject: Subject,
    methods: Iterable[Method],
    losses: Mapping[str, list[Mask]],
    *,
    keep: Iterable[int] = (),
) -> Runs:
    """Run every method with every loss; what cannot run is left out, with a message.

    Methods of libraries that are not installed cannot run, nor those that find no solution.
    """
    found: Runs = {}
    kept = list(keep)
    cases = list(product(losses.items(), methods))
    for (loss, masks), method in progress(cases, subject.name):
        try:
            found[method, loss] = run(subject, method, masks, keep=kept)
        except (ImportError, RuntimeError) as error:
            print(f"{subject.name}, {loss}: {method.label} is left out: {error}", file=sys.stderr)
    return found


def vertex_error(subject: Subject, number: int, completed: Positions) -> Floats:
    """Return the (k,) distances from the true positions in bounding-box diagonals."""
    truth = subject.vertices[number]
    return np.asarray(metrics.vertex_error(truth, completed) / subject.diagonal)


def edge_errors(subject: Subject, tracked: Positions, truth: Positions) -> Floats:
    """Return (k,) distances from the true vertices, in mean edges of frame 0 of a subject."""
    edge = mean_edge_of(subject.vertices[0], subject.faces)
    return np.asarray(np.linalg.norm(tracked - truth, axis=1) / edge)
