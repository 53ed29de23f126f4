"""A hint for sequences whose sensors wrote zeros where nothing was observed."""

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
        """Starts with a count of zero."""
        self._zeros = 0
        self._positions = 0

    def watch(self, frames: Iterable[Frame], number: int = 0) -> Iterator[Frame]:
        """Counts while it passes frames on; `number` is that of the first frame."""
        for place, frame in enumerate(frames, number):
            self._count(place, frame.points, frame.known)
            yield frame

    def watch_shown(self, frames: Iterable[ShownFrame]) -> Iterator[ShownFrame]:
        """Does the same as :meth:`watch` for frames with their numbers."""
        for frame in frames:
            self._count(frame.number, frame.points, frame.visible)
            yield frame

    def say_if_many(self) -> None:
        """Suggests --missing zero if there are more than a few."""
        share = self._zeros / max(1, self._positions)
        if share > _least_share:
            say(
                f"{100 * share:.0f} % of the positions after frame 0 are exactly (0, 0, 0); "
                "if nothing was observed there, use --missing zero"
            )

    def _count(self, number: int, points: Positions, known: Mask | None) -> None:
        if number == 0:
            return
        zero = ~points.any(axis=1)
        self._zeros += int(np.count_nonzero(zero if known is None else zero & known))
        self._positions += len(points)
