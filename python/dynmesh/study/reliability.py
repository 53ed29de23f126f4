"""How well the standard errors of method detail describe its errors."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import metrics
from .._core import Completer
from ..calibration import Calibrating, Calibration, share_within
from ..sequence import Mask, Positions
from .subjects import Subject

Floats = NDArray[np.float64]

_INTERVALS = 20
_PER_DECADE = 6  # bins of predicted errors
_FEWEST = 100  # vertices of a bin that is shown


@dataclass(frozen=True, eq=False)
class Reliability:
    """Standard errors compared with true errors, over the filled-in vertices of all frames.

    Attributes:
        calibration: the summary.
        nominal: the shares of errors that intervals should hold, from 0 to 1.
        held: the shares that they hold.
        predicted: root mean square errors as predicted, ascending, in bounding-box diagonals.
        observed: the root mean square errors of the vertices with these predictions.
    """

    calibration: Calibration
    nominal: Floats
    held: Floats
    predicted: Floats
    observed: Floats


def reliability(
    subject: Subject,
    masks: Iterable[Mask],
    *,
    training: Positions | None = None,
    noise: float | None = None,
    advance: Callable[[int], object] = lambda _: None,
) -> Reliability | None:
    """Complete the frames after frame 0, and compare; None if nothing was filled in.

    Args:
        subject: the sequence.
        masks: (k,) bool for every frame, that of frame 0 included.
        training: see :class:`dynmesh.Completer`.
        noise: the standard deviation of the noise that is added to the known positions, of which
            the completer is told; None adds none.
        advance: called with the number of frames that were completed since the last call.
    """
    completer = Completer(
        subject.faces,
        subject.vertices[0],
        method="detail",
        uncertainty=True,
        training=training,
        noise=noise,
    )
    rng = np.random.default_rng(0)
    calibrating = Calibrating()
    shares = np.zeros(_INTERVALS)
    sums: dict[int, Floats] = {}
    for number, known in enumerate(masks):
        if number == 0:
            continue
        points = subject.vertices[number]
        seen = points if noise is None else points + noise * rng.normal(size=points.shape)
        frame = completer.push(seen.astype(points.dtype), known)
        error = np.asarray(metrics.vertex_error(points[None], frame[None])[0])
        bars, generation = completer.standard_error, completer.generation
        filled = (generation > 0) & np.isfinite(bars)
        calibrating.add(error, bars, filled=filled, generation=generation, age=completer.age)
        off, expected = error[filled], bars[filled].astype(np.float64)
        counted = expected > 0
        shares_within = share_within(off[counted] / expected[counted])
        shares += np.histogram(shares_within, _INTERVALS, (0, 1))[0]
        _add_by_prediction(sums, off[counted], np.sqrt(3) * expected[counted], subject.diagonal)
        advance(1)
    calibration = calibrating.result()
    if calibration is None:
        return None
    held = np.concatenate([[0], np.cumsum(shares)]) / max(1.0, shares.sum())
    rows = np.array([row for _, row in sorted(sums.items()) if row[0] >= _FEWEST]).reshape(-1, 3)
    predicted, observed = np.sqrt(rows[:, 1:] / rows[:, :1]).T
    return Reliability(calibration, np.linspace(0, 1, _INTERVALS + 1), held, predicted, observed)


def _add_by_prediction(
    sums: dict[int, Floats], error: Floats, predicted: Floats, unit: float
) -> None:
    """Add the number and the squares of predicted and true errors, by size of the prediction."""
    bins = np.floor(_PER_DECADE * np.log10(predicted / unit)).astype(int)
    squares = np.stack([np.ones_like(error), (predicted / unit) ** 2, (error / unit) ** 2], axis=1)
    for number in np.unique(bins).tolist():
        sums[number] = sums.get(number, np.zeros(3)) + squares[bins == number].sum(axis=0)
