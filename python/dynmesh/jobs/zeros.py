"""A hint for sequences whose sensors wrote zeros where nothing was observed."""

from collections.abc import Iterable, Iterator

import numpy as np

from ..draw.heatmap import ShownFrame
from ..frames.frame import Frame
from ..sequence import Mask, Positions

_LEAST_SHARE = 0.01


class ZeroCount:
    """Counts the positions of exactly (0, 0, 0) that no mask calls missing, after frame 0.

    Vertices that are there in frame 0 may belong there and are not counted.
    """

    def __init__(self) -> None:
        """Starts with a count of zero."""
        self._zeros = 0
        self._positions = 0
        self._from_the_start: Mask | None = None

    def add(self, number: int, points: Positions, known: Mask | None) -> None:
        """Takes the frame with this number into account."""
        zero: Mask = np.all(points == 0, axis=1)
        if known is not None:
            zero &= known
        if number == 0:
            self._from_the_start = zero
            return
        if self._from_the_start is not None:
            zero &= ~self._from_the_start
        self._zeros += int(np.count_nonzero(zero))
        self._positions += len(points)

    def watch(self, frames: Iterable[Frame], number: int = 0) -> Iterator[Frame]:
        """Counts while it passes frames on; `number` is that of the first frame."""
        for t, frame in enumerate(frames, number):
            self.add(t, frame.points, frame.known)
            yield frame

    def watch_shown(self, frames: Iterable[ShownFrame]) -> Iterator[ShownFrame]:
        """Does the same as :meth:`watch` for frames with their numbers."""
        for frame in frames:
            self.add(frame.number, frame.points, frame.visible)
            yield frame

    def hint(self) -> tuple[str, ...]:
        """Suggests --missing zero if there are more than a few; else returns nothing."""
        share = self._zeros / max(1, self._positions)
        if share <= _LEAST_SHARE:
            return ()
        return (
            f"{100 * share:.0f} % of the positions after the first frame are exactly (0, 0, 0); "
            "if nothing was observed there, use --missing zero",
        )
