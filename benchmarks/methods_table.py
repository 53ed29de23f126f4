"""Prints the error of detail, motion and baselines, as a table.

    python -m benchmarks.methods_table FOLDER [NAME ...]

Vertices are lost at random, at four shares of known vertices, or hidden from a camera that circles
the scene. The error is NMSVE, averaged over the frames after frame 0, relative to that of motion;
it is bold if it is smaller than that of detail.
"""

from collections.abc import Iterable

import numpy as np

from dynmesh.sequence import Mask
from dynmesh.study.completion import Method
from dynmesh.study.losses import losses
from dynmesh.study.measure import run
from dynmesh.study.methods import DETAIL, LIA_ON_MOTION, MOTION
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import ABSENT, Line, nmsve_cell

from .baselines import ARAP_FROM_PREVIOUS, BASELINES
from .harness import Table, parser, progress, sequences, show

METHODS = (MOTION, DETAIL, LIA_ON_MOTION, *BASELINES, ARAP_FROM_PREVIOUS)


def measure(subject: Subject, method: Method, masks: Iterable[Mask]) -> float:
    """Return the mean NMSVE in diagonals; NaN if the method fails."""
    try:
        return float(run(subject, method, masks).nmsve.mean())
    except RuntimeError:
        return np.nan


def relative(error: float, motion: float, detail: float) -> str:
    """Return an error relative to that of motion, in bold if it is smaller than that of detail."""
    if np.isnan(error):
        return "fails"
    cell = f"{error / motion:.3f}" if motion > 0 else ABSENT
    return f"**{cell}**" if error < detail else cell


def main() -> None:
    """Measure, and print the table."""
    arguments = parser(__doc__).parse_args()
    labels = [method.label for method in METHODS[2:]]
    errors: list[Line] = [("NMSVE", "known", "motion, x 1e4", "detail", *labels)]
    for subject in sequences(arguments):
        title = f"{subject.name}, {subject.n_frames} frames"
        for loss, masks in progress(losses(subject, scenarios=("camera",)).items(), title):
            found = {method: measure(subject, method, masks) for method in METHODS}
            motion, detail = found[MOTION], found[DETAIL]
            cells = [relative(found[method], motion, detail) for method in METHODS[1:]]
            errors.append((title, loss, nmsve_cell(motion), *cells))
    show(arguments, Table("methods", errors))


if __name__ == "__main__":
    main()
