"""Known positions that are watched while they are read: those that are held."""

import contextlib
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .._arrays import Floats, Integers, Mask, Positions
from .._report import counted, few, few_frames
from ..frame import Frame, Frames
from ..header import Header
from ..topology import components_of, edges_of

_MANY_TIMES = 5.0
_LEAST = 1e-3
"""The motion differs between a held position and a moved neighbour by more than so many times as
much as between the latter and others that moved, by their median, and than this share of the mean
edge, as of outliers."""


def _medians_at(edges: Integers, values: Floats, n_vertices: int) -> Floats:
    """Returns the upper median of the values of edges at each vertex; 0 without any."""
    both, twice = np.concatenate([edges[:, 0], edges[:, 1]]), np.tile(values, 2)
    order = np.lexsort([twice, both])
    counts = np.bincount(both, minlength=n_vertices)
    middle = np.cumsum(counts) - counts + counts // 2
    has_any, medians = counts > 0, np.zeros(n_vertices)
    medians[has_any] = twice[order[middle[has_any]]]
    return medians


class Places:
    """Counts vertices in frames, and keeps which ones they are.

    Attributes:
        count: how many there were, over all frames.
        frames: in which there were any.
    """

    def __init__(self, n_vertices: int) -> None:
        self.count = 0
        self.frames: list[int] = []
        self._met = np.zeros(n_vertices, np.bool_)

    def add(self, number: int, mask: Mask) -> None:
        """Adds those of a frame."""
        if n := int(np.count_nonzero(mask)):
            self.count += n
            self.frames.append(number)
            self._met |= mask

    @property
    def vertices(self) -> Integers:
        """Those that were met in any frame."""
        return np.flatnonzero(self._met)

    def told(self, header: Header) -> str:
        """Lists the first of them, such as "in frames 3 and 4: vertices 3, 7 and 12 others"."""
        return f"in {few_frames(sorted(self.frames), header)}: {few('vertex', self.vertices)}"


class Held:
    """Finds positions that a sensor repeats where it has lost what it follows.

    They are bit for bit those of the last frame, while the surface beside them moved on, and stay
    held as long as they are repeated. What rests beside a surface whose motion begins smoothly is
    not held, nor is what has never moved, as the rod of a curtain, nor anything where most rests.
    """

    def __init__(self, edges: Integers, mean_edge: float) -> None:
        self._edges, self._least = edges, _LEAST * mean_edge
        self._last: tuple[Positions, Mask] | None = None
        self._held: Mask | None = None
        self._moved: Mask | None = None

    def watch(self, points: Positions, known: Mask) -> Mask:
        """Takes the next frame into account, and returns which of its vertices are held."""
        last, self._last = self._last, (points, known)
        if last is None:
            return np.zeros(len(points), np.bool_)
        both = known & last[1]
        same = both & (points == last[0]).all(axis=1)
        held: Mask = np.zeros_like(same) if self._held is None else same & self._held
        if same.any() and 2 * np.count_nonzero(same) < np.count_nonzero(both):
            begins = same if self._moved is None else same & self._moved
            held |= begins & self._tears_off(last[0], points, both, same)
        self._held = held
        moves = held | (both & ~same)
        self._moved = moves if self._moved is None else self._moved | moves
        return held

    def _tears_off(self, before: Positions, points: Positions, both: Mask, same: Mask) -> Mask:
        """Whether vertices are in a part that rests and most edges tear off."""
        edges = self._edges[both[self._edges].all(axis=1)]
        motion = np.where(both[:, None], points.astype(np.float64) - before, 0.0)
        apart = np.linalg.norm(motion[edges[:, 0]] - motion[edges[:, 1]], axis=1)
        stays = same[edges]
        moved, border = ~stays.any(axis=1), stays[:, 0] != stays[:, 1]
        part = components_of(edges[stays.all(axis=1)], len(points))
        ends = edges[border]
        inside, outside = ends[stays[border]], ends[~stays[border]]
        usual = _medians_at(edges[moved], apart[moved], len(points))[outside]
        tears = apart[border] > np.maximum(_MANY_TIMES * usual, self._least)
        torn, whole = (
            np.bincount(part[of], minlength=len(points)) for of in (inside[tears], inside)
        )
        return np.asarray((2 * torn > whole)[part])


class Watched:
    """Reads frames in their order, and notes what is held.

    Attributes:
        held: where positions are held; a frame counts once, however often it is read.
    """

    def __init__(self, source: Frames, whole: Positions, *, rejects: bool) -> None:
        """`whole` are the positions of a complete frame."""
        self._source = source
        self._edges = edges_of(source.faces, source.n_vertices)
        lengths = np.linalg.norm(np.diff(whole[self._edges], axis=1)[:, 0], axis=1)
        self._mean_edge = float(lengths.mean()) if len(lengths) else 0.0
        self._rejects = rejects
        self._watched = set[int]()
        self.held = Places(source.n_vertices)

    def frames(self, start: int, stop: int) -> Iterator[Frame]:
        """Yields the frames ``[start:stop]``, without what is held if that is rejected."""
        held, first = Held(self._edges, self._mean_edge), max(start - 1, 0)
        with contextlib.closing(self._source.frames(first, stop)) as frames:
            for number, frame in enumerate(frames, first):
                repeated = held.watch(frame.points, frame.observed)
                if number < start:
                    continue
                if number not in self._watched:
                    self._watched.add(number)
                    self.held.add(number, repeated)
                if self._rejects and repeated.any():
                    frame = replace(frame, known=frame.claimed & ~repeated)
                yield frame

    def remarks(self) -> Iterator[str]:
        """Says what is held."""
        if self.held.count:
            done = "they count as missing" if self._rejects else "`reject_outliers` leaves them out"
            yield (
                f"{counted(self.held.count, 'known position')} held, the same bit for bit as in "
                "the frame before, while the surface beside moved, "
                f"{self.held.told(self._source.header)}; {done}"
            )
