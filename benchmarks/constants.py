"""Prints how far errors depend on each constant of the methods, as a table.

    python -m benchmarks.constants detail [FOLDER NAME ...]
    python -m benchmarks.constants error-bars FOLDER [NAME ...]
    python -m benchmarks.constants tracking FOLDER [NAME ...] [--cameras 4]

Every constant is halved and doubled, one at a time; counts are rounded and at least 1, of "1 - x"
and "x - 1" it is this difference, and cosines and shares of tracking stay below 1.

detail: the mean NMSVE over four losses (10 %, 30 % and 70 % of the vertices known at random, and
what one camera sees), relative to that with the unchanged constants, in the first 60 frames.

error-bars: the share of errors in the intervals of 90 %, the mean over all sequences and losses of
benchmarks.calibration and the least and the largest of one, and for hidden regions the mean rank
correlation of error with standard error, in the first 60 frames.

tracking: the mean distance from the true vertex, relative to that with the unchanged constants, in
the first 30 frames, scanned as in benchmarks.tracking_table.

`script/bench --help` builds the compiled part.
"""

import argparse
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dynmesh.calibration import Calibration
from dynmesh.sequence import Mask, Positions
from dynmesh.study.losses import losses
from dynmesh.study.measure import run
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import Line

from .calibration import HIDDEN, Completed, calibrated, cases
from .compiled import CppMethod, CppTracker, constants_of
from .harness import Table, parser, progress, sequences, show
from .methods import varied_detail
from .tracking import around, errors, point_scans

FACTORS = (0.5, 2.0)

Error = Callable[[str, float], NDArray[np.float64]]
"""Takes a constant and its factor, and returns errors."""


def relative(constants: dict[str, float], of_cases: dict[str, Error]) -> list[Line]:
    """Tabulate errors relative to those without a change, the mean of each case."""
    head: Line = ("constant", "value")
    rows: dict[str, Line] = {name: (f"`{name}`", f"{constants[name]:g}") for name in constants}
    for title, error in of_cases.items():
        head += f"{title}, halved", f"{title}, doubled"
        unchanged = error(next(iter(constants)), 1.0)
        for name in progress(constants, title):
            for factor in FACTORS:
                rows[name] += (f"{np.mean(error(name, factor) / unchanged):.3f}",)
    return [head, *rows.values()]


def of_detail(arguments: argparse.Namespace, constants: dict[str, float]) -> list[Line]:
    """Return the table of method detail."""

    def error_of(subject: Subject) -> Error:
        masks = losses(subject, (0.1, 0.3, 0.7), ("camera",)).values()
        return lambda name, factor: np.array(
            [run(subject, varied_detail(name, factor), m).nmsve.mean() for m in masks]
        )

    subjects = sequences(arguments, arguments.frames or 60)
    return relative(constants, {subject.name: error_of(subject) for subject in subjects})


def of_tracking(arguments: argparse.Namespace, constants: dict[str, float]) -> list[Line]:
    """Return the table of the tracker."""

    def error_of(subject: Subject, cameras: int) -> Error:
        frames = subject.vertices
        scans = list(point_scans(subject, frames, around(subject, frames, cameras)))

        def error(name: str, factor: float) -> NDArray[np.float64]:
            tracker = CppTracker(subject.faces, frames[0], name, factor)
            pairs = zip(scans, frames, strict=True)
            found = [errors(subject, tracker.push(s), f).mean() for s, f in pairs]
            return np.array([np.mean(found)])

        return error

    subjects = sequences(arguments, arguments.frames or 30)
    cases = [(subject, n) for subject in subjects for n in arguments.cameras]
    return relative(constants, {f"{s.name}, cameras: {n}": error_of(s, n) for s, n in cases})


def of_error_bars(arguments: argparse.Namespace, constants: dict[str, float]) -> list[Line]:
    """Return the table of the error bars of method detail."""
    subjects = sequences(arguments, arguments.frames or 60)
    masks = [cases(subject) for subject in subjects]
    lines: list[Line] = [("constant", "factor", "in 90 %", "least", "largest", "rank, hidden")]
    tried = [("unchanged", 1.0), *((name, f) for name in constants for f in FACTORS)]
    for name, factor in progress(tried, "measuring"):
        changed = next(iter(constants)) if name == "unchanged" else name
        found = [
            (case, result)
            for subject, of_subject in zip(subjects, masks, strict=True)
            for case, of_case in of_subject.items()
            if (result := calibration(subject, of_case, changed, factor)) is not None
        ]
        held = [result.coverage_90 for _, result in found]
        ranks = [
            result.rank_correlation
            for case, result in found
            if case in HIDDEN and result.rank_correlation is not None
        ]
        numbers = (np.mean(held), np.min(held), np.max(held), np.mean(ranks))
        title = (name, "") if name == "unchanged" else (f"`{name}`", f"{factor:g}")
        lines.append((*title, *(f"{number:.3f}" for number in numbers)))
    return lines


def calibration(
    subject: Subject, masks: list[Mask], constant: str, factor: float
) -> Calibration | None:
    """Complete the frames with one constant of the error bars multiplied, and compare."""
    first = subject.vertices[0]
    method = CppMethod(subject.faces, first, f"uncertainty.{constant}", factor)

    def push(points: Positions, known: Mask) -> Completed:
        return Completed(method.complete(points, known), *method.error_bars())

    return calibrated(subject, masks, push)


OF = {
    "detail": (of_detail, "detail"),
    "error-bars": (of_error_bars, "uncertainty"),
    "tracking": (of_tracking, "tracking"),
}


def main() -> None:
    """Measure, and print the table."""
    made = parser(__doc__, of=OF)
    made.add_argument("--constants", nargs="+", help="only these constants")
    made.add_argument("--frames", type=int, help="at most this many")
    made.add_argument("--cameras", type=int, nargs="+", default=[4, 1], help="of tracking")
    arguments = made.parse_args()
    tabulate, part = OF[arguments.of]
    values = constants_of(part)
    if unknown := [name for name in arguments.constants or () if name not in values]:
        made.error(f"there is no constant {unknown[0]}")
    chosen = {name: values[name] for name in arguments.constants or values}
    show(arguments, Table(f"constants-{arguments.of}", tabulate(arguments, chosen)))


if __name__ == "__main__":
    main()
