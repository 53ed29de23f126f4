"""A literal implementation of the method in NumPy, slow and simple, for comparison."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra

Array = NDArray[Any]
Edges = tuple[NDArray[np.int64], NDArray[np.int64]]

SQUARED_LENGTH_FLOOR = 1e-12
"""Squared lengths are floored at this many squared mean edges."""


def directed_edges(faces: NDArray[np.int64]) -> Edges:
    """Returns both directions of every edge, each once."""
    pairs = np.concatenate([faces[:, [a, b]] for a, b in [(0, 1), (1, 2), (2, 0)]])
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    both = np.unique(np.concatenate([pairs, pairs[:, ::-1]]), axis=0)
    return both[:, 0], both[:, 1]


def mean_edge(edges: Edges, frame: Array) -> float:
    """Returns the mean edge h, or 1 if it is zero."""
    i, j = edges
    h = float(np.linalg.norm(frame[i] - frame[j], axis=1).mean()) if len(i) else 0.0
    return h or 1.0


def sum_to(j: NDArray[np.int64], values: Array, k: int) -> Array:
    """Sums the rows of `values` that belong to the same vertex j."""
    return np.stack([np.bincount(j, column, k) for column in values.T], axis=-1)


def complete_frame(
    edges: Edges,
    previous: Array,
    points: Array,
    known: NDArray[np.bool_],
    h: float,
    *,
    revisit: bool = True,
    extra_iterations: int = 0,
) -> tuple[Array, NDArray[np.int64]]:
    """Completes one frame except disconnected vertices. Returns positions and generations."""
    k = len(previous)
    i, j = edges
    squared = ((previous[i] - previous[j]) ** 2).sum(axis=1)
    s = 1.0 / np.maximum(squared, SQUARED_LENGTH_FLOOR * h * h)

    generation = np.where(known, 0, -1)
    d = np.zeros((k, 3))
    d[known] = points[known] - previous[known]

    t = 0
    extra_left = extra_iterations
    while True:
        t += 1
        use = (generation[i] >= 0) & ~known[j]
        reached = np.zeros(k, bool)
        reached[j[use]] = True
        new = reached & (generation < 0)
        if not new.any():
            if extra_left == 0:
                break
            extra_left -= 1
        w = t - generation[i[use]]
        numerator = sum_to(j[use], (s[use] * w)[:, None] * d[i[use]], k)  # eq. (4)
        denominator = sum_to(j[use], (s[use] * w)[:, None], k)
        estimated = reached if revisit else new
        d[estimated] = numerator[estimated] / denominator[estimated]
        generation[new] = t

    completed = previous + d  # eq. (3)
    completed[known] = points[known]
    return completed, generation


def rigid_motion(before: Array, after: Array, what: Array) -> Array:
    """Rigid motion by Kabsch; the mean translation for collinear points or fewer than three."""
    from_mean, to_mean = before.mean(axis=0), after.mean(axis=0)
    spread = np.linalg.svd(before - from_mean, compute_uv=False)
    if len(before) < 3 or spread[1] <= 1e-5 * spread[0]:
        return np.asarray(what + (to_mean - from_mean))
    u, _, vt = np.linalg.svd((after - to_mean).T @ (before - from_mean))
    rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return np.asarray((what - from_mean) @ rotation.T + to_mean)


def order_of(edges: Edges, positions: Array) -> NDArray[np.int64]:
    """The vertices, the outermost of each component first, then by their coordinates."""
    i, j = edges
    distance = np.zeros(len(positions))
    graph = coo_array((np.ones(len(i)), (i, j)), shape=(len(positions), len(positions)))
    _, component = connected_components(graph)
    for c in range(component.max() + 1):
        own = positions[component == c]
        away = np.linalg.norm(own - own.mean(axis=0), axis=1)
        distance[component == c] = np.round(away / max(away.max(), 1e-300) * 2**20)
    return np.lexsort((*positions.T[::-1], -distance))


def graph_of(edges: Edges, k: int) -> Any:
    """Returns the matrix of the graph, as SciPy takes it."""
    return coo_array((np.ones(len(edges[0])), edges), shape=(k, k)).tocsr()


def components(edges: Edges, k: int) -> NDArray[np.int64]:
    """Labels each vertex with its component."""
    return np.asarray(connected_components(graph_of(edges, k))[1])


def edges_to(nearest: NDArray[np.bool_], edges: Edges) -> Array:
    """(k,) the number of edges to the nearest of these vertices; infinity if there is none."""
    if not nearest.any():
        return np.full(len(nearest), np.inf)
    graph, ends = graph_of(edges, len(nearest)), np.flatnonzero(nearest)
    away = dijkstra(graph, indices=ends, unweighted=True, min_only=True)
    return np.asarray(away)


def nmsve(edges: Edges, reference: Array, completed: Array) -> float:
    """Computes eq. (5) and (6)."""
    h = mean_edge(edges, reference)
    i, j = edges
    k = len(reference)

    def laplacian(frame: Array) -> Array:
        distance = np.linalg.norm(frame[i] - frame[j], axis=1)[:, None]
        inverse = 1 / np.maximum(distance, 1e-6 * h)
        weights = sum_to(i, inverse, k)
        mean = sum_to(i, inverse * frame[j], k) / np.where(weights > 0, weights, 1)
        return np.where(weights > 0, frame - mean, 0)

    off = np.linalg.norm(reference - completed, axis=1)
    off += np.linalg.norm(laplacian(reference) - laplacian(completed), axis=1)
    return float(off.sum() / (2 * k))


def best_rotations(covariance: Array) -> Array:
    """The rotations that fit these covariances, (n, 9), from their singular values."""
    u, _, vt = np.linalg.svd(covariance.reshape(-1, 3, 3))
    sign = np.ones((len(u), 3))
    sign[:, 2] = np.sign(np.linalg.det(u @ vt))
    return np.asarray((u * sign[:, None, :]) @ vt)
