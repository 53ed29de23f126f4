"""What is measured on one sequence for the figures of the paper and beyond, and its claims."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import linregress

from ..harness import NMSVE_UNIT
from ..methods import BASELINES, COMPARED, LIA, LIA_HARMONIC, LSM, MOTION, ONCE, Method
from ..runner import Run, Runs, run_all
from ..subjects import PAPER_SHARES, SCENARIOS, Subject, losses_of, percent

SHARES = tuple(round(0.1 * step, 1) for step in range(1, 10))
"""The shares of known vertices at which the methods of the paper are compared."""

SWEEP = tuple(round(0.05 * step, 2) for step in range(1, 20))
"""The shares of known vertices at which motion is measured."""

QUICK_SWEEP = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.95)

FIGURE8, FIGURE11 = 0.63, 0.46
"""Where in the sequence the frames are that these figures show, as fractions."""

FIGURE10 = ((0.3, 0.86), (0.3, 0.46), (0.5, 0.31), (0.5, 0.69))
"""The share of known vertices of each row, and where in the sequence its frame is."""


@dataclass(frozen=True, eq=False)
class Study:
    """What was measured on one sequence: the runs by method and loss."""

    subject: Subject
    runs: Runs

    @property
    def methods(self) -> list[Method]:
        """The methods that were measured; those of libraries that are not installed were not."""
        return list(dict.fromkeys(method for method, _ in self.runs))

    @property
    def sweep(self) -> dict[float, Run]:
        """The runs of motion by share of known vertices."""
        return {share: self.at(MOTION, share) for share in self.shares(MOTION, SWEEP)}

    def at(self, method: Method, share: float) -> Run:
        """Return the run of a method at a share of known vertices."""
        return self.runs[method, percent(share)]

    def shares(self, method: Method, of: tuple[float, ...] = SHARES) -> list[float]:
        """Return the shares of known vertices at which a method was measured."""
        return [share for share in of if (method, percent(share)) in self.runs]


def study(subject: Subject, *, quick: bool) -> Study:
    """Measure everything on one sequence."""
    places = (FIGURE8, FIGURE11, *(place for _, place in FIGURE10))
    keep = [subject.frame_at(place) for place in places]
    masks = losses_of(subject, QUICK_SWEEP if quick else SWEEP)
    runs = run_all(subject, (MOTION,), masks, keep=keep)
    shares = [*map(percent, PAPER_SHARES if quick else SHARES), *SCENARIOS]
    compared = {loss: masks[loss] for loss in shares}
    runs |= run_all(subject, COMPARED[1:], compared, keep=keep)
    of_paper = {loss: masks[loss] for loss in map(percent, PAPER_SHARES)}
    scenarios = {loss: masks[loss] for loss in SCENARIOS}
    runs |= run_all(subject, BASELINES, of_paper | scenarios, keep=keep)
    runs |= run_all(subject, (ONCE,), of_paper)
    return Study(subject, runs)


_REAL_TIME = 0.016  # seconds: a frame at 60 Hz


def time_of_unknown(study: Study) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the number of unknown vertices and the milliseconds of a frame, at each share."""
    unknown = (1 - np.array([*study.sweep])) * study.subject.n_vertices
    return unknown, np.array([1e3 * run.usual_seconds for run in study.sweep.values()])


def verdicts(study: Study) -> dict[str, bool]:
    """Return whether each claim that one sequence can confirm or refute holds."""

    def errors(method: Method) -> NDArray[np.float64]:
        return np.array([study.at(method, share).error for share in shares])

    def times(method: Method) -> NDArray[np.float64]:
        return np.array([study.at(method, share).usual_seconds for share in shares])

    def trend(seconds: NDArray[np.float64]) -> float:
        return float(np.polyfit(shares, seconds, 1)[0])

    shares = np.array(study.shares(LIA))
    motion, lia, harmonic, lsm = (errors(m) for m in (MOTION, LIA, LIA_HARMONIC, LSM))
    of_motion, of_lia, *of_others = (times(m) for m in (MOTION, LIA, LIA_HARMONIC, LSM))
    iterations = [run.iterations.mean() for run in study.sweep.values()]
    recovered = [run.error for (method, _), run in study.runs.items() if method is MOTION]
    seconds = np.concatenate([run.seconds for run in study.sweep.values()])
    most = shares.tolist().index(0.7)
    return {
        "All missing vertices are always recovered.": bool(np.isfinite(recovered).all()),
        "Time increases linearly with the number of unknown vertices (R² above 0.9).": bool(
            linregress(*time_of_unknown(study)).rvalue ** 2 > 0.9
        ),
        "The fewer vertices are known, the more iterations a frame takes.": bool(
            (np.diff(iterations) <= 1e-9).all()
        ),
        "Motion is more accurate than LIA at every share of known vertices.": bool(
            (motion < np.minimum(lia, harmonic)).all()
        ),
        "Motion is more accurate than LSM at every share of known vertices.": bool(
            (motion < lsm).all()
        ),
        "Motion is faster than LIA and LSM at every share of known vertices.": bool(
            (of_motion < np.min([of_lia, *of_others], axis=0)).all()
        ),
        "Motion becomes faster as more vertices are known.": trend(of_motion) < 0,
        "LIA becomes slower as more vertices are known.": trend(of_lia) > 0,
        "LIA and LSM have similar errors (within a factor of 1.5).": bool(
            (np.maximum(lia, lsm) < 1.5 * np.minimum(lia, lsm)).all()
        ),
        "LIA loses detail even where most vertices are known (70 %: twice the error of motion).": (
            bool(lia[most] > 2 * motion[most])
        ),
        "Quality is high above 30 % known (NMSVE x 1e4 below 10).": bool(
            (motion[shares >= 0.3] < 10 * NMSVE_UNIT).all()
        ),
        "Fast enough for real time (16 ms a frame).": bool(np.percentile(seconds, 95) < _REAL_TIME),
    }
