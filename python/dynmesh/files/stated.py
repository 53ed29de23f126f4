"""What a user says of a sequence whose file does not, and which of its frames are meant."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from .._errors import InputError
from ..frames.frame import Frame
from ..frames.header import Header
from ..frames.reader import Reader
from ..frames.times import frame_numbers, indices_of
from .scans import given_unit

Axis: TypeAlias = Literal["x", "y", "z"]
Unit: TypeAlias = str | float
"""The name of a unit of length, or its metres."""


class StatedReader(Reader):
    """Some frames of a sequence, with the up axis and the unit that its file does not state."""

    def __init__(
        self, reader: Reader, up: Axis | None, unit: Unit | None, frames: slice | range
    ) -> None:
        """Takes ownership of `reader`, which :meth:`close` closes.

        Raises:
            TypeError, ValueError: the file states another axis or unit, or has no such frames.
        """
        self._reader = reader
        header = reader.header
        self._indices = indices_of(frame_numbers(header), frames)
        super().__init__(reader.path, _stated(_cut(header, self._indices), up, unit))
        self.whole = 0

    @property
    def whole(self) -> int | None:
        """See :class:`Reader`."""
        return self._whole

    @whole.setter
    def whole(self, number: int | None) -> None:
        self._whole = number
        self._reader.whole = None if number is None else self._indices[number]

    @property
    def files(self) -> list[Path]:
        """The files that are read."""
        return self._reader.files

    @property
    def lost(self) -> frozenset[int]:
        """The frames whose files are missing."""
        return frozenset(n for n, index in enumerate(self._indices) if index in self._reader.lost)

    def _frames(self, numbers: range) -> Iterator[Frame]:
        kept = self._indices[numbers.start : numbers.stop : numbers.step]
        return self._reader.frames(kept.start, kept.stop, kept.step)

    def close(self) -> None:
        """Closes the file."""
        self._reader.close()


def _cut(header: Header, indices: range) -> Header:
    numbers = frame_numbers(header)[indices]
    consecutive = header.times is None and indices.step == 1
    return replace(
        header,
        n_frames=len(indices),
        start=float(numbers[0]),
        times=None if consecutive else numbers,
    )


def _stated(header: Header, up: Axis | None, unit: Unit | None) -> Header:
    """The header with this axis and unit, which it must not contradict."""
    metres = None if unit is None else given_unit("unit", unit)
    if up is not None and header.up_axis not in (None, up):
        raise InputError(f"the file states {header.up_axis}, not {up}", argument="up")
    stated = header.metres_per_unit
    if metres is not None and stated is not None and not np.isclose(stated, metres, rtol=1e-9):
        raise InputError(
            f"the file states units of {stated:g} m, not {metres:g} m", argument="unit"
        )
    return replace(header, up_axis=up or header.up_axis, metres_per_unit=metres or stated)
