"""Says that many positions are zeros, while a command reads them."""

from collections.abc import Iterable, Iterator

from ..draw.heatmap import ShownFrame
from ..files import Frame
from ..jobs.zeros import ZeroCount
from .terminal import say


class Zeros:
    """Counts the positions of exactly (0, 0, 0) in frames that pass by."""

    def __init__(self) -> None:
        """Starts with a count of zero."""
        self._count = ZeroCount()

    def watch(self, frames: Iterable[Frame], number: int = 0) -> Iterator[Frame]:
        """Counts while it passes frames on; `number` is that of the first frame."""
        for t, frame in enumerate(frames, number):
            self._count.add(t, frame.points, frame.known)
            yield frame

    def watch_shown(self, frames: Iterable[ShownFrame]) -> Iterator[ShownFrame]:
        """Does the same as :meth:`watch` for frames with their numbers."""
        for frame in frames:
            self._count.add(frame.number, frame.points, frame.visible)
            yield frame

    def say_if_many(self) -> None:
        """Suggests --missing zero if there are more than a few."""
        for hint in self._count.hint():
            say(hint)
