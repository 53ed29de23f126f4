"""The tables of the evaluation, for report.html and for docs/results.md."""

from collections.abc import Iterable
from typing import Any

from .baselines import BEYOND, BIHARMONIC, OFFLINE
from .claims import Verdict, compare
from .completion import Method
from .losses import PAPER_SHARES, SCENARIOS
from .methods import COMPARED, DETAIL, MOTION, ONCE
from .sequence_study import Study
from .tables import (
    ABSENT,
    Line,
    bold_below_one,
    nmsve_cell,
    number,
    percent,
    ratio,
)
from .training_study import TRAINED

Results = dict[str, Any]
"""A part of results.json."""

_DIVERGES = 1.0  # bounding-box diagonals


def sequence_table(numbers: Results) -> list[Line]:
    """Tabulate the mean NMSVE and the median time of every method on one sequence."""
    shares = [percent(share) for share in PAPER_SHARES]
    lines: list[Line] = [("method", f"{shares[0]} known", *shares[1:], *SCENARIOS)]
    for method in (*COMPARED, *BEYOND):
        if method.key in numbers["missing"]:
            continue
        runs = [numbers["grid"][method.key][str(share)] for share in PAPER_SHARES]
        runs += [numbers["scenarios"][name][method.key] for name in SCENARIOS]
        cells = [f"{_error(run)}; {number(run['milliseconds_median'])} ms" for run in runs]
        lines.append((method.label, *cells))
    once = [_error(numbers["once_only"][str(share)]) for share in PAPER_SHARES]
    lines.append((ONCE.label, *once, *([""] * len(SCENARIOS))))
    return lines


def claims_table(claims: list[Results]) -> list[Line]:
    """Tabulate on which sequences each claim holds."""
    sequences = list(dict.fromkeys(claim["sequence"] for claim in claims))
    holds = {(claim["claim"], claim["sequence"]): claim["holds"] for claim in claims}
    lines: list[Line] = [("claim", *sequences)]
    for words in dict.fromkeys(claim["claim"] for claim in claims):
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


def comparison_table(study: Study, ours: Method, methods: Iterable[Method]) -> list[Line]:
    """Tabulate the error and time of methods relative to one of ours."""
    baselines = [method for method in methods if method is not ours]
    columns = [compare(study, ours, baseline) for baseline in baselines]
    lines: list[Line] = [(study.subject.name, *(baseline.label for baseline in baselines))]
    for setting in columns[0]:
        cells = [
            f"error {bold_below_one(column[setting].error)}\n"
            f"time {bold_below_one(column[setting].time)}"
            for column in columns
        ]
        lines.append((setting, *cells))
    return lines


def training_table(halves: dict[str, Results]) -> list[Line]:
    """Tabulate errors on the second halves of sequences, by name, relative to that of detail.

    Errors below that of detail are bold. Times are those of a frame, relative to detail. Training
    that are of no use have rows of their own.
    """
    columns = (MOTION.key, BIHARMONIC.key, TRAINED, *(method.key for method in OFFLINE))
    lines: list[Line] = [
        ("NMSVE", "known", "detail, x 1e4", "motion", "biharmonic (libigl)",
         "detail, trained", "matrix completion, offline", "with the graph, offline",
         "prior weight", "time, trained", "time, matrix completion", "time, with the graph")
    ]  # fmt: skip
    for name, half in halves.items():
        for loss, runs in half["runs"].items():
            detail = runs[DETAIL.key]
            cells = [_relative(runs.get(key), detail) for key in columns]
            error = nmsve_cell(detail["nmsve_mean"])
            times = [_slower(runs.get(key), detail) for key in columns[2:]]
            lines.append((name, loss, error, *cells, _prior_weight(runs.get(TRAINED)), *times))
            for key in runs:
                if key.startswith(f"{TRAINED} on"):
                    cells = ["", "", "", _relative(runs[key], detail), "", ""]
                    use = _prior_weight(runs[key]), _slower(runs[key], detail)
                    lines.append((f"{name}, {key}", loss, *cells, *use, "", ""))
    return lines


def training_summary(halves: dict[str, Results]) -> list[Line]:
    """Tabulate the errors of trained detail, then those of the better matrix completion.

    Both are relative to detail. Losses that were not measured on a sequence have an empty place.
    """
    losses = list(dict.fromkeys(loss for half in halves.values() for loss in half["runs"]))
    heads = [f"{kind}{loss}" for kind in ("trained, ", "offline, ") for loss in losses]
    lines: list[Line] = [("", *heads)]
    for name, half in halves.items():
        cells = []
        for methods in ((TRAINED,), tuple(method.key for method in OFFLINE)):
            for loss in losses:
                runs = half["runs"].get(loss, {})
                measured = [runs[key] for key in methods if key in runs]
                best = min(measured, key=lambda run: float(run["nmsve_mean"]), default=None)
                cells.append(_relative(best, runs.get(DETAIL.key, {"nmsve_mean": 0.0})))
        lines.append((name, *cells))
    return lines


def _prior_weight(run: Results | None) -> str:
    return ABSENT if run is None else f"{run['prior_weight_mean']:.2f}"


def _slower(run: Results | None, detail: Results) -> str:
    """Return how many times as long as one of detail a frame takes."""
    return ABSENT if run is None else ratio(*(r["milliseconds_median"] for r in (run, detail)))


def _relative(run: Results | None, detail: Results) -> str:
    """Return the error of a run relative to that of detail, in bold if it is smaller."""
    if run is None or detail["nmsve_mean"] == 0:
        return ABSENT
    value = run["nmsve_mean"] / detail["nmsve_mean"]
    cell = f"{value:.2f}" if value < 10 else number(value)
    return f"**{cell}**" if float(cell) < 1 else cell


def _verdict(holds: bool | None) -> str:
    return ABSENT if holds is None else "holds" if holds else "**does not hold**"


def _error(run: Results) -> str:
    error = run["nmsve_mean"]
    return "diverges" if error > _DIVERGES else nmsve_cell(error)
