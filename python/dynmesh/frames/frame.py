"""A frame of a sequence."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ..sequence import Mask, Positions, Sequence
from .attributes import VertexAttributes


@dataclass(frozen=True, eq=False)
class Frame(VertexAttributes):
    """One frame of a sequence. It can be unpacked: ``points, known = frame``.

    Attributes:
        points: (k, 3)
        known: (k,), or None if the sequence has no masks.
        generation: (k,), or None if the sequence has no provenance.
        age: (k,), or None if `generation` is.
        standard_error: (k,), or None if it was not estimated.
    """

    points: Positions
    known: Mask | None = None

    def __iter__(self) -> Iterator[Any]:
        """Yields the points and the mask."""
        yield self.points
        yield self.known


def frame_of(sequence: Sequence, number: int) -> Frame:
    """One frame of the sequence."""
    rows: dict[str, Any] = {name: rows[number] for name, rows in sequence.attributes().items()}
    return Frame(sequence.vertices[number], **rows)
