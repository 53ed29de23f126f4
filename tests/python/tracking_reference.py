"""A literal transcription of tracking without viewpoints; see docs/reference/tracking.md."""

from typing import Any

import numpy as np
import reference
import training_reference
from numpy.typing import NDArray
from reference import Array

Integers = NDArray[np.int64]

NOT_FOUND = -1


def vertex_normals(faces: Integers, x: Array) -> Array:
    a, b, c = (x[faces[:, n]] for n in range(3))
    normals = np.zeros_like(x)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], np.cross(b - a, c - a))
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def nearest(
    to: Array, normals: Array, points: Array, of_points: Array, radius: float, *, sided: bool
) -> NDArray[np.int64]:
    """The nearest agreeing point of each position, or NOT_FOUND; not sided, either side agrees."""
    distance = np.linalg.norm(to[:, None] - points[None], axis=2)
    cosine = normals @ of_points.T
    distance[(cosine if sided else np.abs(cosine)) < 0.8] = np.inf
    found = distance.argmin(axis=1)
    found[distance.min(axis=1) >= radius] = NOT_FOUND
    return np.asarray(found)


class Tracked(reference.Detail):
    """Tracks closed meshes, frame by frame."""

    def __init__(self, faces: Integers, first_frame: Array) -> None:
        super().__init__(faces, first_frame)
        self.faces = faces
        self.before = first_frame
        self.searches = 0
        self.preconditioner: Any = None

    def track(
        self, points: Array, normals: Array, *, sided: bool = True
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Returns the tracked frame and which vertices were observed.

        If not `sided`, the signs of the normals mean nothing.
        """
        self.points, self.normals, self.sided = points, normals, sided
        self.preconditioner = None
        self.found = np.full(self.k, NOT_FOUND)
        self.last_step = np.zeros_like(self.previous)
        x = self.previous + 0.6 * (self.previous - self.before)
        for _ in range(2):
            x = self._moved_rigidly(x)
        x = self._searched(x)
        for progress in (1 / 3, 2 / 3, 1.0):
            x, _ = self._nonrigid_step(x, progress)
        _, _, weight = self._correspond(x, 1.0, 1.5, 1.0)
        self.before, self.previous = self.previous, x
        self._fit(x)
        self.memory = np.einsum("nji,nj->ni", self.q, self.operator @ x)
        return x, weight > 0

    def _searched(self, x: Array) -> Array:
        for done in range(12):
            x, lost = self._nonrigid_step(x, 0.0)
            self.searches = done + 1
            if lost <= 0.02:
                break
        return x

    def _kept(self, x: Array, own: Array, distance: float) -> NDArray[np.bool_]:
        """Which vertices keep the point that they have found before in the frame."""
        near = np.linalg.norm(self.points[self.found] - x, axis=1) < distance * self.h
        cosine = (self.normals[self.found] * own).sum(axis=1)
        agrees = (cosine if self.sided else np.abs(cosine)) >= 0.8
        return np.asarray((self.found != NOT_FOUND) & near & agrees)

    def _correspond(
        self, x: Array, radius: float, scale: float, kept: float = 0.0
    ) -> tuple[Array, Array, Array]:
        own = vertex_normals(self.faces, x)
        found = nearest(x, own, self.points, self.normals, radius * self.h, sided=self.sided)
        found = np.where(self._kept(x, own, kept), self.found, found)
        self.found = np.where(found != NOT_FOUND, found, self.found)
        q, n = self.points[found], self.normals[found]
        offset = (q - x) / self.h
        distance = (offset**2).sum(axis=1)
        aside = distance - (offset * n).sum(axis=1) ** 2
        weight = 1 / ((1 + distance / scale**2) * (1 + aside / scale**2))
        taken = found != NOT_FOUND
        sharing = np.bincount(found[taken], minlength=len(self.points))
        usual = max(1.0, 1.5 * taken.sum() / len(self.points))
        excess = np.maximum(1.0, sharing[found] / usual)
        return q, n, np.where(taken, weight / excess**2, 0.0)

    def _moved_rigidly(self, x: Array) -> Array:
        q, n, w = self._correspond(x, 12, 4)
        centre = (w[:, None] * x).sum(axis=0) / w.sum()
        arm = x - centre
        reach = np.sqrt((w * (arm**2).sum(axis=1)).sum() / w.sum())
        rows = np.concatenate([np.cross(arm / reach, n), n], axis=1)
        normal = (w[:, None] * rows).T @ rows
        normal += 1e-3 * np.trace(normal) / 6 * np.eye(6)
        solution = np.linalg.solve(normal, rows.T @ (w * ((q - x) * n).sum(axis=1)))
        turn = solution[:3] / reach
        angle = np.linalg.norm(turn)
        a, b, c = turn / angle
        cross = np.array([[0, -c, b], [c, 0, -a], [-b, a, 0]])
        rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
        return np.asarray(arm @ rotation.T + centre + solution[3:])

    def _drawn(self, x: Array, q: Array, n: Array, w: Array) -> tuple[Array, Array, Array, float]:
        """Draws vertices towards the measured points that no vertex explains."""
        stride = 1 + len(self.points) // 4096
        points, normals = self.points[::stride], self.normals[::stride]
        own = vertex_normals(self.faces, x)
        vertex = nearest(points, normals, x, own, 24 * self.h, sided=self.sided)
        if not self.sided:
            normals = normals * np.sign((normals * own[vertex]).sum(axis=1, keepdims=True))
        near = vertex != NOT_FOUND
        far = near & (np.linalg.norm(points - x[vertex], axis=1) >= 1.5 * self.h)
        free = (w == 0) | (np.linalg.norm(q - x, axis=1) >= 1.5 * self.h)
        far &= free[vertex]
        if far.sum() / near.sum() > 0.25 + free.mean():
            return q, n, w, 0.0
        q, n, w = q.copy(), n.copy(), w.copy()
        for v in np.unique(vertex[far]):
            mine = far & (vertex == v)
            q[v] = points[mine].mean(axis=0)
            total = normals[mine].sum(axis=0)
            n[v] = total / np.linalg.norm(total)
            w[v] = 1 / (1 + ((q[v] - x[v]) ** 2).sum() / (12 * self.h) ** 2)
        return q, n, w, far.sum() / near.sum()

    def _rest_shape(self, x: Array, q: Array, n: Array, w: Array, progress: float) -> Array:  # noqa: ARG002
        """The shape to which the surface returns, in the axes of frame 0."""
        return np.asarray(self.first_memory)

    def _nonrigid_step(self, x: Array, progress: float) -> tuple[Array, float]:
        early = progress < 0.5
        q, n, w = self._correspond(x, 8 if early else 3, 1.5, 0.5)
        lost = 0.0
        if early:
            q, n, w, lost = self._drawn(x, q, n, w)
        assert w.sum() >= 12
        w = w * 0.0025 * (0.4 / 0.0025) ** progress
        self._fit(x)
        rest = self._rest_shape(x, q, n, w, progress)
        target = self._turn(0.7 * self.memory + 0.3 * rest)

        def product(y: Array) -> Array:
            along = (y * n).sum(axis=1, keepdims=True) * n
            return np.asarray(self.operator.T @ (self.operator @ y) + w[:, None] * along)

        if self.preconditioner is None:
            self.preconditioner = self.operator.T @ self.operator + np.diag(w)
        data = (w * (q * n).sum(axis=1))[:, None] * n
        start = x
        residual = self.operator.T @ target + data - product(x)
        if self.last_step.any():
            curved = product(self.last_step)
            length = (residual * self.last_step).sum() / (self.last_step * curved).sum()
            x = x + length * self.last_step
            residual = residual - length * curved
        direction = np.zeros_like(x)
        size = 1.0
        for step in range(6):
            z = np.linalg.solve(self.preconditioner, residual)
            next_size = (residual * z).sum()
            direction = z + (next_size / size if step else 0.0) * direction
            size = next_size
            curved = product(direction)
            length = size / (direction * curved).sum()
            x = x + length * direction
            residual = residual - length * curved
        self.last_step = x - start
        return x, lost


class TrackedTrained(Tracked, training_reference.Trained):
    """Tracks closed meshes after training."""

    largest_kept = 0.0

    def __init__(self, faces: Integers, first_frame: Array, training: Array) -> None:
        training_reference.Trained.__init__(self, faces, first_frame, training)
        self.faces = faces
        self.before = first_frame
        self.noise = 1.0  # anchors are weighted
        self.fitted = self.first_memory

    def _rest_shape(self, x: Array, q: Array, n: Array, w: Array, progress: float) -> Array:
        if progress == 1 / 3:
            known, seen = w > 0, np.full(self.k, True)
            self.weights = w[:, None]
            self.weight = self.weights  # type: ignore[assignment]
            observed = x + ((q - x) * n).sum(axis=1, keepdims=True) * n
            closest = self._closest(self._turn(self.first_memory), observed, known, seen)
            left = self.operator @ closest - self._turn(self.first_memory)
            residual = np.hstack([left, np.sqrt(self.weights) * (closest - observed)])
            self._found(residual, observed, known, seen)
            self.prior_weight = float(np.clip(self._variance() / 0.03 - 1, 0, 1))
            self.fitted = self.first_memory + self.prior_weight * self._field(self.a)
        return np.asarray(self.fitted)

    def _closest(
        self, target: Array, anchors: Array, known: NDArray[np.bool_], seen: NDArray[np.bool_]
    ) -> Array:
        assert seen.all()
        normal = self.operator.T @ self.operator + np.diag(self.weights[:, 0])
        right_side = self.operator.T @ target + self.weights * np.where(known[:, None], anchors, 0)
        return np.asarray(np.linalg.solve(normal, right_side))
