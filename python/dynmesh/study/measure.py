"""Runs methods over sequences, and measures their time and error."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import metrics
from ..sequence import Mask, Positions
from .completion import Method
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
        prior_weight: how far a training sequence was used, from 0 to 1.
        frames: the completed frames that were to be kept, by number.
        masks: the known masks of these frames.
        complete: whether every position of every frame is finite.
    """

    nmsve: Floats
    seconds: Floats
    iterations: NDArray[np.int64]
    unknown: NDArray[np.int64]
    prior_weight: Floats
    frames: dict[int, Positions]
    masks: dict[int, Mask]
    complete: bool = True

    @classmethod
    def of(cls, n: int) -> "Run":
        """Return a run of n frames after frame 0, of which nothing has been measured."""
        none = np.zeros(n, np.int64)
        return cls(np.full(n, np.nan), np.zeros(n), none, none.copy(), np.zeros(n), {}, {})

    def summary(self) -> dict[str, float]:
        """Return what results.json contains of a run, NMSVE in bounding-box diagonals."""
        error = {
            "nmsve_mean": float(self.nmsve.mean()),
            "nmsve_p10": float(np.percentile(self.nmsve, 10)),
            "nmsve_p90": float(np.percentile(self.nmsve, 90)),
            "nmsve_last": float(self.nmsve[-1]),
        }
        measured = {} if np.isnan(self.nmsve).any() else error
        return measured | {
            "milliseconds_median": float(1e3 * np.median(self.seconds)),
            "milliseconds_p25": float(1e3 * np.percentile(self.seconds, 25)),
            "milliseconds_p75": float(1e3 * np.percentile(self.seconds, 75)),
            "iterations_mean": float(self.iterations.mean()),
            "unknown_mean": float(self.unknown.mean()),
            "prior_weight_mean": float(self.prior_weight.mean()),
        }


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
    result = Run.of(n)
    kept = set(keep)
    completion = method.begin(subject.faces, subject.vertices[0])
    waiting: list[Positions] = []
    for number, known in enumerate(masks):
        if number == 0:
            continue
        points = subject.vertices[number]
        start = clock()
        frame = completion.complete(points, known)
        seconds = clock() - start
        result.seconds[number - 1] = completion.seconds or seconds
        completed = frame.astype(points.dtype)  # a copy, as the method may overwrite the frame
        result.iterations[number - 1] = completion.iterations
        result.prior_weight[number - 1] = completion.prior_weight
        result.unknown[number - 1] = len(known) - np.count_nonzero(known)
        if number in kept:
            result.frames[number] = completed
            result.masks[number] = known
        result.complete = result.complete and bool(np.isfinite(completed).all())
        waiting.append(completed)
        if len(waiting) == _FRAMES_AT_ONCE or number == n:
            if with_error:
                first = number - len(waiting)
                result.nmsve[first:number] = nmsve(subject, range(first + 1, number + 1), waiting)
            waiting = []
    return result


def nmsve(subject: Subject, numbers: Iterable[int], completed: list[Positions]) -> Floats:
    """Return the NMSVE of completed frames, by their numbers, in bounding-box diagonals."""
    truth = subject.vertices[list(numbers)]
    return np.asarray(metrics.nmsve(subject.faces, truth, np.stack(completed)) / subject.diagonal)


def vertex_error(subject: Subject, number: int, completed: Positions) -> Floats:
    """Return the (k,) distances from the true positions in bounding-box diagonals."""
    truth = subject.vertices[number]
    return np.asarray(metrics.vertex_error(truth, completed) / subject.diagonal)
