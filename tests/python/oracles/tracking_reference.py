"""A literal transcription of tracking closed meshes; see docs/reference/tracking.md.

It leaves out the forces of the membrane, which move such meshes too little to be noticed here;
tests/cpp/tracking_test.cpp compares them with the slope of its energy.
"""

from typing import NamedTuple

import detail_reference
import numpy as np
import training_reference
from numpy.typing import NDArray
from reference import Array
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

Integers = NDArray[np.int64]

MEMBRANE = 0.02
HOLD = 1e-4 * MEMBRANE


def vertex_normals(faces: Integers, x: Array) -> Array:
    a, b, c = (x[faces[:, n]] for n in range(3))
    normals = np.zeros_like(x)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], np.cross(b - a, c - a))
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def places(points: Array, faces: Integers, x: Array) -> tuple[Array, Array]:
    """The nearest place of each face to each point: its shares, and its distance."""
    corners = x[faces][None] - points[:, None, None]
    edges = np.roll(corners, -1, axis=2) - corners
    share = np.clip(-(corners * edges).sum(axis=3) / (edges**2).sum(axis=3), 0, 1)
    shares = np.zeros((4, len(points), len(faces), 3))
    for side in range(3):
        shares[side, :, :, side] = 1 - share[:, :, side]
        shares[side, :, :, (side + 1) % 3] = share[:, :, side]
    normal = np.cross(edges[:, :, 0], edges[:, :, 1])
    for corner in range(3):
        b, c = corners[:, :, (corner + 1) % 3], corners[:, :, (corner + 2) % 3]
        area = (np.cross(b, c) * normal).sum(axis=2) / (normal**2).sum(axis=2)
        shares[3, :, :, corner] = area
    distance = np.linalg.norm(np.einsum("apfc,pfcx->apfx", shares, corners), axis=3)
    distance[3, (shares[3] < 0).any(axis=2)] = np.inf
    best = distance.argmin(axis=0)
    return (
        np.take_along_axis(shares, best[None, :, :, None], axis=0)[0],
        np.take_along_axis(distance, best[None], axis=0)[0],
    )


class Rows(NamedTuple):
    """Measured points with their places."""

    corners: Integers
    shares: Array
    normals: Array
    points: Array
    weights: Array
    distances: Array
    """In mean edges."""

    def of(self, x: Array) -> Array:
        """Returns the positions of the places."""
        return np.asarray(np.einsum("rc,rcx->rx", self.shares, x[self.corners]))

    def nearest_corners(self) -> Integers:
        """Returns the corner with the largest share of each place."""
        nearest = self.shares.argmax(axis=1)[:, None]
        return np.asarray(np.take_along_axis(self.corners, nearest, axis=1)[:, 0])

    def nearest_distances(self) -> dict[int, float]:
        """Returns the distance of each vertex that has points from the nearest of them."""
        nearest: dict[int, float] = {}
        for v, distance in zip(self.nearest_corners(), self.distances, strict=True):
            nearest[int(v)] = min(nearest.get(int(v), np.inf), distance)
        return nearest

    def to_vertices(self, values: Array, k: int) -> Array:
        """Returns the sums, at the vertices, of a value of each row times its shares."""
        sums = np.zeros((k, *values.shape[1:]))
        for corner in range(3):
            np.add.at(sums, self.corners[:, corner], (self.shares[:, corner] * values.T).T)
        return sums


def estimated_normals(points: Array, mean_edge: float) -> Array:
    """The normals of planes through the nearest points; 0 for points on a line."""
    normals = np.zeros_like(points)
    tree = cKDTree(points)
    for i, point in enumerate(points):
        distances, numbers = tree.query(point, min(96, len(points)))
        n = max(12, np.count_nonzero(np.asarray(distances) <= mean_edge))
        around = points[np.asarray(numbers)[:n]]
        variances, axes = np.linalg.eigh(np.cov(around.T))
        if variances[1] > 0.2 * variances[2]:
            normals[i] = axes[:, 0]
    return normals


def _quantile(rows: Rows) -> float:
    """The distance within which most of the vertices with a point have one."""
    return float(np.quantile(list(rows.nearest_distances().values()), 0.98))


