"""A sequence in memory, as a reader."""

from collections.abc import Iterator
from pathlib import Path

from ..sequence import Sequence
from .frame import Frame, frame_of
from .header import header_of
from .reader import Reader


class SequenceReader(Reader):
    """A sequence in memory that is read like a file."""

    def __init__(self, sequence: Sequence, name: str = "sequence") -> None:
        """Takes a sequence, and the name that stands for the file in messages."""
        self._sequence = sequence
        super().__init__(Path(name), header_of(sequence))

    @property
    def files(self) -> list[Path]:
        """None is read."""
        return []

    def _frames(self, numbers: range) -> Iterator[Frame]:
        return (frame_of(self._sequence, number) for number in numbers)
