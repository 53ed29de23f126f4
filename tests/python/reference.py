"""A literal implementation of the method in NumPy, slow and simple, for comparison."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial.transform import Rotation

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


def follow(
    edges: Edges,
    first_frame: Array,
    previous: Array,
    completed: Array,
    generation: NDArray[np.int64],
) -> Array:
    """Moves the disconnected vertices of a completed frame."""
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


Lengths = dict[tuple[int, int], float]
"""Of edges, by their ends in either order."""


def flip_to_delaunay(faces: NDArray[np.int64], lengths: Lengths) -> list[list[int]]:
    """Flips edges of a manifold mesh with dictionaries; no flip may connect two vertices twice.

    Adds the lengths of new edges.
    """
    triangles = {tuple(int(v) for v in face) for face in faces}
    third = {}
    for a, b, c in triangles:
        third.update({(a, b): c, (b, c): a, (c, a): b})

    def angle(a: int, b: int, c: int) -> float:
        """Returns the angle at c."""
        x, y, z = lengths[b, c], lengths[c, a], lengths[a, b]
        return float(np.arccos(np.clip((x * x + y * y - z * z) / (2 * x * y), -1, 1)))

    open_edges = list(third)
    while open_edges:
        u, v = open_edges.pop()
        if (u, v) not in third or (v, u) not in third:
            continue
        w, z = third[u, v], third[v, u]
        if angle(u, v, w) + angle(v, u, z) <= np.pi + 1e-9:
            continue
        at_u = angle(v, w, u) + angle(z, v, u)
        x, y = lengths[u, w], lengths[u, z]
        diagonal = float(np.sqrt(x * x + y * y - 2 * x * y * np.cos(at_u)))
        assert not {(w, z), (z, w)} & third.keys(), "a flip joins two vertices twice"
        del third[u, v], third[v, u]
        lengths[w, z] = lengths[z, w] = diagonal
        for a, b, c in [(z, w, u), (w, z, v)]:
            third.update({(a, b): c, (b, c): a, (c, a): b})
        open_edges += [(w, u), (u, z), (z, v), (v, w)]
    flipped = {(a, b, c) for (a, b), c in third.items() if a < b and a < c}
    return [list(face) for face in sorted(flipped)]


def clusters_of(edges: Edges, positions: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The cluster of each vertex, and the centres: disjoint cells, the outermost first."""
    i, j = edges
    distance = np.linalg.norm(positions - positions.mean(axis=0), axis=1)
    if distance.max() > 0:
        distance = np.round(distance / distance.max() * 2**20)
    cluster = np.full(len(positions), -1)
    centres: list[np.int64] = []
    for v in np.lexsort((*positions.T[::-1], -distance)):
        cell = np.append(j[i == v], v)
        if (cluster[cell] == -1).all():
            cluster[cell] = len(centres)
            centres.append(v)
    joined = cluster.copy()
    for v in np.flatnonzero(cluster == -1):
        around = cluster[j[i == v]]
        joined[v] = around[around != -1].min()
    return joined, np.array(centres)