class Tracked(detail_reference.Detail):
    """Tracks a closed mesh of one component, frame by frame."""

    def __init__(self, faces: Integers, first_frame: Array) -> None:
        super().__init__(faces, first_frame)
        self.begin(faces, first_frame)

    def begin(self, faces: Integers, first_frame: Array) -> None:
        self.faces = faces
        self.before = first_frame
        self.times_weight = 1.0
        self.normal = self.operator.T @ self.operator + MEMBRANE * self.laplacian
        a, b, c = (first_frame[faces[:, n]] for n in range(3))
        self.outside = np.sign((a * np.cross(b, c)).sum())

    def track(
        self, points: Array, normals: Array, *, sided: bool = True
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Returns the tracked frame and which vertices were observed.

        If not `sided`, the signs of the normals mean nothing.
        """
        self.points, self.normals, self.sided = points, normals, sided
        part = self._spread()
        x = self.previous + 0.6 * (self.previous - self.before)
        if self._distance(x, part) > self._distance(self.previous, part) + 1:
            x = self.previous
        for _ in range(6):
            rows = self._match(x, part, scale=4)
            moved = self._moved_rigidly(x, rows)
            way = np.linalg.norm(moved - x, axis=1).max() / self.h
            x = moved
            if way < 0.3:
                break
        n = int(np.clip(np.ceil(1 + 3 * _quantile(rows)), 1, 8))
        before = x
        for i in range(n):
            left = n - i - 1
            weight = max(0.05, 2 * self.times_weight * 2.2**-left)
            rows = self._match(x, part if left >= 2 else slice(None), left >= 2)
            rows = rows._replace(weights=weight * rows.weights)
            nearest = self.nearest
            bent = self._bent(x, rows, weight if left == 1 else None)
            x = bent + 0.6 * (bent - before) if left > 1 else bent
            before = bent
        self.iterations = n
        # The nearest places of the last iteration, as they lie now.
        corners, shares = nearest
        of = np.einsum("rc,rcx->rx", shares, x[corners])
        is_near = np.linalg.norm(points - of, axis=1) <= self.h
        surface = np.einsum(
            "rc,rcx->rx", shares, self.outside * vertex_normals(self.faces, x)[corners]
        )
        cosine = (surface * normals).sum(axis=1) / np.linalg.norm(surface, axis=1)
        agrees = (cosine if sided else np.abs(cosine)) > 0.7
        is_near &= agrees | ~normals.any(axis=1)
        observed = np.zeros(self.k, dtype=bool)
        observed[corners[is_near][shares[is_near] > 0]] = True
        step, last = (x - self.previous)[observed], (self.previous - self.before)[observed]
        hardly = len(step) * (0.003 * self.h) ** 2
        scale = np.sqrt((step**2).sum() * (last**2).sum()) + hardly
        common = (step * last).sum()
        if common < 0:
            common /= 1 + (step**2).sum() / (len(step) * (0.3 * self.h) ** 2)
        times = 8 ** (common / scale if scale > 0 else 0)
        self.times_weight = float(np.clip(times * self.times_weight, 0.125, 1))
        self.before, self.previous = self.previous, x
        self._fit(x)
        self.memory = np.einsum("nji,nj->ni", self.q, self.operator @ x)
        return x, observed

    def _distance(self, x: Array, part: Integers | slice) -> float:
        return _quantile(self._match(x, part, scale=4))

    def _spread(self) -> Integers | slice:
        """Returns which points are matched at first: one of each few along a curve."""
        self.every = int(len(self.points) / (3 * self.k) + 0.5)
        if self.every < 2:
            return slice(None)
        least = self.points.min(axis=0)
        share = (self.points - least) / (self.points - least).max()
        cells = np.minimum(share * 2**20, 2**20 - 1).astype(np.int64)
        bits = cells[:, None] >> np.arange(20)[:, None] & 1
        codes = (bits << np.arange(60).reshape(20, 3)).sum(axis=(1, 2))
        order = np.argsort(codes, kind="stable")
        first: Integers = order[np.arange(len(order)) % 256 % self.every == 0]
        return first

    def _match(
        self,
        x: Array,
        part: Integers | slice,
        looks_farther: bool = False,
        scale: float | None = None,
    ) -> Rows:
        points, normals = self.points[part], self.normals[part]
        shares, distance = places(points, self.faces, x)
        distance /= self.h
        surface = np.einsum(
            "pfc,fcx->pfx", shares, self.outside * vertex_normals(self.faces, x)[self.faces]
        )
        surface /= np.linalg.norm(surface, axis=2, keepdims=True)
        cosine = np.einsum("pfx,px->pf", surface, normals)
        agrees = (cosine if self.sided else np.abs(cosine)) > 0.7
        agrees[~normals.any(axis=1)] = True
        every = np.arange(len(points))
        nearest = distance.argmin(axis=1)
        self.nearest = self.faces[nearest], shares[every, nearest]
        agreeing = np.where(agrees, distance, np.inf).argmin(axis=1)
        is_else = ~agrees[every, nearest] & (distance[every, nearest] > 0.8) & looks_farther
        face = np.where(is_else, agreeing, nearest)
        place = np.einsum("pc,pcx->px", shares[every, face], x[self.faces[face]])
        along = np.einsum("px,px->p", place - points, surface[every, face]) / self.h
        beside = is_else & (np.abs(along) < 0.8 * distance[every, face])
        kept = agrees[every, face] & (distance[every, face] < 8) & ~beside
        every, face = every[kept], face[kept]
        sign = np.where(cosine[every, face] < 0, -1, 1)[:, None]
        mean = sign * normals[kept] + surface[every, face]
        mean /= np.linalg.norm(mean, axis=1, keepdims=True)
        distances = distance[every, face]
        corners, shares = self.faces[face], shares[every, face]
        rows = Rows(corners, shares, mean, points[kept], np.ones(len(corners)), distances)
        if scale is None:
            weights = 1 / (1 + (distances / self._usual(rows)) ** 2) ** 2
        else:
            weights = 1 / (1 + (distances / scale) ** 2)
        points_of_row = 1 if isinstance(part, slice) else self.every
        weights *= points_of_row
        assert weights.sum() >= 12
        density = min(1, len(np.unique(corners)) / (points_of_row * len(corners)))
        return rows._replace(weights=density * weights)

    def _usual(self, rows: Rows) -> Array:
        """Six times the median of the distances of the vertices around."""
        nearest = rows.nearest_distances()
        cluster = self.clusters[list(nearest)]
        distances = np.array(list(nearest.values()))
        around = self.beside | np.eye(len(self.beside), dtype=bool)
        usual = np.zeros(len(around))
        for c in np.unique(cluster):
            usual[c] = 6 * np.median(distances[around[c, cluster]])
        return np.clip(usual, 0.3, 1.5)[self.clusters[rows.nearest_corners()]]

    def _moved_rigidly(self, x: Array, rows: Rows) -> Array:
        w = rows.weights
        place = rows.of(x)
        centre = (w[:, None] * place).sum(axis=0) / w.sum()
        arm = place - centre
        reach = np.sqrt((w * (arm**2).sum(axis=1)).sum() / w.sum())
        moved = np.concatenate([np.cross(arm / reach, rows.normals), rows.normals], axis=1)
        normal = (w[:, None] * moved).T @ moved
        normal += 1e-3 * np.trace(normal) / 6 * np.eye(6)
        off = ((rows.points - place) * rows.normals).sum(axis=1)
        solution = np.linalg.solve(normal, moved.T @ (w * off))
        turn = Rotation.from_rotvec(solution[:3] / reach)
        return np.asarray(turn.apply(x - centre) + centre + solution[3:])

    def _rest_shape(self, x: Array, rows: Rows, weight: float | None) -> Array:  # noqa: ARG002
        """The shape to which the surface returns, in the axes of frame 0."""
        return np.asarray(self.first_memory)

    def _bent(self, x: Array, rows: Rows, weight: float | None) -> Array:
        self._fit(x)
        rest = self._rest_shape(x, rows, weight)
        target = self._turn(0.6 * self.memory + 0.4 * rest)

        # Every coordinate of every vertex: the minimum, which the tracker approximates.
        jacobian = np.zeros((len(rows.points), self.k, 3))
        every = np.arange(len(rows.points))
        for corner in range(3):
            part = rows.shares[:, corner, None] * rows.normals
            np.add.at(jacobian, (every, rows.corners[:, corner]), part)
        by_row = jacobian.reshape(len(every), -1)
        matrix = np.kron(self.normal + HOLD * np.eye(self.k), np.eye(3))
        matrix += by_row.T @ (rows.weights[:, None] * by_row)
        off = rows.weights * ((rows.points - rows.of(x)) * rows.normals).sum(axis=1)
        residual = self.operator.T @ (target - self.operator @ x)
        right = residual.ravel() + by_row.T @ off
        return np.asarray(x + np.linalg.solve(matrix, right).reshape(-1, 3))


class TrackedTrained(Tracked, training_reference.Trained):
    """Tracks closed meshes after training."""

    largest_kept = 0.0

    def __init__(self, faces: Integers, first_frame: Array, training: Array) -> None:
        training_reference.Trained.__init__(self, faces, first_frame, training)
        self.begin(faces, first_frame)
        self.noise = 1.0  # anchors are weighted
        self.fitted = self.first_memory

    def _rest_shape(self, x: Array, rows: Rows, weight: float | None) -> Array:
        if weight is not None:
            sums = rows.to_vertices(rows.weights, self.k)
            off = ((rows.points - rows.of(x)) * rows.normals).sum(axis=1)
            along = rows.to_vertices(rows.weights * off, self.k) / np.maximum(sums, 1e-300)
            mean = rows.to_vertices(rows.weights[:, None] * rows.normals, self.k)
            mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
            known, seen = sums > 0, np.full(self.k, True)
            self.weights = (0.05 / weight * sums)[:, None]
            self.weight = self.weights  # type: ignore[assignment]
            self.now = x
            observed = x + along[:, None] * mean
            closest = self._closest(self._turn(self.first_memory), observed, known, seen)
            left = self.operator @ closest - self._turn(self.first_memory)
            residual = np.hstack([left, np.sqrt(self.weights) * (closest - observed)])
            self.now = np.zeros_like(x)  # what is added is a step
            self._found(residual, observed, known, seen)
            self.prior_weight = float(np.clip(self._variance() / 0.03 - 1, 0, 1))
            self.fitted = self.first_memory + self.prior_weight * self._field(self.a)
        return np.asarray(self.fitted)

    def _closest(
        self, target: Array, anchors: Array, known: NDArray[np.bool_], seen: NDArray[np.bool_]
    ) -> Array:
        assert seen.all()
        normal = self.normal + np.diag(self.weights[:, 0])
        right_side = self.operator.T @ (target - self.operator @ self.now)
        right_side += self.weights * np.where(known[:, None], anchors - self.now, 0)
        return np.asarray(self.now + np.linalg.solve(normal, right_side))
