"""The paper's claims, each with the verdict of the run's own numbers."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .charts import LinearFit
from .methods import HARMONIC, LIA, LSM, MOTION, Method
from .study import SCENARIOS, Study
from .style import percent, scientific

_REAL_TIME = 16.0  # ms: a frame at 60 Hz


@dataclass(frozen=True)
class Verdict:
    """A claim, whether it held on one sequence, and the numbers."""

    claim: str
    sequence: str
    holds: bool
    evidence: str


def verdicts(study: Study) -> list[Verdict]:
    """Every claim of the paper that one study can speak to."""
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
        ("Quality is high above 30 % known (NMSVE below 0.1 % of the diagonal).", _high_quality),
        ("Fast enough for real time (16 ms a frame).", _real_time),
    ]  # fmt: skip
    name = study.subject.name
    return [Verdict(claim, name, *check(study)) for claim, check in checks]


@dataclass(frozen=True)
class Comparison:
    """A rival's mean error and median time over those of motion: above 1, motion is better."""

    error: float
    time: float


def compare(study: Study, rival: Method) -> dict[str, Comparison]:
    """Motion against a rival in every setting, described in words."""
    settings = {
        f"{percent(share)} known": (study.grid[MOTION.key, share], study.grid[rival.key, share])
        for share in _shares(study)
    }
    for name, words in SCENARIOS.items():
        settings[words] = study.scenarios[name, MOTION.key], study.scenarios[name, rival.key]
    return {
        setting: Comparison(
            _ratio(float(theirs.nmsve.mean()), float(ours.nmsve.mean())),
            float(np.median(theirs.seconds) / np.median(ours.seconds)),
        )
        for setting, (ours, theirs) in settings.items()
    }


def _shares(study: Study) -> list[float]:
    return sorted({share for _, share in study.grid})


def _errors(study: Study, method: Method) -> dict[float, float]:
    return {share: float(study.grid[method.key, share].nmsve.mean()) for share in _shares(study)}


def _times(study: Study, method: Method) -> dict[float, float]:
    return {
        share: float(1e3 * np.median(study.grid[method.key, share].seconds))
        for share in _shares(study)
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
    whole = all(run.whole for run in runs)
    return whole, words + ("all filled in" if whole else "not all filled in")


def _linear(study: Study) -> tuple[bool, str]:
    fit = LinearFit.of(study)
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


def _better_than(study: Study, rivals: tuple[Method, ...]) -> tuple[bool, str]:
    theirs = [_errors(study, rival) for rival in rivals]
    ratios = {
        share: _ratio(min(errors[share] for errors in theirs), error)
        for share, error in _errors(study, MOTION).items()
    }
    names = " and ".join(rival.label for rival in rivals)
    words = f"error of {names} (the better one)" if len(rivals) > 1 else f"error of {names}"
    return min(ratios.values()) > 1, f"{words} over that of motion: {_at_shares(ratios)}"


def _better_than_lia(study: Study) -> tuple[bool, str]:
    return _better_than(study, (LIA, HARMONIC))


def _better_than_lsm(study: Study) -> tuple[bool, str]:
    return _better_than(study, (LSM,))


def _faster(study: Study) -> tuple[bool, str]:
    ours = _times(study, MOTION)
    rivals = [_times(study, method) for method in (LIA, HARMONIC, LSM)]
    ratios = {share: min(rival[share] for rival in rivals) / ours[share] for share in ours}
    return min(
        ratios.values()
    ) > 1, f"time of the fastest over that of motion: {_at_shares(ratios)}"


def _faster_with_more(study: Study) -> tuple[bool, str]:
    times = _times(study, MOTION)
    return bool(_trend(times) < 0), f"ms per frame: {_at_shares(times)}"


def _lia_slower_with_more(study: Study) -> tuple[bool, str]:
    times = _times(study, LIA)
    words = "the system solved is that of the unknown vertices"
    return bool(_trend(times) > 0), f"ms per frame: {_at_shares(times)}; {words}"


def _trend(times: dict[float, float]) -> float:
    return float(np.polyfit(list(times), list(times.values()), 1)[0])


def _lia_like_lsm(study: Study) -> tuple[bool, str]:
    lia, lsm = _errors(study, LIA), _errors(study, LSM)
    ratios = {share: _ratio(lsm[share], lia[share]) for share in lia}
    similar = all(1 / 1.5 < ratio < 1.5 for ratio in ratios.values())
    return similar, f"error of LSM over that of LIA: {_at_shares(ratios)}"


def _lia_smooth(study: Study) -> tuple[bool, str]:
    ours, lia = _errors(study, MOTION)[0.7], _errors(study, LIA)[0.7]
    return lia > 2 * ours, f"NMSVE {scientific(lia)} against {scientific(ours)} of motion"


def _high_quality(study: Study) -> tuple[bool, str]:
    errors = {share: e for share, e in _errors(study, MOTION).items() if share >= 0.3}
    words = ", ".join(f"{scientific(e)} at {percent(share)}" for share, e in errors.items())
    return max(errors.values()) < 1e-3, f"NMSVE {words}"


def _real_time(study: Study) -> tuple[bool, str]:
    milliseconds = 1e3 * np.concatenate([run.seconds for run in study.sweep.values()])
    usual = float(np.percentile(milliseconds, 95))
    words = f"19 of 20 frames, of all shares, within {usual:.3g} ms; the slowest took "
    return usual < _REAL_TIME, f"{words}{milliseconds.max():.3g} ms"
