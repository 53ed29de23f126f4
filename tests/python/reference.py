"""A literal transcription of the method in numpy: slow, plain, and the measure of the real one."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Edges = tuple[NDArray[np.int64], NDArray[np.int64]]


def directed_edges(faces: NDArray[np.int64]) -> Edges:
    """Both directions of every edge, each once."""
    pairs = np.concatenate([faces[:, [a, b]] for a, b in [(0, 1), (1, 2), (2, 0)]])
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    both = np.unique(np.concatenate([pairs, pairs[:, ::-1]]), axis=0)
    return both[:, 0], both[:, 1]


def mean_edge(edges: Edges, frame: Array) -> float:
    """The mean edge h, 1 where that is zero."""
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
    """One frame; unseen vertices stay. Returns positions and generations."""
    k = len(previous)
    i, j = edges
    squared = np.maximum(((previous[i] - previous[j]) ** 2).sum(axis=1), 1e-12 * h * h)
    s = 1.0 / squared

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
    """Kabsch; the mean translation for points on a line or fewer than three."""
    from_mean, to_mean = before.mean(axis=0), after.mean(axis=0)
    spread = np.linalg.svd(before - from_mean, compute_uv=False)
    if len(before) < 3 or spread[1] <= 1e-5 * spread[0]:
        return np.asarray(what + (to_mean - from_mean))
    u, _, vt = np.linalg.svd((after - to_mean).T @ (before - from_mean))
    rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return np.asarray((what - from_mean) @ rotation.T + to_mean)


def components(edges: Edges, k: int) -> NDArray[np.int64]:
    """A label for each vertex, the smallest vertex of its component."""
    i, j = edges
    label = np.arange(k)
    while True:
        lower = label.copy()
        np.minimum.at(lower, j, label[i])
        if (lower == label).all():
            return label
        label = lower


def follow(
    edges: Edges,
    first_frame: Array,
    previous: Array,
    completed: Array,
    generation: NDArray[np.int64],
) -> Array:
    """Moves the unseen vertices of a completed frame."""
    label = components(edges, len(previous))
    distance = np.linalg.norm(first_frame[:, None] - first_frame[None], axis=2)
    distance[label[:, None] == label[None]] = np.inf
    donor = distance.argmin(axis=1)
    anchors = np.flatnonzero(generation == 0)
    result = completed.copy()
    for part in np.unique(label[generation < 0]):
        members = np.flatnonzero(label == part)
        usable = [
            v
            for v in np.unique(donor[members])
            if label[v] != part and (generation[label == label[v]] == 0).sum() >= 4
        ]
        if len(anchors) == 0:
            continue
        chosen = np.array(usable) if len(usable) >= 4 else anchors
        result[members] = rigid_motion(previous[chosen], completed[chosen], previous[members])
    return result


def nmsve(edges: Edges, reference: Array, completed: Array) -> float:
    """Eq. (5) and (6), vertex by vertex."""
    h = mean_edge(edges, reference)
    i, j = edges
    neighbours: dict[int, list[int]] = {v: [] for v in range(len(reference))}
    for a, b in zip(i.tolist(), j.tolist(), strict=True):
        neighbours[a].append(b)

    def laplacian(frame: Array, v: int) -> Array:
        if not neighbours[v]:
            return np.zeros(3)
        inverse = [
            1 / max(float(np.linalg.norm(frame[v] - frame[n])), 1e-6 * h) for n in neighbours[v]
        ]
        mean = sum(w * frame[n] for w, n in zip(inverse, neighbours[v], strict=True)) / sum(inverse)
        return np.asarray(frame[v] - mean)

    total = 0.0
    for v in range(len(reference)):
        total += float(np.linalg.norm(reference[v] - completed[v]))
        total += float(np.linalg.norm(laplacian(reference, v) - laplacian(completed, v)))
    return total / (2 * len(reference))
