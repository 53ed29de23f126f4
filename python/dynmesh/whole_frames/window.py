"""The frames that are used, what is beside what on their mesh, and how long its edges are."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .. import _arrays
from .._arrays import Floats, Integers, Mask, Positions
from .._errors import InputError
from ..frame import LARGEST, Frame, Frames
from ..topology import cells, edges_of


class Mesh:
    """The triangles of a mesh, and the vertices beside each vertex."""

    def __init__(self, triangles: Integers, n_vertices: int) -> None:
        if len(triangles) == 0:
            message = "is empty; completion needs the connectivity of the mesh"
            raise InputError(message, argument="faces")
        self.triangles = triangles
        self.offsets, self.neighbours = cells(triangles, n_vertices)
        self.edges = edges_of(triangles, n_vertices)

    def beside(self, vertices: Integers) -> tuple[Integers, Integers]:
        """The neighbours of some vertices: for each, its place among them and the neighbour."""
        counts = (self.offsets[1:] - self.offsets[:-1])[vertices]
        place = np.repeat(np.arange(len(vertices)), counts)
        within = np.arange(len(place)) - (np.cumsum(counts) - counts)[place]
        return place, self.neighbours[self.offsets[vertices][place] + within]

    def edges_to(self, marked: Mask) -> Integers:
        """(k,) the number of edges to the nearest marked vertex, -1 where none leads to one."""
        distance = np.where(marked, 0, -1)
        reached: Integers = np.flatnonzero(marked)
        while len(reached):
            near = np.unique(self.beside(reached)[1])
            near = near[distance[near] < 0]
            distance[near] = distance[reached[0]] + 1
            reached = near
        return distance

    def pairs_two_edges_apart(self) -> Integers:
        """(p, 2) pairs of vertices that share a neighbour but no edge, each once."""
        k = len(self.offsets) - 1
        place, far = self.beside(self.neighbours)
        near = np.repeat(np.arange(k), np.diff(self.offsets))[place]
        codes = np.unique((near * k + far)[near < far])
        codes = np.setdiff1d(codes, self.edges[:, 0] * k + self.edges[:, 1], assume_unique=True)
        return np.stack(np.divmod(codes, k), axis=1)


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


def log_lengths(points: Floats, pairs: Integers) -> Floats:
    """The logarithms of the distances of pairs of vertices; -infinity at one place."""
    x, y, z = np.moveaxis(points[..., pairs[:, 0], :] - points[..., pairs[:, 1], :], -1, 0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.hypot(np.hypot(x, y), z)))


@dataclass(frozen=True)
class Lengths:
    """Logarithms of the distances of pairs of vertices, over the frames that know both.

    Attributes:
        median: mu; NaN if no frame knows both.
        spread: sigma, from the median deviation.
        told: whether enough frames know them to say what is usual.
    """

    median: Floats
    spread: Floats
    told: Mask

    @classmethod
    def of(cls, logarithms: Floats) -> "Lengths":
        """Those of (n, p) logarithms, of which the finite ones count."""
        finite = np.isfinite(logarithms)
        n, columns = np.count_nonzero(finite, axis=0), np.arange(logarithms.shape[1])

        def median(values: Floats) -> Floats:
            ordered = np.sort(np.where(finite, values, np.nan), axis=0)  # NaN last
            return np.asarray((ordered[(n - 1) // 2, columns] + ordered[n // 2, columns]) / 2)

        with np.errstate(invalid="ignore"):
            middle = median(logarithms)
            return cls(middle, 1.48 * median(np.abs(logarithms - middle)), n >= 3)

    def typical(self) -> "Lengths":
        """(1,) the median over the pairs of their medians, and the spread of these."""
        return Lengths.of(np.append(self.median, np.nan)[:, None])  # of which there may be none


def usual_lengths(window: Window, pairs: Integers) -> Lengths:
    """Frames in which both are at one place do not count."""
    n_at_once = max(1, 1_000_000 // len(window.numbers))
    parts = []
    for first in range(0, max(1, len(pairs)), n_at_once):
        some = pairs[first : first + n_at_once]
        vertices, places = np.unique(some, return_inverse=True)
        places = places.reshape(some.shape)
        known = window.known[:, vertices]
        both = known[:, places[:, 0]] & known[:, places[:, 1]]
        points = np.where(known[..., None], window.positions[:, vertices], 0).astype(np.float64)
        parts.append(Lengths.of(np.where(both, log_lengths(points, places), np.nan)))
    columns = zip(*((one.median, one.spread, one.told) for one in parts), strict=True)
    return Lengths(*map(np.concatenate, columns))


def without_outliers(mesh: Mesh, window: Window) -> Mask:
    """(n, k) the known positions that do not contradict other frames.

    Those contradict them of which at least half of the pairs have another length than usual, among
    edges alone or among edges and pairs two edges apart.
    """
    kept = window.known.copy()
    k = kept.shape[1]
    votes, against = np.zeros((2, *kept.shape), np.int64)
    for pairs in (mesh.edges, mesh.pairs_two_edges_apart()):
        usual = usual_lengths(window, pairs)
        for t, known in enumerate(window.known):
            counted = usual.told & known[pairs].all(axis=1)
            points = np.where(known[:, None], window.positions[t], 0).astype(np.float64)
            off = np.abs(log_lengths(points, pairs[counted]) - usual.median[counted])
            wrong = off > 0.7 + 4 * usual.spread[counted]
            votes[t] += np.bincount(pairs[counted].ravel(), minlength=k)
            against[t] += np.bincount(pairs[counted][wrong].ravel(), minlength=k)
        kept &= (votes == 0) | (2 * against < votes)
    return kept


def deviation_of(mesh: Mesh, usual: Lengths, frame: Floats, known: Mask) -> tuple[float, float]:
    """How far edges with an end that is not known are from their usual length, on average.

    Logarithms, and the same of frames that know both ends. Those that fewer than three frames know
    may be torn: they are compared with the longest of the others. Where they are short, little can
    be wrong.
    """
    typical = usual.typical()
    # 0.84 spreads are the mean absolute deviation of a normal distribution.
    expected = np.where(usual.told, 0.84 * usual.spread, 0)
    length = np.maximum(log_lengths(frame, mesh.edges), -700)  # about the smallest there is
    too_long = np.maximum(length - (typical.median + 4 * typical.spread), 0)
    off = np.where(usual.told, np.abs(length - usual.median), too_long)
    counted = ~known[mesh.edges].all(axis=1) & (usual.told | typical.told)
    if not counted.any():
        return 0.0, 0.0
    return float(off[counted].mean()), float(expected[counted].mean())
