"""Whether the edges of completed frames are about as long as where completion started."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..diagnosis.finding import frames_listed, percent
from ..files import Header
from ..files.units import explaining
from ..sequence import Positions

_EDGES = 5000  # that are measured, at most twice as many
_TIMES = 4.0
_SHORT = 0.1
"""Of a mean edge; it is added to all lengths, so that short edges may change by more."""
_RUINED = 0.1
"""A frame is probably ruined if more of its edges are `_TIMES` as long or as short as they were. Of
people, animals, faces and cloth, completed from what one camera sees, less than 0.03 are; if a
tenth of the vertices lies at the origin, 0.17."""
_UNIT = 1.3
"""Another unit explains changes whose quartiles differ, and from whose median it differs, by less
than this factor."""


class Lengths:
    """Compares the edges of frames with those of a whole one."""

    def __init__(self, faces: NDArray[np.integer[Any]], whole: Positions) -> None:
        """Measures the whole frame."""
        self._ends = faces[:: 1 + len(faces) // _EDGES, :2]
        self._usual = self._of(whole)
        self._ruined: list[int] = []
        self._most, self._ratios = _RUINED, np.ones(3)

    def _of(self, points: Positions) -> NDArray[np.float64]:
        a, b = points[self._ends].astype(np.float64).transpose(1, 0, 2)
        with np.errstate(over="ignore"):
            return np.asarray(np.linalg.norm(a - b, axis=1))

    def add(self, number: int, points: Positions) -> None:
        """Measures a frame, counted from 0; the numbers ascend."""
        if not self._usual.any():
            return
        lengths, short = self._of(points), _SHORT * self._usual.mean()
        changes = np.log((lengths + short) / (self._usual + short))
        share = float(np.mean(np.abs(changes) > math.log(_TIMES)))
        if share > _RUINED:
            self._ruined.append(number)
        if share > self._most:
            ratios = lengths[self._usual > 0] / self._usual[self._usual > 0]
            self._most, self._ratios = share, np.quantile(ratios, (0.25, 0.5, 0.75))

    def told(self, header: Header, start: str) -> str:
        """Says which frames are probably ruined; empty if none are. `start` is the whole frame."""
        told = []
        flat = np.count_nonzero(self._usual == 0) / max(1, len(self._usual))
        if flat > _RUINED:
            told.append(f"{percent(flat)} of the edges of {start} have no length")
        if self._ruined:
            told.append(
                f"in {frames_listed(self._ruined, header)}, up to {percent(self._most)} of the "
                f"edges are more than {_TIMES:g} times as long or as short as in {start}"
            )
        low, ratio, high = self._ratios.tolist()
        pairs = explaining(ratio, _UNIT) if 0 < high < _UNIT * low else []
        if told and pairs:
            told[-1] += ", as if that were in {} and they in {}".format(*pairs[0])
        return f"probably ruined: {'; '.join(told)}; dynmesh info looks for causes" if told else ""
