"""The claims of the paper and those about detail, judged by the numbers of a run."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from .charts import linear_fit
from .completion import Method
from .measure import Run
from .methods import DETAIL, LIA, LIA_HARMONIC, LIA_ON_MOTION, LSM, MOTION
from .sequence_study import Study
from .tables import NMSVE_NAME, NMSVE_UNIT, nmsve_cell, percent

_REAL_TIME = 16.0  # ms: a frame at 60 Hz


@dataclass(frozen=True)
class Verdict:
    """A claim, whether it holds on one sequence, and the numbers that show it."""

    claim: str
    sequence: str
    holds: bool
    evidence: str


@dataclass(frozen=True)
class Claims:
    """The verdicts on all sequences, on the claims of the paper and on those about detail."""

    paper: list[Verdict]
    detail: list[Verdict]


def verdicts(study: Study) -> list[Verdict]:
    """Judge every claim of the paper that one sequence can confirm or refute."""
    motion, lia, harmonic, lsm = (_errors(study, m) for m in (MOTION, LIA, LIA_HARMONIC, LSM))
    times, of_lia, *of_others = (_times(study, m) for m in (MOTION, LIA, LIA_HARMONIC, LSM))
    beside_lia = {s: _ratio(min(lia[s], harmonic[s]), error) for s, error in motion.items()}
    beside_lsm = {s: _ratio(lsm[s], error) for s, error in motion.items()}
    lsm_to_lia = {s: _ratio(lsm[s], lia[s]) for s in lia}
    faster = {s: min(t[s] for t in (of_lia, *of_others)) / times[s] for s in times}
    most_known = {s: error for s, error in motion.items() if s >= 0.3}
    fit = linear_fit(study)
    iterations = {s: study.sweep[s].iterations.mean() for s in sorted(study.sweep)}
    recovered = [*study.sweep.values(), *study.losses(MOTION).values()]
    most_unknown = max(run.unknown.max() for run in recovered)
    n_frames = sum(len(run.seconds) for run in recovered)
    found: list[tuple[str, bool, str]] = [
        (
            "All missing vertices are always recovered.",
            all(run.complete for run in recovered),
            f"up to {most_unknown} of {study.subject.n_vertices} vertices missing, {n_frames} "
            f"frames; {sum(not run.complete for run in recovered)} runs were not all filled in",
        ),
        (
            "Time increases linearly with the number of unknown vertices (R² above 0.9).",
            fit.r_squared > 0.9,
            f"R² = {fit.r_squared:.3f}, {1e6 * fit.slope:.3g} ns for each unknown vertex",
        ),
        (
            "The fewer vertices are known, the more iterations a frame takes.",
            bool((np.diff([*iterations.values()]) <= 1e-9).all()),
            f"iterations: {_at_shares(iterations)}",
        ),
        (
            "Motion is more accurate than LIA at every share of known vertices.",
            min(beside_lia.values()) > 1,
            f"error of the better LIA relative to that of motion: {_at_shares(beside_lia)}",
        ),
        (
            "Motion is more accurate than LSM at every share of known vertices.",
            min(beside_lsm.values()) > 1,
            f"error of LSM relative to that of motion: {_at_shares(beside_lsm)}",
        ),
        (
            "Motion is faster than LIA and LSM at every share of known vertices.",
            min(faster.values()) > 1,
            f"time of the fastest relative to that of motion: {_at_shares(faster)}",
        ),
        (
            "Motion becomes faster as more vertices are known.",
            _trend(times) < 0,
            f"ms per frame: {_at_shares(times)}",
        ),
        (
            "LIA becomes slower as more vertices are known.",
            _trend(of_lia) > 0,
            f"ms per frame: {_at_shares(of_lia)}; the system contains the unknown vertices only",
        ),
        (
            "LIA and LSM have similar errors (within a factor of 1.5).",
            all(1 / 1.5 < ratio < 1.5 for ratio in lsm_to_lia.values()),
            f"error of LSM relative to that of LIA: {_at_shares(lsm_to_lia)}",
        ),
        (
            "LIA loses detail even where most vertices are known "
            "(70 %: twice the error of motion).",
            lia[0.7] > 2 * motion[0.7],
            f"{NMSVE_NAME} is {nmsve_cell(lia[0.7])}, that of motion {nmsve_cell(motion[0.7])}",
        ),
        (
            f"Quality is high above 30 % known ({NMSVE_NAME} below 10).",
            max(most_known.values()) < 10 * NMSVE_UNIT,
            f"{NMSVE_NAME}: {_at_shares({s: e / NMSVE_UNIT for s, e in most_known.items()})}",
        ),
        ("Fast enough for real time (16 ms a frame).", *_real_time(study.sweep.values())),
    ]
    return [Verdict(claim, study.subject.name, holds, words) for claim, holds, words in found]


def detail_verdicts(
    study: Study, baselines: Sequence[Method] = (MOTION, LIA_ON_MOTION)
) -> list[Verdict]:
    """Judge the claims about detail beside baselines that were measured."""
    found: dict[str, tuple[bool, str]] = {}
    for method in baselines:
        name = "motion" if method is MOTION else method.label
        errors = relative(study, DETAIL, method, lambda run: float(run.nmsve.mean()))
        words = f"error of {method.label} relative to that of detail: {listed(errors)}"
        claim = f"Detail is more accurate than {name}, however vertices are lost."
        found[claim] = min(errors.values()) > 1, words
    claim = "Detail is fast enough for real time (16 ms a frame)."
    found[claim] = _real_time(study.losses(DETAIL).values())
    return [Verdict(claim, study.subject.name, *verdict) for claim, verdict in found.items()]


def relative(
    study: Study, ours: Method, baseline: Method, value: Callable[[Run], float]
) -> dict[str, float]:
    """Return a value of a baseline relative to ours, for every loss on which both were measured."""
    theirs = study.losses(baseline)
    runs = study.losses(ours).items()
    return {loss: _ratio(value(theirs[loss]), value(run)) for loss, run in runs if loss in theirs}


def listed(values: dict[str, float]) -> str:
    """Return values with what is known, as words."""
    return ", ".join(f"{value:.3g} ({loss})" for loss, value in values.items())


def _errors(study: Study, method: Method) -> dict[float, float]:
    return {s: float(study.grid[method.key, s].nmsve.mean()) for s in study.shares(method)}


def _times(study: Study, method: Method) -> dict[float, float]:
    runs = {share: study.grid[method.key, share] for share in study.shares(method)}
    return {share: float(1e3 * np.median(run.seconds)) for share, run in runs.items()}


def _at_shares(values: dict[float, float]) -> str:
    return ", ".join(f"{value:.3g} at {percent(share)}" for share, value in values.items())


def _ratio(a: float, b: float) -> float:
    return a / b if b > 0 else float("inf")


def _trend(times: dict[float, float]) -> float:
    return float(np.polyfit(list(times), list(times.values()), 1)[0])


def _real_time(runs: Iterable[Run]) -> tuple[bool, str]:
    milliseconds = 1e3 * np.concatenate([run.seconds for run in runs])
    most = float(np.percentile(milliseconds, 95))
    words = f"95 % of the frames took at most {most:.3g} ms; the slowest took "
    return most < _REAL_TIME, f"{words}{milliseconds.max():.3g} ms"
