"""How long edges are where frames know both of their ends, and what contradicts that."""

from dataclasses import dataclass

import numpy as np

from .._arrays import Floats, Integers, Mask
from .mesh import Mesh
from .window import Window


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
