"""Prints how well the standard errors of method detail describe its errors, as a table.

    python -m benchmarks.calibration FOLDER [NAME ...] [--frames N] [--training] [--noise SHARE]

Vertices are known at random (10 % and 30 %), seen by a circling camera, or hidden by patches (30 %,
each for ten frames). The table shows the shares of the filled-in vertices whose error is within the
intervals of 50 % and of 90 %, the root mean square error over the root mean square standard error,
and the rank correlation of error with standard error, generation and age, the mean over frames. A
summary shows the share within 90 % and the first two of these correlations. With --training, the
first half of each sequence is a training sequence for the second. With --noise, the known positions
have noise of that share of the mean edge, which the completer is told.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynmesh import Completer, degrade
from dynmesh.calibration import Calibrating, Calibration
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.sequence import Mask, Positions
from dynmesh.study.losses import losses
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import ABSENT, Line, by_row_and_column

from .harness import Table, parser, progress, sequences, show
from .training_study import halves

LIFETIME = 10
HIDDEN = ("camera", "patches")


def cases(subject: Subject) -> dict[str, list[Mask]]:
    """Return the known masks by the name of the case."""
    shape = (subject.n_frames, subject.n_vertices)
    patches = degrade.patch_known(subject.faces, *shape, 0.3, lifetime=LIFETIME)
    return losses(subject, (0.1, 0.3), ("camera",)) | {"patches": list(patches)}


class Completed(NamedTuple):
    """A completed frame, and what is known of its vertices."""

    frame: Positions
    standard_error: NDArray[np.floating]
    generation: NDArray[np.int32]
    age: NDArray[np.int32] | None = None


def calibrated(
    subject: Subject, masks: list[Mask], push: Callable[[Positions, Mask], Completed]
) -> Calibration | None:
    """Complete the frames after frame 0, and compare; None if nothing was filled in.

    Args:
        subject: the sequence.
        masks: (k,) bool for every frame, that of frame 0 included.
        push: completes a frame.
    """
    calibrating = Calibrating()
    for points, known in zip(subject.vertices[1:], masks[1:], strict=True):
        frame, bars, generation, age = push(points, known)
        error = np.linalg.norm(frame.astype(np.float64) - points, axis=1)
        filled = (generation > 0) & np.isfinite(bars)
        calibrating.add(error, bars, filled=filled, generation=generation, age=age)
    return calibrating.result()


def measure(
    subject: Subject, masks: list[Mask], training: Positions | None, noise: float | None
) -> Calibration | None:
    """Compare method detail, whose known positions get noise of this standard deviation."""
    completer = Completer(
        subject.faces,
        subject.vertices[0],
        method="detail",
        uncertainty=True,
        training=training,
        noise=noise,
    )
    rng = np.random.default_rng(0)

    def push(points: Positions, known: Mask) -> Completed:
        seen = points if noise is None else points + noise * rng.normal(size=points.shape)
        frame = completer.push(seen.astype(points.dtype), known)
        return Completed(frame, completer.standard_error, completer.generation, completer.age)

    return calibrated(subject, masks, push)


def values(found: Calibration) -> list[float]:
    """Return the numbers of a row; NaN is what could not be measured."""
    ranks = found.rank_correlation, found.generation_correlation, found.age_correlation
    known = [np.nan if rank is None else rank for rank in ranks]
    return [found.coverage_50, found.coverage_90, found.rms_ratio, *known]


def cell(value: float) -> str:
    """Return a number of a row as it is shown."""
    return ABSENT if np.isnan(value) else f"{value:.2f}"


def main() -> None:
    """Measure, and print the table."""
    made = parser(__doc__)
    made.add_argument("--frames", type=int, default=100, help="at most this many, default 100")
    made.add_argument("--training", action="store_true", help="train the first half")
    made.add_argument("--noise", type=float, help="in mean edges of frame 0")
    arguments = made.parse_args()
    rows: list[tuple[str, str, list[float]]] = []
    short: dict[tuple[str, str], str] = {}
    for sequence in sequences(arguments):
        parts = halves(sequence) if arguments.training else (None, sequence)
        if parts is None:
            made.error(f"{sequence.name} has too few frames to train one half of them")
        training, subject = parts
        subject = replace(subject, vertices=subject.vertices[: arguments.frames])
        noise = arguments.noise and arguments.noise * mean_edge_of(
            subject.vertices[0], subject.faces
        )
        for case, masks in progress(cases(subject).items(), subject.name):
            found = measure(subject, masks, training, noise)
            if found is not None:
                row = values(found)
                rows.append((subject.name, case, row))
                short[subject.name, case] = f"{cell(row[1])}; {cell(row[3])} ({cell(row[4])})"
    for title, chosen in {
        "mean": {case for _, case, _ in rows},
        "mean, hidden regions": set(HIDDEN),
    }.items():
        of_cases = [numbers for _, case, numbers in rows if case in chosen]
        rows.append((title, "", list(np.nanmean(of_cases, axis=0))))
    lines: list[Line] = [
        ("sequence", "known", "in 50 %", "in 90 %", "rms ratio", "rank: bars", "generation", "age"),
        *((name, case, *map(cell, numbers)) for name, case, numbers in rows),
    ]
    kind = "-training" * arguments.training + "-noise" * (arguments.noise is not None)
    summary = by_row_and_column("sequence", short)
    show(arguments, Table("calibration", lines), Table(f"calibration-summary{kind}", summary))


if __name__ == "__main__":
    main()