def ties_of(label: NDArray[np.int64], frame: Array, h: float) -> list[tuple[int, int, float]]:
    """Vertices near other components, the nearest vertex there, and the weight of this tie."""
    distance = np.linalg.norm(frame[:, None] - frame[None], axis=2)
    distance[label[:, None] == label[None]] = np.inf
    away = distance.min(axis=1) / h
    ties = []
    for part in np.unique(label) if label.max() > 0 else []:
        near = np.flatnonzero(label == part)
        near = near[np.argsort(away[near], kind="stable")]
        near = near[: max((away[near] <= away[near[0]] + 1.5).sum(), 8)]
        chosen = [int(near[0])]
        while len(chosen) < min(len(near), 8):
            apart = np.linalg.norm(frame[near][:, None] - frame[chosen], axis=2).min(axis=1)
            chosen.append(int(near[apart.argmax()]))
        chosen = chosen if len(near) > 8 else near.tolist()
        ties += [(v, int(distance[v].argmin()), 1e-3 / (1 + away[v] ** 2)) for v in chosen]
    return ties


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
        self.ties = ties_of(label, first_frame, self.h)
        weights = self.beside.astype(float)
        for v, other, weight in self.ties:
            c, d = self.cluster[[v, other]]
            weights[c, d] += weight
            weights[d, c] += weight
        self.couplings = 0.05 * (np.diag(weights.sum(axis=1)) - weights) + 1e-7 * np.eye(n)

    def _regions(self, has_anchors: NDArray[np.bool_]) -> tuple[NDArray[np.int64], Array]:
        """The nearest cluster with anchors by steps, then by length, and the length."""
        region = np.where(has_anchors, np.arange(len(has_anchors)), -1)
        length = np.zeros(len(region))
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
        """The rotation with which each component begins."""
        first: dict[int, Array] = {}
        for part in np.unique(self.label):
            own = known & (self.label == part)
            if own.sum() >= 3:
                rotation, across = kabsch(previous[own], points[own])
                if across > (0.1 * self.h) ** 2:
                    first[part] = rotation
        while True:
            following: dict[int, list[Array]] = {}
            for v, other, _ in self.ties:
                for c, d in (
                    (self.label[v], self.label[other]),
                    (self.label[other], self.label[v]),
                ):
                    if c not in first and d in first:
                        following.setdefault(c, []).append(first[d])
            if not following:
                break
            for part, rotations in following.items():
                q = Rotation.from_matrix(np.stack(rotations)).as_quat()
                q *= np.where(q @ q[0] < 0, -1, 1)[:, None]
                first[part] = Rotation.from_quat(q.sum(axis=0)).as_matrix()
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
        arms = []  # the cluster, the share, the noise, and the arm in both frames
        for v in np.flatnonzero(known & (anchors[self.cluster] > 1)):
            c = self.cluster[v]
            arms.append((c, 1.0, self.noise, previous[v] - mean[0][c], points[v] - mean[1][c]))
        for (a, b), path in self._pairs(anchors > 0).items():
            noise = self.noise / anchors[a] + self.noise / anchors[b]
            share = 0.5 / (1 + (path / 10) ** 2)
            way = mean[0][b] - mean[0][a], mean[1][b] - mean[1][a]
            arms += [(c, share, noise, *way) for c in (a, b)]
        preconditioner = self.couplings.copy()
        for c, share, *_ in arms:
            preconditioner[c, c] += share * 2 / 3
        omega, turns = np.zeros((n, 3)), first
        for _ in range(2):
            h, s = np.zeros((n, 3, 3)), -self.couplings @ omega
            for c, share, noise, p, q in arms:
                y = turns[c] @ p
                weight = share / (max(p @ p, 1e-4 * self.h**2) + noise)
                h[c] += weight * ((y @ y) * np.eye(3) - np.outer(y, y))
                s[c] += weight * np.cross(y, q)
            step = self._solve(h, s, preconditioner)
            omega = omega + step
            turns = np.asarray(Rotation.from_rotvec(omega).as_matrix() @ first)
            if np.linalg.norm(step, axis=1).max() < 0.02:
                break
        return turns

    def _solve(self, h: Array, s: Array, preconditioner: Array) -> Array:
        """Some steps of conjugate gradients."""
        x, r, p, slopes = np.zeros_like(s), s, np.zeros_like(s), [np.inf]
        for _ in range(8):
            z = np.linalg.solve(preconditioner, r)
            slopes.append(float((r * z).sum()))
            if slopes[-1] <= 1e-3 * slopes[1]:
                break
            p = z + slopes[-1] / slopes[-2] * p
            product = np.einsum("nij,nj->ni", h, p) + self.couplings @ p
            length = slopes[-1] / (p * product).sum()
            x, r = x + length * p, r - length * product
        return x


