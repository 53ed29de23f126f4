"""The tables of the evaluation."""

from collections.abc import Iterable

import numpy as np

from .claims import Verdict
from .completion import Method
from .losses import PAPER_SHARES, SCENARIOS
from .measure import Run
from .sequence_study import Study
from .tables import ABSENT, Line, by_row_and_column, milliseconds, nmsve_cell, percent

_DIVERGES = 1.0  # bounding-box diagonals


def sequence_table(study: Study, methods: Iterable[Method]) -> list[Line]:
    """Tabulate the mean NMSVE and the median time of methods, as far as they were measured."""
    shares = [percent(share) for share in PAPER_SHARES]
    lines: list[Line] = [("method", f"{shares[0]} known", *shares[1:], *SCENARIOS)]
    for method in methods:
        runs = [study.grid.get((method.key, share)) for share in PAPER_SHARES]
        runs += [study.scenarios.get((name, method.key)) for name in SCENARIOS]
        lines.append((method.label, *map(_error_and_time, runs)))
    return lines


def claims_table(claims: list[Verdict]) -> list[Line]:
    """Tabulate on which sequences each claim holds."""
    return by_row_and_column("claim", {(c.claim, c.sequence): _verdict(c.holds) for c in claims})


def evidence_table(claims: list[Verdict]) -> list[Line]:
    """Tabulate each claim with the numbers that confirm or refute it."""
    lines: list[Line] = [("claim", "sequence", "verdict", "measured")]
    order = [verdict.claim for verdict in claims]
    for v in sorted(claims, key=lambda verdict: order.index(verdict.claim)):
        lines.append((v.claim, v.sequence, _verdict(v.holds), v.evidence))
    return lines


def _verdict(holds: bool) -> str:
    return "holds" if holds else "**does not hold**"


def _error_and_time(run: Run | None) -> str:
    if run is None:
        return ABSENT
    error = float(run.nmsve.mean())
    shown = "diverges" if error > _DIVERGES else nmsve_cell(error)
    return f"{shown}; {milliseconds(float(np.median(run.seconds)))} ms"
