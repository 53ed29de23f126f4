"""Runs methods over sequences, and measures their time and error."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import metrics
from ..sequence import Mask, Positions
from .completion import Completion, Method, OfflineMethod
from .subjects import Subject

Floats = NDArray[np.float64]

_FRAMES_AT_ONCE = 32  # measured together, because each call builds the cells anew


@dataclass(eq=False)
class Run:
    """One method on one sequence; entry i belongs to frame i + 1.

    Attributes:
        nmsve: NMSVE in bounding-box diagonals, or NaN if it was not measured.
        seconds: the processor time of the method alone, which runs in one thread.
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
    advance: Callable[[int], object] = lambda _: None,
    with_error: bool = True,
) -> Run:
    """Complete the frames after frame 0, and measure.

    Args:
        subject: the sequence.
        method: the method.
        masks: (k,) bool for every frame, that of frame 0 included.
        keep: the numbers of the frames to keep.
        advance: called with the number of frames that were completed since the last call.
        with_error: whether NMSVE is measured.

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
        frame, result.seconds[number - 1] = timed(completion, points, known, time.thread_time)
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
            advance(len(waiting))
            waiting = []
    return result


def run_offline(
    subject: Subject, method: OfflineMethod, masks: Iterable[Mask], held_out: Iterable[Mask]
) -> Run:
    """Complete all frames at once, and measure; each frame takes an equal part of the time.

    Args:
        subject: the sequence.
        method: the method.
        masks: (k,) bool for every frame, that of frame 0 included, in which all are known.
        held_out: (k,) bool for every frame: what may be held out to choose parameters.

    Raises:
        ImportError, ValueError: the method cannot complete the sequence.
    """
    known, apart = (np.stack(list(each)) for each in (masks, held_out))
    known[0], apart[0] = True, False
    result = Run.of(subject.n_frames - 1)
    start = time.thread_time()
    completed = method.complete(subject.faces, subject.vertices, known, apart)
    result.seconds[:] = (time.thread_time() - start) / len(result.seconds)
    result.unknown[:] = np.count_nonzero(~known[1:], axis=1)
    result.complete = bool(np.isfinite(completed).all())
    whole = completed[1:].astype(subject.vertices.dtype)
    result.nmsve[:] = nmsve(subject, range(1, subject.n_frames), list(whole))
    return result


def timed(
    completion: Completion,
    points: Positions,
    known: Mask,
    clock: Callable[[], float] = time.perf_counter,
) -> tuple[Positions, float]:
    """Complete a frame; return it and the seconds that the method took."""
    start = clock()
    completed = completion.complete(points, known)
    seconds = clock() - start
    return completed, seconds if completion.seconds is None else completion.seconds


def nmsve(subject: Subject, numbers: Iterable[int], completed: list[Positions]) -> Floats:
    """Return the NMSVE of completed frames, by their numbers, in bounding-box diagonals."""
    truth = subject.vertices[list(numbers)]
    return np.asarray(metrics.nmsve(subject.faces, truth, np.stack(completed)) / subject.diagonal)


def vertex_error(subject: Subject, number: int, completed: Positions) -> Floats:
    """Return the (k,) distances from the true positions in bounding-box diagonals."""
    truth = subject.vertices[number]
    return np.asarray(metrics.vertex_error(truth, completed) / subject.diagonal)
