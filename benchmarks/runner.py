"""Runs methods over the losses of a sequence, and measures their time and error."""

import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from dynmesh import metrics
from dynmesh._arrays import Mask, Positions
from dynmesh.scans import Scan
from dynmesh.topology import mean_edge_of

from .harness import progress
from .methods import Method
from .subjects import Subject

Floats = NDArray[np.float64]
S = TypeVar("S", bound=Scan)


@dataclass(eq=False)
class Run:
    """One method on one sequence; entry i belongs to frame i + 1.

    Attributes:
        nmsve: NMSVE in bounding-box diagonals, NaN where a position is not finite.
        seconds: the time of the method alone, usually of the processor.
        iterations: the number of iterations, or 0 if the method does not iterate.
        frames: the completed frames that were to be kept, by number.
    """

    nmsve: Floats
    seconds: Floats
    iterations: NDArray[np.int64]
    frames: dict[int, Positions]

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
    masks: Sequence[Mask],
    *,
    keep: Iterable[int] = (),
    clock: Callable[[], float] = time.thread_time,
) -> Run:
    """Complete the frames after frame 0, and measure.

    There is a mask, (k,) bool, for every frame, that of frame 0 included. Some frames are kept, by
    number. The clock returns seconds; the default is the processor time of the calling thread.
    """
    truth = subject.vertices[1:]
    completed = np.empty_like(truth)
    seconds, iterations = np.zeros(len(truth)), np.zeros(len(truth), np.int64)
    complete = method.begin(subject.faces, subject.vertices[0])
    for i, (points, known) in enumerate(zip(truth, masks[1:], strict=True)):
        start = clock()
        frame, iterations[i] = complete(points, known)
        seconds[i] = clock() - start
        completed[i] = frame
    nmsve = metrics.nmsve(subject.faces, truth, completed) / subject.diagonal
    return Run(nmsve, seconds, iterations, {n: completed[n - 1].copy() for n in keep})


def run_all(
    subject: Subject,
    methods: Iterable[Method],
    losses: Mapping[str, list[Mask]],
    *,
    keep: Sequence[int] = (),
) -> Runs:
    """Run every method with every loss; what cannot run is left out, with a message.

    Methods of libraries that are not installed cannot run, nor those that find no solution.
    """
    found: Runs = {}
    cases = list(product(losses.items(), methods))
    for (loss, masks), method in progress(cases, subject.name):
        try:
            found[method, loss] = run(subject, method, masks, keep=keep)
        except (ImportError, RuntimeError) as error:
            print(f"{subject.name}, {loss}: {method.label} is left out: {error}", file=sys.stderr)
    return found


def vertex_error(subject: Subject, number: int, completed: Positions) -> Floats:
    """Return the (k,) distances from the true positions in bounding-box diagonals."""
    truth = subject.vertices[number]
    return np.asarray(metrics.vertex_error(truth, completed) / subject.diagonal)


def followed(
    subject: Subject, scans: Iterable[S], track: Callable[[Positions, S], Positions]
) -> Floats:
    """Track the frames after frame 0, each from the mesh of the last one and a scan.

    Returns (n, 2), for each frame the mean error in mean edges of frame 0, and the seconds.
    """
    edge, last, rows = mean_edge_of(subject.vertices[0], subject.faces), subject.vertices[0], []
    for truth, scan in zip(subject.vertices[1:], scans, strict=True):
        start = time.perf_counter()
        last = track(last, scan)
        seconds = time.perf_counter() - start
        rows.append((metrics.vertex_error(truth, last).mean() / edge, seconds))
    return np.array(rows)
