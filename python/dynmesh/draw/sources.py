"""What is shown beside one another: a sequence, those that it is compared with, and scans."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..degrade.shared import mean_edge_of
from ..files import Frame, Reader
from ..metrics import bounding_box_diagonal
from ..scans import ScanReader
from ..sequence import Mask, Positions


class LengthUnit(NamedTuple):
    """The unit in which lengths are shown, as it follows a number and as words in a title."""

    sign: str
    words: str
    per_unit: float
    """So many are a unit of the positions."""


@dataclass(frozen=True, eq=False)
class Sources:
    """The shown sequence, the true one, that with the vertices that were observed, and scans.

    The unit of the scans is `scan_factor` times that of the sequence.
    """

    reader: Reader
    reference: Reader | None = None
    input: Reader | None = None
    scans: ScanReader | None = None
    scan_factor: float = 1.0

    @cached_property
    def diagonal(self) -> float:
        """Of the bounding box of frame 0, of the reference if there is one."""
        return bounding_box_diagonal(next(iter(self.reference or self.reader)).points)

    @cached_property
    def mean_edge(self) -> float:
        """Of frame 0 of the sequence."""
        return mean_edge_of(next(iter(self.reader)).points, self.reader.faces)

    @cached_property
    def unit(self) -> LengthUnit:
        """Millimetres if a file states its unit, otherwise per cent of the diagonal.

        Raises:
            ValueError: the files state different units, or the diagonal is needed and 0.
        """
        said = {
            reader.header.metres_per_unit: reader.path
            for reader in (self.reader, self.reference)
            if reader is not None and reader.header.metres_per_unit is not None
        }
        if len(said) > 1:
            (ours, path), (theirs, reference) = said.items()
            raise ValueError(f"{path} has {ours:g} metres per unit, but {reference} has {theirs:g}")
        if said:
            return LengthUnit("mm", "mm", 1000 * next(iter(said)))
        if not self.diagonal > 0:
            path = (self.reference or self.reader).path
            raise ValueError(
                f"{path}: errors have no unit, as all of the first frame is at one point"
            )
        return LengthUnit("%", "% of the bounding-box diagonal", 100 / self.diagonal)


@dataclass(frozen=True, eq=False)
class Moment:
    """A frame of each of the :class:`Sources`; the cloud is in the unit of the sequence."""

    number: int
    frame: Frame
    truth: Frame | None
    given: Frame | None
    cloud: Positions | None = None


def visible(frame: Frame) -> Mask:
    """Returns which vertices have a position, (k,) bool."""
    finite: Mask = np.asarray(np.isfinite(frame.points).all(axis=1))
    return finite if frame.known is None else finite & frame.known
