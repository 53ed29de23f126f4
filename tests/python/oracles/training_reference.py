"""A literal transcription of training and of learning, for the tests; see docs/method.md."""

import itertools
from typing import Any

import detail_reference
import numpy as np
import reference
from numpy.typing import NDArray
from reference import Array, sum_to
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

LOCAL_PARTS, MODES = 12, 16


def shares(weight: Array) -> Array:
    """Weights that add up to 1 at each vertex that has any."""
    total = weight.sum(axis=0)
    return np.asarray(weight / np.where(total > 0, total, 1))


def parts_of(edges: reference.Edges, frame: Array) -> Array:
    """The weight of each part at each vertex, (parts, k); the first part is the whole mesh."""
    k = len(frame)
    distance = np.linalg.norm(frame - frame.mean(axis=0), axis=1)
    seeds: list[int] = []
    while len(seeds) < LOCAL_PARTS and distance.max() > 0:
        seeds.append(int(distance.argmax()))
        to_seeds = np.linalg.norm(frame[:, None] - frame[seeds], axis=2)
        distance = to_seeds.min(axis=1)
    i, j = edges
    length = np.linalg.norm(frame[i] - frame[j], axis=1)
    along = dijkstra(coo_array((length, (i, j)), shape=(k, k)).tocsr(), indices=seeds)
    second = np.sort(along, axis=0)[1]
    rho = np.median(second[np.isfinite(second)])
    weight = shares(np.exp(-((along / (0.7 * rho)) ** 2) / 2))
    return np.vstack([np.ones(k), shares(np.where(weight < 0.15, 0, weight))])


def modes_of(z: Array, parts: Array, mean_edge: float) -> tuple[Array, Array]:
    """The modes of all parts, B, from the shapes (n, k, 3): (modes, k, 3), and the caution."""
    modes = []
    caution = []
    for part, w in enumerate(parts):
        gram = np.einsum("i,lic,mic->lm", w, z, z)
        values, vectors = np.linalg.eigh(gram)
        for value, u in list(zip(values, vectors.T, strict=True))[::-1][:MODES]:
            if value > len(z) * w.sum() * (1e-4 * mean_edge) ** 2:
                modes.append(w[:, None] * np.einsum("l,lic->ic", u, z) / np.sqrt(len(z)))
                caution.append(1.0 if part == 0 else 4.0)
    return np.stack(modes), np.array(caution)


class Posed(detail_reference.Detail):
    """Method detail with modes, for meshes of which parts are reached by two seeds."""

    most_variance = 2.0

    def _begin(self, modes: Array, caution: Array) -> None:
        self.modes = modes  # B
        self.caution = caution
        self.a = np.zeros(len(modes))
        self.sigma2: float | None = None
        self.n_v, self.d_v = 0.03 * len(modes), float(len(modes))
        self.prior_weight = self.prior_share = 0.0
        self.explained = 0.4

    def _has_modes(self) -> bool:
        return len(self.modes) > 0

    def _field(self, a: Array) -> Array:
        return np.asarray(np.einsum("j,jic->ic", a, self.modes))

    def _project(self, field: Array) -> Array:
        return np.asarray(np.einsum("jic,ic->j", self.modes, field))

    def _variance(self) -> float:
        return float(np.clip(self.n_v / self.d_v, 0.03, self.most_variance))

    def _found(self, r: Array, *frame: NDArray[Any]) -> tuple[Array, Array]:
        """Fits a to the residual r without a pose; returns the step Y3 and r3."""
        anchors, known, seen = frame
        rows = seen[:, None]
        soft = np.sqrt(self.weight) * known[:, None] * (self.noise is not None)
        fixed = np.where(rows, 0.0, self.previous)

        def towards(shape: Array) -> tuple[Array, Array]:
            """The step towards a shape, and the residual that it leaves."""
            step = self._closest(self._turn(shape), 0 * anchors, known, seen) - fixed
            residual = (self.operator @ step - self._turn(shape)) * rows
            return step, np.hstack([residual, soft * step])

        def turned_back(residual: Array) -> Array:
            return np.asarray(np.einsum("nji,nj->ni", self.q, residual[:, :3]))

        y3, r3 = towards(self._field(self.a))
        coordinates = 3 * known.sum()
        sigma2 = ((r + r3) ** 2).sum() / coordinates if self.sigma2 is None else self.sigma2
        penalty = self.caution * sigma2 / self._variance()
        if sigma2 > 0:
            h = known.astype(float)
            i, j = self.edges
            for _ in range(3):
                h = (h + sum_to(i, h[j, None], self.k)[:, 0]) / (
                    1 + np.bincount(i, minlength=self.k)
                )
            d = np.einsum("i,jic->j", h, self.modes**2)
            precondition = 1 / (d + penalty)
            determined = d / (d + penalty)
            expected = np.clip((1 - determined) * self.a, -9, 9)
            g = self._project(turned_back(r + r3)) - penalty * (self.a - expected)
            z = precondition * g
            p = z
            slope = g @ z
            for _ in range(3):
                yp, rp = towards(self._field(p))
                sp = -self._project(turned_back(rp)) + penalty * p
                length = slope / (p @ sp)
                self.a = self.a + length * p
                y3, r3 = y3 + length * yp, r3 + length * rp
                g = g - length * sp
                z = precondition * g
                last, slope = slope, g @ z
                p = z + slope / last * p
            self.n_v = (self.n_v + float(determined @ self.a**2)) / 2
            self.d_v = (self.d_v + determined.sum()) / 2
        left = ((r + r3) ** 2).sum()
        self.prior_share = float(np.clip(1 - left / (r**2).sum(), 0, 1))
        self.explained = 0.9 * self.explained + 0.1 * self.prior_share
        self.sigma2 = left / coordinates
        return y3, r3


