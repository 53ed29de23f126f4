"""A frame of a sequence."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._errors import InputError
from ..attributes import VertexAttributes
from ..sequence import Mask, Positions

LARGEST = {4: 1e18, 8: 1e200}
"""The largest coordinates that a completer accepts, by the bytes of a coordinate."""


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

    @property
    def present(self) -> Mask:
        """(k,) bool, which vertices have a position that can be used, observed or estimated."""
        with np.errstate(invalid="ignore"):
            usable = np.abs(self.points) <= LARGEST[self.points.dtype.itemsize]
        there: Mask = np.asarray(usable.all(axis=1))
        return there if self.known is None else there & self.known

    @property
    def claimed(self) -> Mask:
        """(k,) bool, which vertices were observed, by what the frame says of them.

        These are the known ones or, without a mask, those whose position is finite; and of them,
        where there are generations, those of generation 0. All others were estimated, and are so
        again when the frame is completed again.
        """
        said = np.isfinite(self.points).all(axis=1) if self.known is None else self.known
        return np.asarray(said if self.generation is None else said & (self.generation == 0))

    @property
    def observed(self) -> Mask:
        """(k,) bool, which vertices were observed and have a position that can be used."""
        return self.claimed & self.present

    def __iter__(self) -> Iterator[Any]:
        """Yields the points and the mask."""
        yield self.points
        yield self.known


def check_whole(frame: Frame, advice: str) -> None:
    """Refuses a frame with missing vertices; the advice ends the message."""
    missing = np.flatnonzero(~frame.present)
    if len(missing):
        raise InputError(
            f"{len(missing)} of {len(frame.points)} vertices "
            f"{'is' if len(missing) == 1 else 'are'} missing, the first is vertex {missing[0]}"
            f"{advice}"
        )
