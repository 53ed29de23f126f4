"""Prints how far the error bars depend on each of their constants, as a table.

    python -m benchmarks.calibration_sensitivity FOLDER [--frames N] [--constants NAME ...]

FOLDER contains sequences in files NAME.npz. Vertices are missing as in benchmarks.calibration.
Every constant is halved and doubled, one at a time; numbers of averagings are at least 1, and of
shares that are kept it is what is not kept, such as 0.1 of 0.9. The table shows the share of errors
in the intervals of 90 %, the mean over all cases and the least and the largest of a case, and for
hidden regions the mean rank correlation of error with standard error. script/bench builds the
compiled part.
"""

import argparse
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from dynmesh.calibration import Calibrating, Calibration
from dynmesh.sequence import Mask
from dynmesh.study.subjects import Subject, from_file
from dynmesh.study.tables import Line, markdown

from .calibration import cases
from .subjects import CppSubject

CONSTANTS = (
    "smoothings",
    "shared_change",
    "1 - kept",
    "1 - kept_in_the_long_run",
    "first_persistence",
    "1 - largest_persistence",
    "averagings",
    "pull",
    "least_size",
    "largest_size",
    "variance_averagings",
)
HIDDEN = ("camera", "patches")


def calibration(
    subject: Subject, masks: Iterable[Mask], constant: str, factor: float
) -> Calibration | None:
    """Complete the frames with one constant multiplied, and compare."""
    frames = np.ascontiguousarray(subject.vertices, np.float32)
    faces = np.ascontiguousarray(subject.faces, np.int32)
    completer = CppSubject(faces, frames[0], varied=(f"uncertainty.{constant}", factor))
    calibrating = Calibrating()
    for number, known in enumerate(masks):
        if number == 0:
            continue
        truth = frames[number]
        completer.push(truth[None], np.ascontiguousarray(known[None]), np.zeros(1, np.int64))
        bars, generation = completer.error_bars()
        error = np.linalg.norm(completer.completed.astype(np.float64) - truth, axis=1)
        calibrating.add(error, bars, filled=generation > 0)
    return calibrating.result()


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--frames", type=int, default=60, help="at most this many, default 60")
    parser.add_argument("--constants", nargs="+", default=CONSTANTS, help="only these constants")
    arguments = parser.parse_args()
    files = sorted(arguments.folder.glob("*.npz"))
    subjects = [from_file(file, arguments.frames) for file in files]
    masks = [cases(subject) for subject in subjects]
    lines: list[Line] = [("constant", "factor", "in 90 %", "least", "largest", "rank, hidden")]
    tried = [("unchanged", 1.0), *((name, f) for name in arguments.constants for f in (0.5, 2.0))]
    for name, factor in track(tried, "measuring", console=Console(stderr=True)):
        constant = CONSTANTS[0] if name == "unchanged" else name
        found = [
            (case, result)
            for subject, of_subject in zip(subjects, masks, strict=True)
            for case, of_case in of_subject.items()
            if (result := calibration(subject, of_case, constant, factor)) is not None
        ]
        held = [result.coverage_90 for _, result in found]
        ranks = [
            result.rank_correlation
            for case, result in found
            if case in HIDDEN and result.rank_correlation is not None
        ]
        values = (np.mean(held), np.min(held), np.max(held), np.mean(ranks))
        shown = "" if name == "unchanged" else f"{factor:g}"
        name = name if name == "unchanged" else f"`{name}`"
        lines.append((name, shown, *(f"{value:.3f}" for value in values)))
    print(markdown(lines))


if __name__ == "__main__":
    main()