def best_rotations(covariance: Array) -> Array:
    """The rotations that fit these covariances, (n, 9), from their singular values."""
    u, _, vt = np.linalg.svd(covariance.reshape(-1, 3, 3))
    sign = np.ones((len(u), 3))
    sign[:, 2] = np.sign(np.linalg.det(u @ vt))
    return np.asarray((u * sign[:, None, :]) @ vt)


BITS_64 = (1 << 64) - 1


def mixed(x: int) -> int:
    """The function of SplitMix64."""
    x = (x + 0x9E3779B97F4A7C15) & BITS_64
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & BITS_64
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & BITS_64
    return x ^ (x >> 31)


class Detail:
    """Method detail for manifold meshes without needles."""

    def __init__(
        self, faces: NDArray[np.int64], first_frame: Array, noise: float | None = None
    ) -> None:
        """Takes frame 0 as the last two frames. With `noise`, anchors are weighted, not fixed."""
        self.noise = noise
        self.weight = 10.0  # lambda h^2
        self.k = len(first_frame)
        self.edges = directed_edges(faces)
        self.label = components(self.edges, self.k)
        i, j = self.edges
        self.h = mean_edge(self.edges, first_frame)
        self.rest_edges = (first_frame[j] - first_frame[i]) / self.h
        self.operator = self._operator(faces, first_frame / self.h)
        self.q = np.tile(np.eye(3), (self.k, 1, 1))
        self.increments = Increments(self.edges, self.label, first_frame, noise)
        self.clusters, self.beside = self.increments.cluster, self.increments.beside
        self.first_memory = self.operator @ first_frame
        self.memory = self.first_memory
        self.change = np.zeros_like(self.memory)
        self.previous = first_frame
        self.blend = 0.0
        self.continued = 0.0  # c
        self.first_order = Shares(self.label)

    def _operator(self, faces: NDArray[np.int64], frame: Array) -> Any:
        lengths: Lengths = {}
        missing = 0.0
        for a, b, c in faces.tolist():
            for u, v in [(a, b), (b, c), (c, a)]:
                lengths[u, v] = lengths[v, u] = float(np.linalg.norm(frame[u] - frame[v]))
            sides = lengths[a, b], lengths[b, c], lengths[c, a]
            missing = max(missing, 1e-4 - (sum(sides) - 2 * max(sides)))
        lengths = {edge: length + missing for edge, length in lengths.items()}
        # The intrinsic Delaunay triangulation.
        self.triangles, self.lengths = flip_to_delaunay(faces, lengths), lengths
        laplacian = np.zeros((self.k, self.k))
        is_edge = np.zeros((self.k, self.k), dtype=bool)
        area = np.zeros(self.k)
        for face in self.triangles:
            for n in range(3):
                a, b, c = face[n], face[(n + 1) % 3], face[(n + 2) % 3]
                x, y, z = lengths[b, c], lengths[c, a], lengths[a, b]
                cosine = (x * x + y * y - z * z) / (2 * x * y)  # cosine of the angle at c
                sine = np.sqrt(1 - cosine**2)
                weight = cosine / sine / 2
                laplacian[[a, b], [b, a]] -= weight
                laplacian[[a, b], [a, b]] += weight
                is_edge[[a, b], [b, a]] = True
                area[[a, b, c]] += x * y * sine / 2 / 3 / 3  # each corner is visited once
        area = np.maximum(area, 0.2 * area.mean())
        floor = -0.001 * laplacian[is_edge].mean()
        self.edge_weights = np.where(is_edge, np.maximum(-laplacian, floor), 0.0)
        self.laplacian = laplacian
        return laplacian / np.sqrt(area)[:, None]

    def _fit(self, frame: Array) -> None:
        """Sets Q, from sums over clusters, averaged twice with the clusters beside them."""
        i, j = self.edges
        weight = 1 / np.maximum((self.rest_edges**2).sum(axis=1), SQUARED_LENGTH_FLOOR)
        outer = (frame[j] - frame[i])[:, :, None] * (weight[:, None] * self.rest_edges)[:, None, :]
        covariance = sum_to(i, outer.reshape(-1, 9), self.k)
        n = len(self.beside)
        sums = sum_to(self.clusters, covariance, n)
        for _ in range(2):
            sums = sums + self.beside @ sums
        self.q = self._of_vertices(best_rotations(sums))

    def _of_vertices(self, of_clusters: Array) -> Array:
        """The mean rotation of the clusters in each cell."""
        i, j = self.edges
        turns = Rotation.from_matrix(of_clusters).as_quat()
        own, other = turns[self.clusters], turns[self.clusters[j]]
        sign = np.where((own[i] * other).sum(axis=1) < 0, -1.0, 1.0)
        mean = Rotation.from_quat(own + sum_to(i, sign[:, None] * other, self.k))
        return np.asarray(mean.as_matrix())

    def _turn(self, memory: Array) -> Array:
        return np.asarray(np.einsum("nij,nj->ni", self.q, memory))

    def complete(self, points: Array, known: NDArray[np.bool_]) -> Array:
        """Completes one frame except disconnected vertices."""
        self.first_order.frame += 1
        self.first_order_share = 0.0
        seen = np.isin(self.label, self.label[known])
        x = self.previous
        if (seen & ~known).any() or (self.noise is not None and seen.any()):
            weight = self.weight  # which the frame changes
            x = self._solve(points, known, seen)
            x = self._take_first_order(x, points, known, seen, weight)
        elif seen.any():
            x = np.where(known[:, None], points, x)
        self._fit(x)
        last = self.memory
        self.memory = np.einsum("nji,nj->ni", self.q, self.operator @ x)
        change = self.memory - last
        is_jump = np.linalg.norm(change, axis=1) >= self.h
        self.change = np.where(is_jump[:, None], 0, 0.7 * self.change + 0.3 * change)
        self.previous = x
        return x

    def _closest(
        self, target: Array, anchors: Array, known: NDArray[np.bool_], seen: NDArray[np.bool_]
    ) -> Array:
        """Solves for the frame whose detail and anchors are closest to their targets."""
        solved = seen & ~known if self.noise is None else seen
        fixed = np.where(solved[:, None], 0.0, np.where(known[:, None], anchors, self.previous))
        columns = self.operator[:, solved]
        weight = np.diag(self.weight * known[solved]) if self.noise is not None else 0.0
        right_side = columns.T @ (target - self.operator @ fixed)
        if self.noise is not None:
            right_side += self.weight * np.where(known[:, None], anchors, 0.0)[solved]
        x = fixed.copy()
        x[solved] = np.linalg.solve(columns.T @ columns + weight, right_side)
        return x

    def _blends(self, r0: Array, r1: Array, r2: Array, seen: Array) -> tuple[float, float]:
        """Returns b, and the c that explains the rest."""

        def share(of: Array, over: Array) -> float:
            square = (over * over).sum()
            square += 0.001 * min(square, seen.sum() * self.h**2)
            return float((of * over).sum() / square) if square > 0 else 0.0

        h = -(r0 * r2).sum() + share(r2, r1) * (r0 * r1).sum()
        q = 1.05 * (r2 * r2).sum() - share(r2, r1) * (r1 * r2).sum()
        change = float(np.clip(h / q, 0, 1)) if q > 0 else 0.0
        return -share(r0 + change * r2, r1), change

    def _posed(
        self, x: list[Array], r: list[Array], detail: list[Array], *_: NDArray[Any]
    ) -> tuple[list[Array], list[Array], list[Array]]:
        """Fits the rest shape or the last one by modes, if there are any."""
        return x, r, detail

    def _solve(self, points: Array, known: NDArray[np.bool_], seen: NDArray[np.bool_]) -> Array:
        still = np.zeros_like(self.previous)
        soft = np.sqrt(self.weight) * known[:, None] * (self.noise is not None)
        anchors = np.where(known[:, None], points, 0.0)

        self.q = self._of_vertices(self.increments.find(self.previous, points, known)) @ self.q
        self._fit(self._closest(self._turn(self.memory), anchors, known, seen))
        rows = seen[:, None]
        fixed = np.where(rows, 0.0, self.previous)
        detail = [self.memory, self.first_memory - self.memory, self.change]
        targets = [self._turn(memory) for memory in detail]
        x0 = self._closest(targets[0], anchors, known, seen)
        x1, x2 = (self._closest(target, still, known, seen) - fixed for target in targets[1:])
        r0, r1, r2 = (
            np.hstack([(self.operator @ step - target) * rows, soft * (step - goal)])
            for step, target, goal in zip(
                [x0, x1, x2], targets, [anchors, still, still], strict=True
            )
        )
        for r, target in ((r1, targets[1]), (r2, targets[2])):
            if (r * r).sum() <= 1e-18 * ((target * rows) ** 2).sum():  # rounding errors of 0
                r[:] = 0
        (x0, x1), (r0, r1), detail = self._posed([x0, x1], [r0, r1], detail, anchors, known, seen)
        b, change = self._blends(r0, r1, r2, seen)
        self.blend, self.continued = b, change = float(np.clip(b, -0.5, 1.5)), change
        x = x0 + b * x1 + change * x2

        i, j = self.edges
        fit = np.stack([-(r1 * (r0 + change * r2)).sum(axis=1), (r1 * r1).sum(axis=1)], axis=1)
        sums = sum_to(self.clusters, fit, len(self.beside))
        h, q = (sums + self.beside @ sums).T
        eta = 0.15 * q.mean()
        of_cluster = np.full(len(h), self.blend)
        if eta > 0:
            of_cluster = np.clip((h + eta * self.blend) / (q + eta), -0.5, 1.5)
        own = of_cluster[self.clusters][:, None]
        blend = (own + sum_to(i, own[j], self.k)) / (1 + np.bincount(i, minlength=self.k))[:, None]
        self._fit(x)
        target = self._turn(detail[0] + blend * detail[1] + change * detail[2])
        x = self._closest(target, anchors, known, seen)
        self.shape = target
        if self.noise is not None:
            energy = (((self.operator @ x - target) * rows) ** 2).sum()
            energy += ((soft * (x - anchors)) ** 2).sum()
            weight = energy / (3 * known.sum() * self.noise**2)
            self.weight = (self.weight + np.clip(weight, 0.1, 1e3)) / 2
        return x

    def _take_first_order(
        self,
        d: Array,
        points: Array,
        known: NDArray[np.bool_],
        seen: NDArray[np.bool_],
        weight: float,
    ) -> Array:
        """Moves the missing vertices by the shares of the first-order step."""
        missing = seen & ~known
        if not missing.any():
            return d
        shares = self.first_order
        if shares.is_due():
            held = shares.draw(known)
            if held.any():
                near = self._around(held, missing | held if self.noise is None else seen)
                later, self.weight = self.weight, weight
                of_detail = self._moved(d, points, known & ~held, near)
                self.weight = later
                of_first_order = self._first_order(of_detail, near & (missing | held))
                shares.learn(of_detail - points, of_first_order - points, held)
        share = np.where(missing, shares.share[shares.part], 0.0)
        self.first_order_share = float(share.sum() / missing.sum())
        return np.asarray(d + share[:, None] * (self._first_order(d, missing) - d))

    def _around(self, held: NDArray[np.bool_], movable: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Returns the movable vertices within some edges of those left out."""
        rings = self.first_order.rings
        near = held
        for ring in range(rings.max()):
            i, j = self.edges
            neighbours = j[near[i] & (ring < rings[self.first_order.part[i]])]
            near = near | (movable & np.isin(np.arange(self.k), neighbours))
        return near

    def _moved(
        self, d: Array, points: Array, kept: NDArray[np.bool_], near: NDArray[np.bool_]
    ) -> Array:
        """Fits the vertices nearby to the shape and the anchors that are kept."""
        columns = self.operator[:, near]
        pull = 0.0 if self.noise is None else self.weight
        anchors = (kept & near).astype(float)[near]
        right_side = columns.T @ (self.shape - self.operator @ d)
        right_side += pull * anchors[:, None] * (points - d)[near]
        x = d.copy()
        x[near] += np.linalg.solve(columns.T @ columns + pull * np.diag(anchors), right_side)
        return x

    def _first_order(self, y: Array, free: NDArray[np.bool_]) -> Array:
        """Takes a step of as-rigid-as-possible deformation of the last frame, from y."""
        w, g = self.edge_weights, self.previous
        i, j = np.nonzero(w)
        of_edge = w[i, j][:, None]
        outer = (of_edge * (y[j] - y[i]))[:, :, None] * (g[j] - g[i])[:, None, :]
        r = best_rotations(sum_to(i, outer.reshape(-1, 9), self.k))
        goal = np.einsum("nij,nj->ni", (r[i] + r[j]) / 2, of_edge * (g[i] - g[j]))
        laplacian = np.diag(w.sum(axis=1)) - w
        gradient = sum_to(i, goal, self.k) - laplacian @ y
        x = y.copy()
        x[free] += np.linalg.solve(laplacian[np.ix_(free, free)], gradient[free])
        return x


class Shares:
    """How much of the first-order step each component takes."""

    def __init__(self, label: NDArray[np.int64]) -> None:
        """Takes the label of the component of each vertex."""
        self.part = np.unique(label, return_inverse=True)[1]
        n = self.part.max() + 1
        self.frame = 0
        self.sums, self.squares = np.zeros((2, n, 11))
        self.count, self.share = np.zeros((2, n))

    def _groups(self) -> list[NDArray[np.int64]]:
        few = np.flatnonzero(self.count < 30)
        return [few] * bool(len(few)) + [np.array([c]) for c in np.flatnonzero(self.count >= 30)]

    def is_due(self) -> bool:
        """Returns whether to test: frames 1, 2 and 4, and every eighth."""
        return self.frame in (1, 2, 4) or self.frame % 8 == 0

    def draw(self, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Returns the anchors that are left out."""
        anchors = np.bincount(self.part[known], minlength=len(self.share))
        probability = np.minimum(50 / np.maximum(anchors, 1), 0.3)[self.part]
        distance = np.sqrt(np.bincount(self.part) / np.maximum(anchors, 1))
        self.rings = np.ceil(1.5 * distance).astype(int)
        of_frame = mixed(self.frame)
        random = np.array([mixed((of_frame + v) & BITS_64) / 2**64 for v in range(len(known))])
        held = known & (random < probability)
        left = np.bincount(self.part[known & ~held], minlength=len(self.share))
        return np.asarray(held & (left >= 4)[self.part])

    def learn(self, of_detail: Array, of_first_order: Array, held: NDArray[np.bool_]) -> None:
        """Chooses the shares by the errors (k, 3) of both at the anchors that are left out."""
        n = len(self.share)
        q = np.linspace(0, 1, 11)[:, None]
        size = np.linalg.norm(of_detail, axis=1)
        mixtures = (1 - q) * of_detail[:, None] + q * of_first_order[:, None]
        gain = size[:, None] - np.linalg.norm(mixtures, axis=2)
        part = self.part[held]
        sums, squares = sum_to(part, gain[held], n), sum_to(part, gain[held] ** 2, n)
        count = np.bincount(part, minlength=n)
        kept = np.where(count > 0, 0.8, 1.0)
        self.sums = kept[:, None] * self.sums + sums
        self.squares = kept[:, None] ** 2 * self.squares + squares
        self.count = kept * self.count + count
        for group in self._groups():
            if count[group].sum() == 0:
                continue
            found = self.sums[group].sum(axis=0) - 0.5 * np.sqrt(self.squares[group].sum(axis=0))
            newest = sums[group].sum(axis=0) + np.sqrt(squares[group].sum(axis=0))
            found[newest < 0] = -np.inf
            found[1:3] = -np.inf  # shares of 0.1 and 0.2 are too small
            enough = self.count[group].sum() >= 30
            self.share[group] = found.argmax() / 10 if enough else 0.0
