"""A slow, literal transcription of how a whole frame is put together; see docs/method.md.

The completer itself is taken as it is: its tests are elsewhere.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from reference import directed_edges, edges_to

import dynmesh

Array = NDArray[Any]


def edges_of(faces: Array) -> Array:
    """(e, 2) each edge once."""
    edges = np.stack(directed_edges(faces), axis=1)
    return np.asarray(edges[edges[:, 0] < edges[:, 1]])


def two_apart(edges: Array, k: int) -> Array:
    """(p, 2) each pair that shares a neighbour but no edge."""
    adjacent = np.zeros((k, k), bool)
    adjacent[edges[:, 0], edges[:, 1]] = adjacent[edges[:, 1], edges[:, 0]] = True
    near = (adjacent.astype(int) @ adjacent > 0) & ~adjacent & ~np.eye(k, dtype=bool)
    return np.argwhere(np.triu(near))


def log_lengths(pairs: Array, frames: Array, known: Array) -> Array:
    """(n, p) the logarithms of the distances; NaN where a frame does not know both ends."""
    a, b = pairs.T
    lengths = np.linalg.norm(frames[:, a] - frames[:, b], axis=2)
    there = known[:, a] & known[:, b] & (lengths > 0)
    return np.where(there, np.log(np.where(there, lengths, 1)), np.nan)


def median_and_spread(logarithms: Array) -> tuple[Array, Array]:
    """mu and sigma of each pair; NaN if no frame knows it."""
    mu = np.full(logarithms.shape[1], np.nan)
    some = np.isfinite(logarithms).any(axis=0)
    mu[some] = np.nanmedian(logarithms[:, some], axis=0)
    sigma = mu.copy()
    sigma[some] = 1.48 * np.nanmedian(np.abs(logarithms - mu)[:, some], axis=0)
    return mu, sigma


def without_outliers(faces: Array, frames: Array, known: Array) -> Array:
    """The masks without known positions that contradict the lengths around them."""
    n, k = known.shape
    edges = edges_of(faces)
    kept = known.copy()
    for pairs in (edges, np.concatenate([edges, two_apart(edges, k)])):
        logarithms = log_lengths(pairs, frames, known)
        mu, sigma = median_and_spread(logarithms)
        usual = np.isfinite(logarithms).sum(axis=0) >= 3
        for t in range(n):
            counted = usual & known[t, pairs].all(axis=1)
            with np.errstate(invalid="ignore"):
                wrong = counted & ~(np.abs(logarithms[t] - mu) <= 0.7 + 4 * sigma)
            for v in np.flatnonzero(known[t]):
                of_vertex = (pairs == v).any(axis=1)
                votes = (counted & of_vertex).sum()
                if votes and 2 * (wrong & of_vertex).sum() >= votes:
                    kept[t, v] = False
    return kept


def smooth_fill(positions: Array, fixed: Array, edges: Array) -> Array:
    """Solves L^2 x = 0 for the vertices that are not fixed, with the uniform Laplacian L."""
    k = len(positions)
    laplacian = np.zeros((k, k))
    laplacian[edges[:, 0], edges[:, 1]] = laplacian[edges[:, 1], edges[:, 0]] = -1
    np.fill_diagonal(laplacian, -laplacian.sum(axis=1))
    squared = laplacian @ laplacian
    filled = positions.copy()
    right = -squared[~fixed][:, fixed] @ positions[fixed]
    filled[~fixed] = np.linalg.solve(squared[~fixed][:, ~fixed], right)
    return filled


def whole_frame(
    faces: Array, frames: Array, known: Array, base: int, n_trips: int
) -> tuple[Array, Array]:
    """The positions and the standard errors of frame `base` of one connected mesh."""
    n = len(known)
    edges = edges_of(faces)
    here = known[base]
    start = smooth_fill(np.where(here[:, None], frames[base], 0.0), here, edges)
    mu, _ = median_and_spread(log_lengths(edges, frames, known))

    sides = {"before": range(base - 1, -1, -1), "after": range(base + 1, n)}
    turns = [side for side, path in sides.items() if path]
    results = {}
    for trip in range(n_trips):
        side = turns[trip % len(turns)]
        there = list(sides[side])
        for path in (there, [*there[-2::-1], base]):
            completer = dynmesh.Completer(faces, start, learn=True, uncertainty=True)
            for t in path:
                start = completer.push(np.where(known[t][:, None], frames[t], 0.0), known[t])
        on_side = here | known[there].any(axis=0)
        results[side] = (start, np.array(completer.standard_error), on_side)

    weights = [
        np.where(on_side, 1, 1e-6) / np.where(here, 1, error) ** 1.5
        for _, error, on_side in results.values()
    ]
    share = np.array(weights) / np.sum(weights, axis=0)
    found = np.array([position for position, _, _ in results.values()])
    positions = (share[..., None] * found).sum(axis=0)
    positions[here] = frames[base][here]
    disagreement = (share * ((found - positions) ** 2).sum(axis=2) / 3).sum(axis=0)
    of_sides = (share * np.array([error**2 for _, error, _ in results.values()])).sum(axis=0)

    seen = np.asarray(known.any(axis=0))
    around = directed_edges(faces)
    r = edges_to(here, around)
    u = np.minimum(edges_to(~seen, around), 20)
    near: Array = 0.92 * np.sqrt(0.3 * of_sides + disagreement) * np.sqrt(r)
    h = np.exp(np.nanmedian(mu))
    of_unseen = 0.5 * h * np.minimum(edges_to(seen, around), 6) ** 0.85
    errors = np.where(seen, near * (1 + 2 / np.maximum(u, 1)), np.maximum(2.5 * near, of_unseen))
    return positions, np.where(here, 0, errors)
