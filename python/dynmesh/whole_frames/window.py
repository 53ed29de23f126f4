"""The frames that are used, and how they are read."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .. import _arrays
from .._arrays import Mask, Positions
from .._errors import InputError
from ..frame import LARGEST, Frame, Frames


@dataclass
class Window:
    """The frames that are used, with what they know.

    Attributes:
        numbers: of the frames in the sequence, ascending.
        base: the index of the frame to be made whole.
        positions: (n, k, 3), arbitrary where they are not known.
        known: (n, k)
    """

    numbers: list[int]
    base: int
    positions: Positions
    known: Mask

    def seen(self, frames: range | slice = slice(None)) -> Mask:
        """(k,) the vertices that at least one of these frames knows."""
        return np.asarray(self.known[frames].any(axis=0))


def _frame(reader: Frames, number: int, frame: Frame) -> tuple[Positions, Mask]:
    """Returns the positions and the mask of a frame."""
    points = _arrays.points("points", frame.points, reader.dtype)
    known = _arrays.known_mask(frame.claimed)
    largest = LARGEST[points.dtype.itemsize]
    with np.errstate(invalid="ignore"):
        wrong = known & ~(np.abs(points) <= largest).all(axis=1)
    if wrong.any():
        vertex = int(wrong.argmax())
        at = tuple(points[vertex].tolist())
        limit = f" and below {largest:.0e}".replace("+", "") if np.isfinite(at).all() else ""
        raise InputError(
            f"vertex {vertex} is at {at}, but known positions must be finite{limit}",
            frame=reader.header.number(number),
        )
    return points, known


def survey(reader: Frames) -> tuple[list[int], Mask]:
    """The number of vertices that each frame knows, and which any of them knows."""
    counts, seen = [], np.zeros(reader.n_vertices, np.bool_)
    for number, frame in enumerate(reader.frames()):
        _, known = _frame(reader, number, frame)
        counts.append(int(np.count_nonzero(known)))
        seen |= known
    return counts, seen


def best_frame(counts: list[int]) -> int:
    """The frame that knows most vertices; of several, the one that is nearest to the middle."""
    middle = (len(counts) - 1) / 2
    return max(range(len(counts)), key=lambda t: (counts[t], -abs(t - middle), -t))


def window_around(reader: Frames, base: int) -> Window:
    """Up to 250 frames all, of more the nearest 30 on each side, and then with growing steps."""
    growth = 1 if reader.n_frames <= 250 else 1.05

    def distances(farthest: int) -> Iterator[int]:
        at, step, n = 1.0, 1.0, 1
        while (distance := math.floor(at + 0.5)) <= farthest:
            yield distance
            step *= growth if n >= 30 else 1
            at, n = at + step, n + 1

    before = [base - distance for distance in distances(base)]
    after = [base + distance for distance in distances(reader.n_frames - 1 - base)]
    numbers = [*before[::-1], base, *after]
    shape = (len(numbers), reader.n_vertices)
    window = Window(
        numbers, len(before), np.empty((*shape, 3), reader.dtype), np.empty(shape, np.bool_)
    )
    frames, following = reader.frames(), 0
    try:
        for index, number in enumerate(numbers):
            if number != following:
                frames.close()
                frames = reader.frames(number)
            following = number + 1
            points, known = _frame(reader, number, next(frames))
            window.positions[index], window.known[index] = points, known
    finally:
        frames.close()
    return window
