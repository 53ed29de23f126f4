"""The tables of the evaluation."""

from collections.abc import Iterable

import numpy as np

from .claims import Verdict
from .completion import Method
from .losses import PAPER_SHARES, SCENARIOS
from .measure import Run
from .sequence_study import Study
from .tables import ABSENT, Line, milliseconds, nmsve_cell, percent

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
    sequences = list(dict.fromkeys(claim.sequence for claim in claims))
    holds = {(claim.claim, claim.sequence): claim.holds for claim in claims}
    lines: list[Line] = [("claim", *sequences)]
    for words in dict.fromkeys(claim.claim for claim in claims):
        lines.append((words, *(_verdict(holds.get((words, name))) for name in sequences)))
    return lines


def evidence_table(claims: list[Verdict]) -> list[Line]:
    """Tabulate each claim with the numbers that confirm or refute it."""
    lines: list[Line] = [("claim", "sequence", "verdict", "measured")]
    for words in dict.fromkeys(verdict.claim for verdict in claims):
        for v in claims:
            if v.claim == words:
                lines.append((v.claim, v.sequence, _verdict(v.holds), v.evidence))
    return lines


def _verdict(holds: bool | None) -> str:
    return ABSENT if holds is None else "holds" if holds else "**does not hold**"


def _error_and_time(run: Run | None) -> str:
    if run is None:
        return ABSENT
    error = float(run.nmsve.mean())
    shown = "diverges" if error > _DIVERGES else nmsve_cell(error)
    return f"{shown}; {milliseconds(float(np.median(run.seconds)))} ms"
