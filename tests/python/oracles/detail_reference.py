"""Method detail, in NumPy, slow and simple, for comparison."""

from typing import Any

import numpy as np
from increments_reference import Increments
from numpy.typing import NDArray
from reference import (
    SQUARED_LENGTH_FLOOR,
    Array,
    best_rotations,
    components,
    directed_edges,
    mean_edge,
    order_of,
    sum_to,
)
from scipy.spatial.transform import Rotation

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
        self.sizes = np.ones(self.label.max() + 1)
        self.first_frame = first_frame
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
        self.in_hole = np.zeros(self.k, dtype=bool)  # in the last frame
        self.blend = 0.0
        self.continued = 0.0  # c
        self.first_order = Shares(self.label, order_of(self.edges, first_frame))

    def _operator(self, faces: NDArray[np.int64], frame: Array) -> Any:
        lengths: Lengths = {}
        for a, b, c in faces.tolist():
            for u, v in [(a, b), (b, c), (c, a)]:
                lengths[u, v] = lengths[v, u] = float(np.linalg.norm(frame[u] - frame[v]))
        laplacian = np.zeros((self.k, self.k))
        is_edge = np.zeros((self.k, self.k), dtype=bool)
        area = np.zeros(self.k)
        for face in flip_to_delaunay(faces, lengths):
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
        before = self.sizes[self.label][:, None]
        self._grow(points, known)
        size = self.sizes[self.label][:, None]
        if (seen & ~known).any() or (self.noise is not None and seen.any()):
            self.q = self._of_vertices(self.increments.find(x, points, known)) @ self.q
            self.previous = self.previous / before
            x = self._solve(points / size, known, seen)
            x = size * self._take_first_order(x, points / size, known, seen)
        elif seen.any():
            x = np.where(known[:, None], points, x)
        self._fit(x)
        self.increments.leaders.learn(x, known)
        last = self.memory
        self.memory = np.einsum("nji,nj->ni", self.q, self.operator @ x) / size
        change = self.memory - last
        is_jump = np.linalg.norm(change, axis=1) >= self.h
        in_hole = self._rings(known) > 1
        newest = np.where(in_hole, 0.4, np.where(self.in_hole, 0.2, 0.3))[:, None]
        self.in_hole = in_hole
        mean = (1 - newest) * self.change + newest * change
        self.change = np.where(is_jump[:, None], 0, mean)
        self.previous = x
        return x

    def _grow(self, points: Array, known: NDArray[np.bool_]) -> None:
        """Finds the size of each component, compared with frame 0."""
        i, j = (ends[self.edges[0] < self.edges[1]] for ends in self.edges)
        first = ((self.first_frame[j] - self.first_frame[i]) ** 2).sum(axis=1)
        now = ((points[j] - points[i]) ** 2).sum(axis=1)
        for c, size in enumerate(self.sizes):
            own = (self.label[i] == c) & known[i] & known[j]
            if not own.any():
                continue
            ratios = now[own] / (size**2 * first[own])
            growth = np.log(np.median(ratios)) / 2
            deviation = np.median(np.abs(ratios / np.median(ratios) - 1)) / 2
            spread = 1.4826 * deviation * np.sqrt(1 + 30 / len(ratios))
            if abs(growth) < np.log(2):
                weight = np.clip(abs(growth) / max(spread, 1e-9) - 1, 0, 1)
                self.sizes[c] = size * np.exp(weight * growth)

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

    def _has_modes(self) -> bool:
        return False

    def _posed(
        self, x: list[Array], r: list[Array], detail: list[Array], *_: NDArray[Any]
    ) -> tuple[list[Array], list[Array], list[Array]]:
        """Fits the rest shape or the last one by modes, if there are any."""
        return x, r, detail

    def _solve(self, points: Array, known: NDArray[np.bool_], seen: NDArray[np.bool_]) -> Array:
        still = np.zeros_like(self.previous)
        soft = np.sqrt(self.weight) * known[:, None] * (self.noise is not None)
        anchors = np.where(known[:, None], points, 0.0)

        if self._has_modes() or self.increments.farthest > 1:
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
        shape = detail[0] + blend * detail[1] + change * detail[2]
        found = np.einsum("nji,nj->ni", self.q, self.operator @ x)
        target = self._turn(shape + self._continued(found - shape, known))
        x = self._closest(target, anchors, known, seen)
        self.shape = target
        if self.noise is not None:
            size = self.sizes[self.label][:, None]
            energy = ((size * (self.operator @ x - target) * rows) ** 2).sum()
            energy += ((size * soft * (x - anchors)) ** 2).sum()
            weight = energy / (3 * known.sum() * self.noise**2)
            self.weight = (self.weight + np.clip(weight, 0.1, 1e3)) / 2
        return x

    def _continued(self, differences: Array, known: NDArray[np.bool_]) -> Array:
        """Returns what is added to the shape in holes, from the differences of known rows."""
        i, j = self.edges
        whole = known & (np.bincount(i, ~known[j], minlength=self.k) == 0)
        level = np.where(whole, 0, 1 + self._rings(known))
        differences = np.where(whole[:, None], differences, 0)
        common, total = 0.0, 0.0
        for v in np.nonzero(level == 1)[0]:
            rows = differences[[n for n in j[i == v] if whole[n]]]
            if len(rows) > 1:
                pairs = (rows.sum(axis=0) ** 2).sum() - (rows**2).sum()
                common += pairs / (len(rows) - 1)
                total += (rows**2).sum()
        for own in range(1, level.max() + 1):
            for v in np.nonzero(level == own)[0]:
                nearer = [n for n in j[i == v] if (whole[n] if own == 1 else level[n] < own)]
                if nearer:
                    differences[v] = 0.6 * differences[nearer].mean(axis=0)
        share = 0.4 * np.clip(common / total / 0.3, 0, 1) if total > 0 else 0.0
        return np.asarray(np.where(whole[:, None], 0, share * differences))

    def _take_first_order(
        self,
        d: Array,
        points: Array,
        known: NDArray[np.bool_],
        seen: NDArray[np.bool_],
    ) -> Array:
        """Moves the missing vertices by the shares of the first-order steps."""
        missing = seen & ~known
        if not missing.any():
            return d
        shares = self.first_order
        held = shares.draw(known)
        if held.any():
            near = self._around(held, missing | held)
            of_detail = self._moved(d, near)
            steps = self._first_order_steps(of_detail, near)
            shares.choose()
            if not shares.near_share.any():  # as of earlier frames
                steps = steps[:1]
            errors = [y - points for y in (of_detail, *steps)]
            shares.learn(errors, held, self._rings(known & ~held))
        shares.choose()
        c = shares.part
        near = np.clip(3 - self._rings(known) / shares.rings_of_tests[c], 0, 1)
        move, total = np.zeros_like(d), 0.0
        for n, y in enumerate(self._first_order_steps(d, missing)):
            share = near * np.where(shares.near_step == n, shares.near_share, 0.0)[c]
            share += (1 - near) * shares.share[c] * (n == 0)
            share = np.where(missing, share, 0.0)
            move += share[:, None] * (y - d)
            total += float(share.sum())
        self.first_order_share = total / float(missing.sum())
        return np.asarray(d + move)

    def _rings(self, anchors: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Returns how many edges each vertex is from an anchor."""
        i, j = self.edges
        rings = np.where(anchors, 0, self.k)
        for ring in range(1, self.k):
            beside = j[rings[i] == ring - 1]
            rings[beside] = np.minimum(rings[beside], ring)
        return rings

    def _around(self, held: NDArray[np.bool_], movable: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Returns the movable vertices within some edges of those left out."""
        rings = self.first_order.rings
        near = held
        for ring in range(rings.max()):
            i, j = self.edges
            neighbours = j[near[i] & (ring < rings[self.first_order.part[i]])]
            near = near | (movable & np.isin(np.arange(self.k), neighbours))
        return near

    def _moved(self, d: Array, near: NDArray[np.bool_]) -> Array:
        """Fits the vertices nearby to the shape; all others stay."""
        columns = self.operator[:, near]
        x = d.copy()
        right_side = columns.T @ (self.shape - self.operator @ d)
        x[near] += np.linalg.solve(columns.T @ columns, right_side)
        return x

    def _first_order_steps(self, y: Array, free: NDArray[np.bool_]) -> list[Array]:
        """Returns y after 1 and 5 rounds with edges of the last frame, and 3 of frame 0."""
        of_last = [y]
        for _ in range(5):
            of_last.append(self._first_order(of_last[-1], free, self.previous))
        of_first = y
        for _ in range(3):
            of_first = self._first_order(of_first, free, self.first_frame)
        return [of_last[1], of_last[5], of_first]

    def _first_order(self, y: Array, free: NDArray[np.bool_], g: Array) -> Array:
        """Takes a round of as-rigid-as-possible deformation of a frame, from y."""
        w = self.edge_weights
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


CHANCE = np.array([0.0, 1.0, 1.5])
"""How many standard errors of its gain do not count, for each step."""


class Shares:
    """How much of the first-order steps each component takes."""

    def __init__(self, label: NDArray[np.int64], order: NDArray[np.int64]) -> None:
        """Takes the label of the component of each vertex, and their order."""
        self.order = order
        self.part = np.unique(label, return_inverse=True)[1]
        n = self.part.max() + 1
        self.frame = 0
        self.sums, self.squares = np.zeros((2, n, 3, 11))
        self.count, self.sum_of_rings = np.zeros((2, n))
        # Of the first step far from anchors, and of one of them near by:
        self.share, self.near_share = np.zeros((2, n))
        self.near_step = np.zeros(n, int)
        self.rings_of_tests = np.ones(n)

    def _groups(self) -> list[NDArray[np.int64]]:
        few = np.flatnonzero(self.count < 12)
        return [few] * bool(len(few)) + [np.array([c]) for c in np.flatnonzero(self.count >= 12)]

    def draw(self, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Returns the anchors that are left out, every 1 / share of those of a component."""
        held = np.zeros(len(known), bool)
        self.rings = np.zeros(len(self.share), int)
        for c in range(len(self.share)):
            anchors = self.order[(known & (self.part == c))[self.order]]
            if len(anchors) < 2:
                continue
            share = min(12 / len(anchors), 0.05)
            begin = mixed(self.frame) / 2**64
            sums = np.floor(begin + share * np.arange(1 + len(anchors)))
            held[anchors] = np.diff(sums) > 0
            distance = np.sqrt((self.part == c).sum() / len(anchors))
            self.rings[c] = np.ceil(1.5 * distance)
        return held

    def learn(self, errors: list[Array], held: NDArray[np.bool_], rings: NDArray[np.int64]) -> None:
        """Adds what the steps gain at anchors that are left out, so many edges from others.

        The errors (k, 3) are those of detail and of each of the steps.
        """
        n = len(self.share)
        q = np.linspace(0, 1, 11)[:, None]
        of_detail, *of_steps = (of[held] for of in errors)
        size = [
            np.linalg.norm((1 - q) * of_detail[:, None] + q * of[:, None], axis=2)
            for of in of_steps
        ]
        lengths = np.stack(size, axis=1)
        part = self.part[held]
        count = np.bincount(part, minlength=n)
        kept = np.where(count > 0, 0.9725, 1.0)

        def added(to: Array, new: Array, kept: Array) -> Array:
            sums = sum_to(part, new.reshape(len(part), -1), n).reshape(to.shape)
            return np.asarray(kept[:, None, None] * to + sums)

        gains, squares = np.zeros((2, len(part), 3, 11))
        gains[:, : len(of_steps)] = lengths[:, :, :1] - lengths
        squares[:, : len(of_steps)] = (lengths[:, :1] - lengths) ** 2
        self.sums = added(self.sums, gains, kept)
        self.squares = added(self.squares, squares, kept**2)
        self.count = kept * self.count + count
        farthest = np.minimum(rings[held], self.rings[part])
        self.sum_of_rings = kept * self.sum_of_rings + np.bincount(part, farthest, minlength=n)

    def choose(self) -> None:
        """Chooses the shares of each component."""
        for group in self._groups():
            found = self.sums[group].sum(axis=0)
            found -= CHANCE[:, None] * np.sqrt(self.squares[group].sum(axis=0))
            found[:, 1:3] = -np.inf  # shares of 0.1 and 0.2 are too small
            self.share[group] = found[0].argmax() / 10
            step, share = np.unravel_index(found.argmax(), found.shape)
            self.near_step[group], self.near_share[group] = step, share / 10
            count = self.count[group].sum()
            if count > 0:
                self.rings_of_tests[group] = self.sum_of_rings[group].sum() / count
