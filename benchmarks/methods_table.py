"""Prints the error and the time of detail, motion and baselines, as two tables.

    python -m benchmarks.methods_table FOLDER [NAME ...]

Vertices are lost at random, at four shares of known vertices, or hidden from a camera that circles
the scene. The error is NMSVE, averaged over the frames after frame 0, relative to that of motion;
it is bold if it is smaller than that of detail. The time is the median, in one thread.
"""

from collections.abc import Iterable

import numpy as np

from dynmesh.sequence import Mask
from dynmesh.study.completion import Method
from dynmesh.study.losses import losses
from dynmesh.study.measure import run
from dynmesh.study.methods import DETAIL, LIA_ON_MOTION, MOTION
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import ABSENT, Line, bold_below_one, milliseconds, nmsve_cell

from .baselines import ARAP_FROM_PREVIOUS, BASELINES, BIHARMONIC
from .harness import Table, parser, progress, sequences, show

METHODS = (MOTION, DETAIL, LIA_ON_MOTION, *BASELINES, ARAP_FROM_PREVIOUS)


def measure(subject: Subject, method: Method, masks: Iterable[Mask]) -> tuple[float, float]:
    """Return the mean NMSVE in diagonals and the median seconds; NaN if the method fails."""
    try:
        measured = run(subject, method, masks)
    except RuntimeError:
        return np.nan, np.nan
    return float(measured.nmsve.mean()), float(np.median(measured.seconds))


def relative(error: float, motion: float, detail: float) -> str:
    """Return an error relative to that of motion, in bold if it is smaller than that of detail."""
    if np.isnan(error):
        return "fails"
    cell = f"{error / motion:.3f}" if motion > 0 else ABSENT
    return f"**{cell}**" if error < detail else cell


def main() -> None:
    """Measure, and print the tables."""
    arguments = parser(__doc__).parse_args()
    labels = [method.label for method in METHODS[2:]]
    errors: list[Line] = [("NMSVE", "known", "motion, x 1e4", "detail", *labels)]
    times: list[Line] = [
        ("ms a frame", "known", "motion", "detail", *labels, "biharmonic, times detail")
    ]
    for subject in sequences(arguments):
        title = f"{subject.name}, {subject.n_frames} frames"
        for loss, masks in progress(losses(subject, scenarios=("camera",)).items(), title):
            found = {method: measure(subject, method, masks) for method in METHODS}
            motion, detail = found[MOTION][0], found[DETAIL][0]
            cells = [relative(found[method][0], motion, detail) for method in METHODS[1:]]
            errors.append((title, loss, nmsve_cell(motion), *cells))
            ratio = bold_below_one(found[BIHARMONIC][1] / found[DETAIL][1])
            times.append((title, loss, *(milliseconds(found[m][1]) for m in METHODS), ratio))
    show(arguments, Table("methods", errors), Table("method-times", times))


if __name__ == "__main__":
    main()
