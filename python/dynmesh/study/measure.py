"""Runs methods over sequences and keeps what the figures show."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import metrics
from ..metrics import bounding_box_diagonal
from ..sequence import Mask, Positions, Sequence
from .methods import Method

Floats = NDArray[np.float64]

_FRAMES_AT_ONCE = 32  # measured together, as the cells are made anew for each call


@dataclass(frozen=True, eq=False)
class Subject:
    """A sequence to measure on.

    Attributes:
        name: in file names and titles.
        vertices: (n, k, 3) whole frames.
        faces: (m, 3).
        up: the axis that is up, for pictures.
        azimuth: where pictures are taken from, in degrees.
    """

    name: str
    vertices: Positions
    faces: NDArray[np.integer[Any]]
    up: str
    azimuth: float

    @classmethod
    def of(
        cls, name: str, sequence: Sequence, up: str, azimuth: float, frames: int | None
    ) -> "Subject":
        """The first `frames` of a sequence, or all."""
        return cls(name, sequence.vertices[:frames], sequence.faces, up, azimuth)

    @cached_property
    def diagonal(self) -> float:
        """Of the bounding box of frame 0."""
        return bounding_box_diagonal(self.vertices[0])

    @property
    def n_frames(self) -> int:
        """N."""
        return int(self.vertices.shape[0])

    @property
    def n_vertices(self) -> int:
        """K."""
        return int(self.vertices.shape[1])

    def frame_at(self, place: float) -> int:
        """The number of the frame at a place from 0, the first, to 1, the last."""
        return max(1, round(place * (self.n_frames - 1)))


@dataclass(eq=False)
class Run:
    """One method over one sequence; entry i belongs to frame i + 1.

    Attributes:
        nmsve: in bounding-box diagonals; NaN where it was not measured.
        seconds: processor time of the method alone, which runs in one thread.
        iterations: where it iterates.
        unknown: number of unknown vertices.
        frames: completed frames that were asked for, by number.
        masks: their known masks.
        whole: whether every position of every frame was filled in, with a finite value.
    """

    nmsve: Floats
    seconds: Floats
    iterations: NDArray[np.int64]
    unknown: NDArray[np.int64]
    frames: dict[int, Positions]
    masks: dict[int, Mask]
    whole: bool = True

    def summary(self) -> dict[str, float]:
        """What results.json holds of a run."""
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
    """Completes the frames after the first, and measures.

    Args:
        subject: the sequence.
        method: to complete it with.
        masks: (k,) bool for every frame, that of frame 0 included.
        keep: numbers of frames to keep.
        advance: is told of frames done.
        with_error: whether NMSVE is measured.
    """
    n = subject.n_frames - 1
    result = Run(
        np.full(n, np.nan), np.zeros(n), np.zeros(n, np.int64), np.zeros(n, np.int64), {}, {}
    )
    kept = set(keep)
    completion = method.begin(subject.faces, subject.vertices[0])
    waiting: list[Positions] = []
    for number, known in enumerate(masks):
        if number == 0:
            continue
        start = time.thread_time()
        completed = completion.complete(subject.vertices[number], known)
        result.seconds[number - 1] = time.thread_time() - start
        result.iterations[number - 1] = completion.iterations()
        result.unknown[number - 1] = len(known) - np.count_nonzero(known)
        if number in kept:
            result.frames[number] = completed
            result.masks[number] = known
        result.whole = result.whole and bool(np.isfinite(completed).all())
        waiting.append(completed)
        if len(waiting) == _FRAMES_AT_ONCE or number == n:
            if with_error:
                first = number - len(waiting)
                result.nmsve[first:number] = _errors(subject, first + 1, waiting)
            advance(len(waiting))
            waiting = []
    return result


def _errors(subject: Subject, first: int, completed: list[Positions]) -> Floats:
    truth = subject.vertices[first : first + len(completed)]
    nmsve = metrics.nmsve(subject.faces, truth, np.stack(completed))
    return np.asarray(nmsve / subject.diagonal)


def vertex_error(subject: Subject, number: int, completed: Positions) -> Floats:
    """(k,) distances to the truth in bounding-box diagonals."""
    truth = subject.vertices[number]
    return np.asarray(metrics.vertex_error(truth, completed) / subject.diagonal)
