"""A hint for those whose sensors write zeros where they saw nothing."""

from collections.abc import Iterable, Iterator

import numpy as np

from ..draw.heatmap import ShownFrame
from ..files import Frame
from ..sequence import Mask, Positions
from .terminal import say

_least_share = 0.01


class Zeros:
    """Counts the positions of exactly (0, 0, 0) that no mask calls missing, after frame 0."""

    def __init__(self) -> None:
        """Has seen none."""
        self._zeros = 0
        self._positions = 0

    def watch(self, frames: Iterable[Frame], number: int = 0) -> Iterator[Frame]:
        """Passes frames on while it counts; `number` is that of the first."""
        for place, frame in enumerate(frames, number):
            self._count(place, frame.points, frame.known)
            yield frame

    def watch_shown(self, frames: Iterable[ShownFrame]) -> Iterator[ShownFrame]:
        """As :meth:`watch`, of frames that know their number."""
        for frame in frames:
            self._count(frame.number, frame.points, frame.visible)
            yield frame

    def say_if_many(self) -> None:
        """Says how to call them missing, if they are more than a few."""
        share = self._zeros / max(1, self._positions)
        if share > _least_share:
            say(
                f"{100 * share:.0f} % of the positions after frame 0 are exactly (0, 0, 0); "
                "if nothing was observed there, --missing zero"
            )

    def _count(self, number: int, points: Positions, known: Mask | None) -> None:
        if number == 0:
            return
        zero = ~points.any(axis=1)
        self._zeros += int(np.count_nonzero(zero if known is None else zero & known))
        self._positions += len(points)
