"""What is drawn of a sequence: its frames, its missing vertices, and a value per vertex."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import repeat
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..files import Frame, Reader
from ..files.reader import check_comparable
from ..metrics import bounding_box_diagonal
from ..sequence import Mask, Positions
from .scales import CountScale, ErrorScale, KnownScale, Scale, Values, round_up

Colour = Literal["error", "generation", "age", "known"]
"""What the colour of a vertex shows."""

_SMALLEST_LIMIT = 1e-6  # of the bounding-box diagonal: about what float32 positions resolve


@dataclass(frozen=True, eq=False)
class ShownFrame:
    """One frame as it is drawn.

    Attributes:
        number: in the sequence.
        points: (k, 3), arbitrary where a vertex is missing.
        visible: (k,) bool, False where a vertex is missing.
        values: (k,), shown by the colours, arbitrary where a vertex is missing; None for one
            colour.
    """

    number: int
    points: Positions
    visible: Mask
    values: Values | None

    def of(self, vertices: NDArray[np.intp]) -> "ShownFrame":
        """Returns the same frame with only some of its vertices."""
        values = None if self.values is None else self.values[vertices]
        return ShownFrame(self.number, self.points[vertices], self.visible[vertices], values)


class Heatmap:
    """The frames of a sequence with the values that their colours show.

    Attributes:
        reader: of the sequence.
        colour: what the colours show; None for nothing.
    """

    def __init__(
        self, reader: Reader, *, reference: Reader | None = None, colour: Colour | None = None
    ) -> None:
        """Determines what to show.

        Args:
            reader: of the sequence.
            reference: of the true sequence, for errors.
            colour: None chooses the error if there is a reference, otherwise the generation or the
                known mask if the sequence has them, otherwise nothing.

        Raises:
            ValueError: the sequence does not hold what `colour` requires, or does not match the
                reference; the message names the file.
        """
        self.reader = reader
        self.colour = colour or _most_telling(reader, reference)
        self._reference = reference
        if reference is not None:
            if self.colour != "error":
                raise ValueError(f"reference: requires the colour error, not {self.colour}")
            check_comparable(reader, reference)
            self._diagonal = bounding_box_diagonal(next(iter(reference)).points)
            if not self._diagonal > 0:
                raise ValueError(
                    f"{reference.path}: errors have no unit, as all of frame 0 is at one point"
                )
        elif self.colour == "error":
            raise ValueError("colour: error requires a reference")
        if self.colour in ("generation", "age") and not reader.has_provenance:
            raise ValueError(
                f"{reader.path}: holds no {self.colour}; dynmesh complete --provenance writes it"
            )
        if self.colour == "known" and not (reader.has_known or reader.has_provenance):
            raise ValueError(f"{reader.path}: holds no known masks")

    def frames(self, numbers: range) -> Iterator[ShownFrame]:
        """Yields frames of ascending numbers.

        Raises:
            ValueError: the reference lacks a vertex.
        """
        place = (numbers.start, numbers.stop, numbers.step)
        truths: Iterator[Frame] | repeat[None] = repeat(None)
        if self._reference is not None:
            truths = self._reference.frames(*place)
        for number, frame, truth in zip(numbers, self.reader.frames(*place), truths, strict=False):
            visible: Mask = np.asarray(np.isfinite(frame.points).all(axis=1))
            if frame.known is not None:
                visible &= frame.known
            yield ShownFrame(number, frame.points, visible, self._values(number, frame, truth))

    def scale(self, frames: Sequence[ShownFrame]) -> Scale | None:
        """Returns a colour scale for the values of all these frames, or None if there are none."""
        values: list[NDArray[Any]] = [
            frame.values[frame.visible] for frame in frames if frame.values is not None
        ]
        if self.colour is None:
            return None
        if self.colour == "known":
            return KnownScale(with_filled_in=self.reader.has_provenance)
        if self.colour == "error":
            # Not the maximum: with one outlier, everything else would have one colour.
            limit = max((np.percentile(v, 99) for v in values if len(v)), default=0.0)
            return ErrorScale(round_up(max(float(limit), _SMALLEST_LIMIT)))
        largest = max((int(v.max()) for v in values if len(v)), default=0)
        if self.colour == "age":
            title = "age: frames since last observed"
            return CountScale(title, largest, zero="observed")
        unseen = "unseen" if any((v < 0).any() for v in values) else None
        title = "generation: steps from the observed"
        return CountScale(title, max(largest, 0), zero="observed", minus_one=unseen)

    def _values(self, number: int, frame: Frame, truth: Frame | None) -> Values | None:
        if truth is not None and self._reference is not None:
            missing = ~np.isfinite(truth.points).all(axis=1)
            if truth.known is not None:
                missing |= ~truth.known
            if missing.any():
                raise ValueError(
                    f"{self._reference.path}: frame {number} lacks vertex {missing.argmax()}; "
                    "errors require a complete reference"
                )
            with np.errstate(invalid="ignore"):  # missing positions may be infinite
                difference = frame.points.astype(np.float64) - truth.points
            return np.asarray(np.linalg.norm(difference, axis=1) / self._diagonal)
        if self.colour == "known":
            return np.asarray(frame.generation == 0 if frame.known is None else frame.known, "i1")
        return None if self.colour is None else getattr(frame, self.colour)


def likely_up(first: Positions, said: str | None) -> str:
    """Returns the up axis: as the file states it, else z for a flat sheet, else y."""
    if said is not None:
        return said
    extent = np.ptp(first[np.isfinite(first).all(axis=1)], axis=0)
    return "z" if extent.argmin() == 2 and extent[2] < 0.25 * extent.max() else "y"


def whole_faces(
    faces: NDArray[np.integer[Any]], visible: Mask
) -> tuple[NDArray[np.integer[Any]], Mask]:
    """Returns the triangles without missing vertices, and the visible vertices in none of them."""
    whole = faces[visible[faces].all(axis=1)]
    alone = visible.copy()
    alone[whole] = False
    return whole, alone


def _most_telling(reader: Reader, reference: Reader | None) -> Colour | None:
    if reference is not None:
        return "error"
    if reader.has_provenance:
        return "generation"
    return "known" if reader.has_known else None
