"""The rotations of clusters since the last frame, in NumPy, slow and simple, for comparison."""

import numpy as np
from leaders_reference import Lead, Leaders
from numpy.typing import NDArray
from reference import Array, Edges, best_rotations, mean_edge, order_of, sum_to
from scipy.spatial.transform import Rotation


def clusters_of(edges: Edges, positions: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The cluster of each vertex, and the centres: disjoint cells, the outermost first."""
    i, j = edges
    cluster = np.full(len(positions), -1)
    centres: list[np.int64] = []
    for v in order_of(edges, positions):
        cell = np.append(j[i == v], v)
        if (cluster[cell] == -1).all():
            cluster[cell] = len(centres)
            centres.append(v)
    joined = cluster.copy()
    for v in np.flatnonzero(cluster == -1):
        around = cluster[j[i == v]]
        joined[v] = around[around != -1].min()
    return joined, np.array(centres)


def kabsch(before: Array, after: Array) -> tuple[Array, float]:
    """The rotation, and the sum of squares of how far the points are from a line."""
    covariance = (after - after.mean(axis=0)).T @ (before - before.mean(axis=0))
    return best_rotations(covariance[None])[0], float(np.linalg.svd(covariance)[1][1])


class Increments:
    """The rotation of each cluster since the last frame, from the anchors alone."""

    def __init__(
        self, edges: Edges, label: NDArray[np.int64], first_frame: Array, noise: float | None
    ) -> None:
        i, j = edges
        self.h = mean_edge(edges, first_frame)
        self.noise = 3 * (noise or 0.0) ** 2
        self.label = label
        self.cluster, centres = clusters_of(edges, first_frame)
        self.centres = first_frame[centres]
        self.part = label[centres]
        n = len(centres)
        self.beside = np.zeros((n, n), dtype=bool)  # clusters that an edge connects
        self.beside[self.cluster[i], self.cluster[j]] = True
        np.fill_diagonal(self.beside, False)
        self.leaders = Leaders(edges, first_frame)
        weights = self.beside.astype(float)
        self.couplings = 0.05 * (np.diag(weights.sum(axis=1)) - weights) + 1e-7 * np.eye(n)

    def _regions(self, has_anchors: NDArray[np.bool_]) -> tuple[NDArray[np.int64], Array]:
        """The nearest cluster with anchors by steps, then by length, and the length."""
        region = np.where(has_anchors, np.arange(len(has_anchors)), -1)
        length = np.zeros(len(region))
        self.farthest = 0  # the largest number of steps
        while True:
            found = {}
            for c in np.flatnonzero(region == -1):
                ways: list[tuple[float, int]] = [
                    (
                        float(length[d] + np.linalg.norm(self.centres[c] - self.centres[d])),
                        int(region[d]),
                    )
                    for d in np.flatnonzero(self.beside[c] & (region != -1))
                ]
                if ways:
                    found[c] = min(ways)
            if not found:
                return region, length
            self.farthest += 1
            for c, (distance, nearest) in found.items():
                length[c], region[c] = distance, nearest

    def _pairs(self, has_anchors: NDArray[np.bool_]) -> dict[tuple[int, int], float]:
        """The clusters whose regions touch, and the length of the way, in mean edges."""
        region, length = self._regions(has_anchors)
        pairs: dict[tuple[int, int], float] = {}
        for c, d in np.argwhere(self.beside):
            a, b = int(region[c]), int(region[d])
            if -1 < a < b:
                way = np.linalg.norm(self.centres[c] - self.centres[d])
                path = float(length[c] + way + length[d]) / self.h
                pairs[a, b] = min(path, pairs.get((a, b), np.inf))
        return pairs

    def _first(self, previous: Array, points: Array, known: NDArray[np.bool_]) -> Array:
        """The rotation with which each component begins, also if its anchors do not tell."""
        first: dict[int, Array] = {}
        for part in np.unique(self.label):
            own = known & (self.label == part)
            if own.sum() >= 3:
                rotation, across = kabsch(previous[own], points[own])
                if across > (0.1 * self.h) ** 2:
                    first[part] = rotation
        self.told = set(first)
        of_all = np.eye(3)
        if known.sum() >= 3:
            rotation, across = kabsch(previous[known], points[known])
            of_all = rotation if across > 0 else of_all
        return np.stack([first.get(part, of_all) for part in self.part])

    def find(self, previous: Array, points: Array, known: NDArray[np.bool_]) -> Array:
        """Returns the increments (n, 3, 3) from the last frame."""
        n = len(self.part)
        first = self._first(previous, points, known)
        anchors = np.bincount(self.cluster[known], minlength=n)
        mean = [
            sum_to(self.cluster[known], x[known], n) / np.maximum(anchors, 1)[:, None]
            for x in (previous, points)
        ]
        before, now = (x - m[self.cluster] for x, m in zip((previous, points), mean, strict=True))
        own = known & (anchors[self.cluster] > 1)
        squares = np.bincount(self.cluster[own], (before[own] ** 2).sum(axis=1), n)
        square = np.maximum(squares / np.maximum(anchors, 1), 1e-4 * self.h**2) + self.noise
        arms = [  # the cluster, the weight, and the arm in both frames
            (self.cluster[v], 1 / square[self.cluster[v]], before[v], now[v])
            for v in np.flatnonzero(own)
        ]
        for (a, b), path in self._pairs(anchors > 0).items():
            p, q = mean[0][b] - mean[0][a], mean[1][b] - mean[1][a]
            noise = self.noise / anchors[a] + self.noise / anchors[b]
            weight = 0.5 / (1 + (path / 10) ** 2) / (max(p @ p, 1e-4 * self.h**2) + noise)
            arms += [(c, weight, p, q) for c in (a, b)]
        is_led = ~np.isin(self.part, list(self.told)) & (self.label.max() > 0)
        self.hold = 1e-4 * is_led
        omega, turns = self._turned(arms, anchors, np.zeros((n, 3)), first)
        leads = self.leaders.find(self.told, self._predicted(previous, points, known, turns))
        for lead in leads:
            self._take(lead, omega, turns, first)
        if any((self.label[known] == lead.follower).sum() > 1 for lead in leads):
            omega, turns = self._turned(arms, anchors, omega, first)
        for lead in self.leaders.find(
            set(self.label[known].tolist()), self._predicted(previous, points, known, turns)
        ):
            self._take(lead, omega, turns, first)
        return turns

    def _predicted(
        self, previous: Array, points: Array, known: NDArray[np.bool_], turns: Array
    ) -> Array:
        """Where the parts with known vertices are if they have turned so."""
        result = previous.copy()
        for part in np.unique(self.label[known]):
            own = self.label == part
            before, after = (x[own & known].mean(axis=0) for x in (previous, points))
            turn = turns[self.cluster[own]]
            result[own] = np.einsum("nij,nj->ni", turn, previous[own] - before) + after
        return result

    def _take(self, lead: Lead, omega: Array, turns: Array, first: Array) -> None:
        """Turns a component as what leads it turns near it."""
        q = Rotation.from_matrix(turns[self.cluster[lead.vertices]]).as_quat()
        q *= np.where(q @ q[0] < 0, -1, 1)[:, None]
        own = self.part == lead.follower
        mean = Rotation.from_quat((lead.weights[:, None] * q).sum(axis=0))
        omega[own], turns[own], first[own] = 0.0, mean.as_matrix(), mean.as_matrix()

    def _turned(
        self,
        arms: list[tuple[int, float, Array, Array]],
        anchors: Array,
        omega: Array,
        first: Array,
    ) -> tuple[Array, Array]:
        """Two steps from these rotations, or one that turns little."""
        turns = np.asarray(Rotation.from_rotvec(omega).as_matrix() @ first)
        for _ in range(2):
            h = self.hold[:, None, None] * np.eye(3)
            s = -self.couplings @ omega - self.hold[:, None] * omega
            for c, weight, p, q in arms:
                y = turns[c] @ p
                h[c] += weight * ((y @ y) * np.eye(3) - np.outer(y, y))
                s[c] += weight * np.cross(y, q)
            step = self._solve(h, s, anchors == 0)
            omega = omega + step
            turns = np.asarray(Rotation.from_rotvec(omega).as_matrix() @ first)
            if np.linalg.norm(step, axis=1).max() < 0.02:
                break
        return omega, turns

    def _solve(self, h: Array, s: Array, is_without: NDArray[np.bool_]) -> Array:
        """Some steps of conjugate gradients.

        Their preconditioner leaves out the couplings that lead to a cluster with anchors.
        """
        inverse = np.linalg.inv(h + np.diag(self.couplings)[:, None, None] * np.eye(3))
        of_rest = np.linalg.inv(self.couplings[np.ix_(is_without, is_without)])
        x, r, p, slopes = np.zeros_like(s), s, np.zeros_like(s), [np.inf]
        for _ in range(12):
            z = np.einsum("nij,nj->ni", inverse, r)
            z[is_without] = of_rest @ r[is_without]
            slopes.append(float((r * z).sum()))
            if slopes[-1] <= 1e-5 * slopes[1]:
                break
            p = z + slopes[-1] / slopes[-2] * p
            product = np.einsum("nij,nj->ni", h, p) + self.couplings @ p
            length = slopes[-1] / (p * product).sum()
            x, r = x + length * p, r - length * product
        return x