class Trained(Posed):
    """Method detail with training."""

    def __init__(
        self,
        faces: NDArray[np.int64],
        first_frame: Array,
        training: Array,
        noise: float | None = None,
    ) -> None:
        super().__init__(faces, first_frame, noise)
        shapes = [self._shape_of(frame) for frame in training]
        self.q = np.tile(np.eye(3), (self.k, 1, 1))
        self._begin(*modes_of(np.stack(shapes), parts_of(self.edges, first_frame), self.h))
        self.n_frames = len(training)

    def _shape_of(self, frame: Array) -> Array:
        """The deviation of the trained shape from that of frame 0."""
        self._fit(frame)  # by singular values: wherever the pose is
        turned = np.einsum("nji,nj->ni", self.q, self.operator @ frame)
        return np.asarray(turned - self.first_memory)

    def _posed(
        self, x: list[Array], r: list[Array], detail: list[Array], *frame: NDArray[Any]
    ) -> tuple[list[Array], list[Array], list[Array]]:
        y3, r3 = self._found(r[0] + r[1], *frame)
        k = float(np.clip(self._variance() / 0.03 - 1, 0, 1))
        if self.noise is None:
            k *= float(np.clip(self.explained / 0.2 - 1, 0, 1))
        k *= float(np.clip(2 - self.n_v / self.d_v / self.n_frames, 0, 1))
        self.prior_weight = k
        rest = detail[1] + k * self._field(self.a)
        return [x[0], x[1] + k * y3], [r[0], r[1] + k * r3], [detail[0], rest, detail[2]]


class Learned(Posed):
    """Method detail that learns from its own frames."""

    most_variance = 0.03

    def __init__(
        self, faces: NDArray[np.int64], first_frame: Array, noise: float | None = None
    ) -> None:
        super().__init__(faces, first_frame, noise)
        self._begin(np.zeros((0, self.k, 3)), np.zeros(0))
        self.parts = parts_of(self.edges, first_frame)
        self.library: list[Array] = []
        self.offered = 0

    def _posed(
        self, x: list[Array], r: list[Array], detail: list[Array], *frame: NDArray[Any]
    ) -> tuple[list[Array], list[Array], list[Array]]:
        if len(self.modes) == 0:
            return x, r, detail
        self.a = np.zeros(len(self.modes))
        y3, r3 = self._found(r[0], *frame)
        self.prior_weight = 1.0
        change = self._field(self.a)
        return (
            [x[0] + y3, x[1] - y3],
            [r[0] + r3, r[1] - r3],
            [detail[0] + change, detail[1] - change, detail[2]],
        )

    def complete(self, points: Array, known: NDArray[np.bool_]) -> Array:
        self.prior_weight = self.prior_share = 0.0
        completed = super().complete(points, known)
        if known.any():
            self._offer(np.asarray(self.memory - self.first_memory))
        return completed

    def _offer(self, shape: Array) -> None:
        self.offered += 1
        if self.offered % 4 != 0:
            return
        self.library.append(shape.astype(np.float32).astype(float))
        if len(self.library) > 28:
            pairs = itertools.combinations(range(len(self.library)), 2)

            def distance(pair: tuple[int, int]) -> float:
                return float(np.linalg.norm(self.library[pair[0]] - self.library[pair[1]]))

            older, _ = min(pairs, key=distance)
            del self.library[older]
        if len(self.library) > 1:
            self._learn(*modes_of(np.stack(self.library), self.parts, self.h))

    def _learn(self, modes: Array, caution: Array) -> None:
        kept = self.n_v, self.d_v, self.sigma2, self.explained
        report = self.prior_weight, self.prior_share
        is_first = len(self.modes) == 0
        self._begin(modes, caution)
        self.prior_weight, self.prior_share = report
        if not is_first:
            self.n_v, self.d_v, self.sigma2, self.explained = kept
