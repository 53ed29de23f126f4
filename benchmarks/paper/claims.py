"""The claims of the paper, judged by the numbers of a run."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import linregress

from ..harness import NMSVE_UNIT
from ..methods import LIA, LIA_HARMONIC, LSM, MOTION, Method
from .study import Study

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
