"""The evaluation of the paper, its figures 7 to 11 and its claims, and the same beyond the paper.

    script/reproduce [paper FOLDER NAME[:FRAMES] ...] [--frames N] [--quick] [--out FOLDER]

writes the figures and tables of docs/paper.md: figures 7 to 11 as in the paper, and 14 with
detail and libigl; a table of errors and times for each sequence, and the claims of the paper. A
method of libigl that cannot complete a sequence is left out.
"""

import argparse
from dataclasses import replace

from ..harness import (
    ABSENT,
    Line,
    Table,
    by_row_and_column,
    milliseconds,
    nmsve_cell,
    progress,
    sequences,
)
from ..runner import Run
from ..subjects import PAPER_SHARES, SCENARIOS, percent
from . import charts, pictures
from .study import Study, study, verdicts

_DIVERGES = 1.0  # bounding-box diagonals


def errors_and_times(study: Study) -> Table:
    """Tabulate the mean NMSVE and the median time of methods, as far as they were measured."""
    shares = [percent(share) for share in PAPER_SHARES]
    lines: list[Line] = [("method", f"{shares[0]} known", *shares[1:], *SCENARIOS)]
    for method in study.methods:
        runs = [study.runs.get((method, loss)) for loss in (*shares, *SCENARIOS)]
        lines.append((method.label, *map(_error_and_time, runs)))
    return Table(study.subject.name, lines)


def _error_and_time(run: Run | None) -> str:
    if run is None:
        return ABSENT
    shown = "diverges" if run.error > _DIVERGES else nmsve_cell(run.error)
    return f"{shown}; {milliseconds(run.usual_seconds)} ms"


def tables(arguments: argparse.Namespace) -> list[Table]:
    """The evaluation of the paper, its figures 7 to 11 and its claims, and more."""
    studies = []
    for subject in sequences(arguments, 30 if arguments.quick else None):
        azimuth = subject.azimuth if arguments.azimuth is None else arguments.azimuth
        studies.append(study(replace(subject, azimuth=azimuth), quick=arguments.quick))
    charts.draw(studies, arguments.out)
    for done in progress(studies, "drawing"):
        pictures.draw(done, arguments.out)
    claims = {
        (claim, done.subject.name): "holds" if holds else "**does not hold**"
        for done in studies
        for claim, holds in verdicts(done).items()
    }
    name = "claims" if arguments.folder is None else "claims-recorded"
    judged = Table(name, by_row_and_column("claim", claims))
    return [*map(errors_and_times, studies), judged]
