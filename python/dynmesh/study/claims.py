"""The claims of the paper and those about detail, judged by the numbers of a run."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .baselines import BASELINES, BIHARMONIC
from .charts import linear_fit
from .completion import Method
from .losses import SCENARIOS
from .measure import Run
from .methods import DETAIL, LIA, LIA_HARMONIC, LIA_ON_MOTION, LSM, MOTION
from .sequence_study import Study
from .tables import NMSVE_NAME, nmsve_cell, percent

_REAL_TIME = 16.0  # ms: a frame at 60 Hz
_FASTER_THAN_BIHARMONIC = 1.5


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
    checks: list[tuple[str, Callable[[Study], tuple[bool, str]]]] = [
        ("All missing vertices are always recovered.", _all_recovered),
        ("Time increases linearly with the number of unknown vertices (R² above 0.9).", _linear),
        ("The fewer vertices are known, the more iterations a frame takes.", _iterations),
        ("Motion is more accurate than LIA at every share of known vertices.", _better_than_lia),
        ("Motion is more accurate than LSM at every share of known vertices.", _better_than_lsm),
        ("Motion is faster than LIA and LSM at every share of known vertices.", _faster),
        ("Motion becomes faster as more vertices are known.", _faster_with_more),
        ("LIA becomes slower as more vertices are known.", _lia_slower_with_more),
        ("LIA and LSM have similar errors (within a factor of 1.5).", _lia_like_lsm),
        ("LIA loses detail even where most vertices are known (70 %: twice the error of motion).",
         _lia_smooth),
        (f"Quality is high above 30 % known ({NMSVE_NAME} below 10).", _high_quality),
        ("Fast enough for real time (16 ms a frame).", _real_time),
    ]  # fmt: skip
    name = study.subject.name
    return [Verdict(claim, name, *check(study)) for claim, check in checks]


def detail_verdicts(study: Study) -> list[Verdict]:
    """Judge the claims about detail, as far as its baselines could be measured."""
    found: dict[str, tuple[bool, str]] = {}
    for method in (MOTION, LIA_ON_MOTION, *BASELINES):
        if method.key not in study.missing:
            name = "motion" if method is MOTION else method.label
            claim = f"Detail is more accurate than {name}, however vertices are lost."
            found[claim] = _detail_better_than(study, method)
    if BIHARMONIC.key not in study.missing:
        claim = f"Detail is at least {_FASTER_THAN_BIHARMONIC:g} times as fast as the biharmonic."
        found[claim] = _detail_faster(study)
    found["Detail is fast enough for real time (16 ms a frame)."] = _detail_real_time(study)
    return [Verdict(claim, study.subject.name, *verdict) for claim, verdict in found.items()]


@dataclass(frozen=True)
class Comparison:
    """The mean error and median time of a baseline relative to ours; above 1, ours is better."""

    error: float
    time: float


def compare(study: Study, ours: Method, baseline: Method) -> dict[str, Comparison]:
    """Compare one of our methods with a baseline for every loss on which both were measured."""
    return {
        setting: Comparison(
            _ratio(float(theirs.nmsve.mean()), float(own.nmsve.mean())),
            float(np.median(theirs.seconds) / np.median(own.seconds)),
        )
        for setting, (own, theirs) in _settings(study, ours, baseline).items()
    }


def _settings(study: Study, ours: Method, baseline: Method) -> dict[str, tuple[Run, Run]]:
    shares = [share for share in study.shares(ours) if share in study.shares(baseline)]
    runs = {
        f"{percent(share)} known": (study.grid[ours.key, share], study.grid[baseline.key, share])
        for share in shares
    }
    for name, words in SCENARIOS.items():
        runs[words] = study.scenarios[name, ours.key], study.scenarios[name, baseline.key]
    return runs


def _errors(study: Study, method: Method) -> dict[float, float]:
    shares = study.shares(method)
    return {share: float(study.grid[method.key, share].nmsve.mean()) for share in shares}


def _times(study: Study, method: Method) -> dict[float, float]:
    return {
        share: float(1e3 * np.median(study.grid[method.key, share].seconds))
        for share in study.shares(method)
    }


def _at_shares(values: dict[float, float]) -> str:
    return ", ".join(f"{value:.3g} at {percent(share)}" for share, value in values.items())


def _all_recovered(study: Study) -> tuple[bool, str]:
    runs = [*study.sweep.values()]
    runs += [run for (key, _), run in study.grid.items() if key == MOTION.key]
    runs += [run for (_, key), run in study.scenarios.items() if key == MOTION.key]
    most = max(run.unknown.max() for run in runs)
    n_frames = sum(len(run.seconds) for run in runs)
    words = f"up to {most} of {study.subject.n_vertices} vertices missing, {n_frames} frames, "
    whole = all(run.complete for run in runs)
    return whole, words + ("all filled in" if whole else "not all filled in")


def _linear(study: Study) -> tuple[bool, str]:
    fit = linear_fit(study)
    words = f"R² = {fit.r_squared:.3f}, {1e6 * fit.slope:.3g} ns for each unknown vertex"
    return fit.r_squared > 0.9, words


def _iterations(study: Study) -> tuple[bool, str]:
    means = [study.sweep[share].iterations.mean() for share in sorted(study.sweep)]
    words = f"{means[0]:.1f} at {percent(min(study.sweep))}, {means[-1]:.1f} at " + percent(
        max(study.sweep)
    )
    return bool((np.diff(means) <= 1e-9).all()), words


def _ratio(a: float, b: float) -> float:
    return a / b if b > 0 else float("inf")


def _better_than(study: Study, baselines: tuple[Method, ...]) -> tuple[bool, str]:
    theirs = [_errors(study, baseline) for baseline in baselines]
    ratios = {
        share: _ratio(min(errors[share] for errors in theirs), error)
        for share, error in _errors(study, MOTION).items()
    }
    names = " and ".join(baseline.label for baseline in baselines)
    words = f"error of {names} (the better one)" if len(baselines) > 1 else f"error of {names}"
    return min(ratios.values()) > 1, f"{words} relative to that of motion: {_at_shares(ratios)}"


def _better_than_lia(study: Study) -> tuple[bool, str]:
    return _better_than(study, (LIA, LIA_HARMONIC))


def _better_than_lsm(study: Study) -> tuple[bool, str]:
    return _better_than(study, (LSM,))


def _faster(study: Study) -> tuple[bool, str]:
    ours = _times(study, MOTION)
    baselines = [_times(study, method) for method in (LIA, LIA_HARMONIC, LSM)]
    ratios = {share: min(baseline[share] for baseline in baselines) / ours[share] for share in ours}
    return min(
        ratios.values()
    ) > 1, f"time of the fastest relative to that of motion: {_at_shares(ratios)}"


def _faster_with_more(study: Study) -> tuple[bool, str]:
    times = _times(study, MOTION)
    return bool(_trend(times) < 0), f"ms per frame: {_at_shares(times)}"


def _lia_slower_with_more(study: Study) -> tuple[bool, str]:
    times = _times(study, LIA)
    words = "the system contains the unknown vertices only"
    return bool(_trend(times) > 0), f"ms per frame: {_at_shares(times)}; {words}"


def _trend(times: dict[float, float]) -> float:
    return float(np.polyfit(list(times), list(times.values()), 1)[0])


def _lia_like_lsm(study: Study) -> tuple[bool, str]:
    lia, lsm = _errors(study, LIA), _errors(study, LSM)
    ratios = {share: _ratio(lsm[share], lia[share]) for share in lia}
    similar = all(1 / 1.5 < ratio < 1.5 for ratio in ratios.values())
    return similar, f"error of LSM relative to that of LIA: {_at_shares(ratios)}"


def _lia_smooth(study: Study) -> tuple[bool, str]:
    ours, lia = _errors(study, MOTION)[0.7], _errors(study, LIA)[0.7]
    words = f"{NMSVE_NAME} is {nmsve_cell(lia)}, that of motion {nmsve_cell(ours)}"
    return lia > 2 * ours, words


def _high_quality(study: Study) -> tuple[bool, str]:
    errors = {share: e for share, e in _errors(study, MOTION).items() if share >= 0.3}
    words = ", ".join(f"{nmsve_cell(e)} at {percent(share)}" for share, e in errors.items())
    return max(errors.values()) < 1e-3, f"{NMSVE_NAME} is {words}"


def _real_time(study: Study) -> tuple[bool, str]:
    milliseconds = 1e3 * np.concatenate([run.seconds for run in study.sweep.values()])
    most = float(np.percentile(milliseconds, 95))
    words = f"95 % of the frames, at all shares, took at most {most:.3g} ms; the slowest took "
    return most < _REAL_TIME, f"{words}{milliseconds.max():.3g} ms"


def _detail_better_than(study: Study, baseline: Method) -> tuple[bool, str]:
    errors = {setting: c.error for setting, c in compare(study, DETAIL, baseline).items()}
    words = f"error of {baseline.label} relative to that of detail: {_listed(errors)}"
    return min(errors.values()) > 1, words


def _detail_faster(study: Study) -> tuple[bool, str]:
    times = {setting: c.time for setting, c in compare(study, DETAIL, BIHARMONIC).items()}
    words = f"time of the biharmonic relative to that of detail: {_listed(times)}"
    return min(times.values()) >= _FASTER_THAN_BIHARMONIC, words


def _detail_real_time(study: Study) -> tuple[bool, str]:
    runs = [run for (key, _), run in study.grid.items() if key == DETAIL.key]
    runs += [run for (_, key), run in study.scenarios.items() if key == DETAIL.key]
    milliseconds = 1e3 * np.concatenate([run.seconds for run in runs])
    most = float(np.percentile(milliseconds, 95))
    words = f"95 % of the frames took at most {most:.3g} ms; the slowest took "
    return most < _REAL_TIME, f"{words}{milliseconds.max():.3g} ms"


def _listed(values: dict[str, float]) -> str:
    return ", ".join(f"{value:.3g} ({setting})" for setting, value in values.items())
