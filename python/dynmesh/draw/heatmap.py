"""What is drawn of a sequence: its frames, its missing vertices, and values of the vertices."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import InitVar, dataclass, field
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Mask, Positions
from .._errors import InputError
from ..formats.comparison import check_comparable, check_same_size
from ..frame import Frames
from ..scans import ScanReader
from .quantities import QUANTITIES, Colour, Moment, Sources
from .scales import Scale, Values

_MOST_POINTS = 5000
"""Of a scan in a frame; more would make a page large and look the same."""


@dataclass(frozen=True, eq=False)
class ShownFrame:
    """One frame as it is drawn.

    The points, (k, 3), and the values that colours can show, (k,) each, are arbitrary where a
    vertex is not visible. Beside it is the same frame of "input" and "reference", if there are
    any, and some points of the scan, (n, 3), if there are scans.
    """

    number: int
    points: Positions
    visible: Mask
    values: Mapping[Colour, Values]
    beside: Mapping[str, "ShownFrame"]
    cloud: Positions | None = None

    def of(self, vertices: NDArray[np.intp]) -> "ShownFrame":
        """Returns the same frame with only some of its vertices."""
        values = {colour: values[vertices] for colour, values in self.values.items()}
        beside = {name: frame.of(vertices) for name, frame in self.beside.items()}
        return ShownFrame(
            self.number, self.points[vertices], self.visible[vertices], values, beside, self.cloud
        )


@dataclass(eq=False, kw_only=True)
class Heatmap(Sources):
    """The frames of a sequence with the values that their colours can show.

    It determines what can be shown, and the colour that is shown at first: `wanted`, or else the
    error if there is a reference, otherwise the generation or the known mask if the sequence has
    them, otherwise the distance if there are scans, otherwise "plain". Errors are in millimetres if
    a file states its unit, otherwise in per cent of the bounding-box diagonal of frame 0 of the
    reference.

    Attributes:
        colours: what the colours can show: "plain", which is one colour, comes last.
        colour: what they show at first.
    """

    wanted: InitVar[Colour | None] = None
    colours: tuple[Colour, ...] = field(init=False)
    colour: Colour = field(init=False)

    def __post_init__(self, wanted: Colour | None) -> None:
        for other in (self.input, self.reference):
            if other is not None:
                check_comparable(self.reader, other)
        if self.reference is not None:
            check_same_size(self.reader, self.reference)
        lacks: dict[Colour, str | None] = {n: row.lacks(self) for n, row in QUANTITIES.items()}
        lacks["plain"] = None
        unknown = f"must be one of {', '.join(lacks)}, not {wanted!r}"
        if wanted is not None and (reason := lacks.get(wanted, unknown)) is not None:
            raise InputError(reason, argument="colour", value=wanted)
        self.colours = tuple(name for name, reason in lacks.items() if reason is None)
        self.colour = wanted or self.colours[0]
        if {"error", "standard_error"} & set(self.colours):
            _ = self.unit  # refuses errors without a unit before any frame is read
        elif self.colour_range is not None:
            message = "is that of errors and standard errors, of which there are none"
            raise InputError(message, argument="colour_range", value=self.colour_range)

    def frames(self, numbers: range) -> Iterator[ShownFrame]:
        """Yields frames of ascending numbers."""
        given = (self.reader, self.reference, self.input, self.scans)
        for number, frame, truth, partial, scan in zip(
            numbers, *(_frames_of(one, numbers) for one in given), strict=False
        ):
            cloud = None
            if self.scans is not None:  # in the unit of the sequence; empty if a scan is missing
                cloud = np.zeros((0, 3)) if scan is None else scan.scaled(self.scan_factor).cloud
            moment = Moment(number, frame, truth, partial, cloud)
            values = {
                name: row.values(self, moment)
                for name, row in QUANTITIES.items()
                if name in self.colours
            }
            beside = {
                name: ShownFrame(number, other.points, other.present, {}, {})
                for name, other in (("input", partial), ("reference", truth))
                if other is not None
            }
            if cloud is not None:
                cloud = cloud[:: max(1, -(-len(cloud) // _MOST_POINTS))]
            yield ShownFrame(number, frame.points, frame.present, values, beside, cloud)

    def scale(self, colour: Colour, frames: Iterable[ShownFrame]) -> Scale | None:
        """Returns the scale of this colour for frames, or None for the colour "plain"."""
        if colour == "plain":
            return None
        # Standard errors are shown on the scale of the errors, so that the two compare.
        source = "error" if colour == "standard_error" and "error" in self.colours else colour
        seen = [frame.values[source][frame.visible] for frame in frames]
        return QUANTITIES[colour].scale(self, seen)


def _frames_of(reader: Frames | ScanReader | None, numbers: range) -> Iterator[Any]:
    """Yields what is read at these numbers; None forever without a reader."""
    if reader is None:
        return repeat(None)
    return reader.frames(numbers.start, numbers.stop, numbers.step)


def stated_up(*readers: Frames | None) -> str | None:
    """Returns the up axis that the first of these files states that states one."""
    axes = (None if reader is None else reader.header.up_axis for reader in readers)
    return next((axis for axis in axes if axis is not None), None)


def whole_faces(
    faces: NDArray[np.integer[Any]], visible: Mask
) -> tuple[NDArray[np.integer[Any]], Mask]:
    """Returns the triangles without missing vertices, and the visible vertices in none of them."""
    whole = faces[visible[faces].all(axis=1)]
    alone = visible.copy()
    alone[whole] = False
    return whole, alone
