"""A literal transcription of the error bars, which the tests compare with; see docs/method.md."""

from typing import Any

import detail_reference
import numpy as np
from detail_reference import BITS_64, mixed
from numpy.typing import NDArray
from reference import Array, sum_to

MEMBERS = 9
"""Numbers of a vertex: the members of the ensemble of a coordinate."""


def signs(of_frame: int, k: int) -> Array:
    """Random signs, (k, 9): the highest bit of a number first."""
    numbers = [mixed((of_frame + v) & BITS_64) for v in range(k)]
    return np.array([[1 - 2 * (n >> (63 - i) & 1) for i in range(MEMBERS)] for n in numbers], float)


class WithBars(detail_reference.Detail):
    """Method detail with standard errors."""

    def __init__(self, faces: NDArray[np.int64], first: Array, noise: float | None = None) -> None:
        super().__init__(faces, first, noise)
        self.e, self.eta = (np.zeros((self.k, MEMBERS)) for _ in range(2))
        self.energies = np.zeros((self.k, 2))
        self.total = np.zeros(2)
        self.size = np.ones(self.k)
        self.frames = 0
        self.standard_error = np.zeros(self.k)

    def _mean(self, values: Array) -> Array:
        """The mean of the cell, or the value of a vertex without neighbours."""
        i, j = self.edges
        valence = np.bincount(i, minlength=self.k)[:, None]
        mean = sum_to(i, values[j], self.k) / np.maximum(valence, 1)
        return np.where(valence > 0, mean, values)

    def _smooth(self, values: Array, times: int) -> Array:
        for _ in range(times):
            values = (values + self._mean(values)) / 2
        return values

    def complete(self, points: Array, known: NDArray[np.bool_]) -> Array:
        """Completes a frame, and finds its standard errors."""
        self.solved_for: Any = None
        seen = np.isin(self.label, self.label[known])
        x = super().complete(points, known)
        self._draw()
        self._find(known, seen)
        return x

    def _solve(self, points: Array, known: NDArray[np.bool_], seen: NDArray[np.bool_]) -> Array:
        weight = self.weight if self.noise is not None else 0.0
        x = super()._solve(points, known, seen)
        self.solved_for = (x, self.target, points, weight)
        return x

    def _closest(self, target: Array, *rest: Any) -> Array:
        self.target = target
        return super()._closest(target, *rest)

    def _draw(self) -> None:
        own = signs(mixed(self.frames), self.k)
        shared = signs(mixed(mixed(self.frames)), self.clusters.max() + 1)[self.clusters]
        fresh = self._smooth(own + 0.5 * shared, 2)
        kept = 0.0 if self.frames == 0 else 0.75
        self.eta = kept * self.eta + np.sqrt(1 - kept**2) * fresh
        self.frames += 1

    def _find(self, known: NDArray[np.bool_], seen: NDArray[np.bool_]) -> None:
        nothing: Any = (None, None, None, 0.0)
        x, target, points, weight = self.solved_for or nothing
        t = self.e + self.size[:, None] * self.eta
        d = np.zeros_like(t)
        if x is not None:
            solved = seen & ~known if self.noise is None else seen
            columns = self.operator[:, solved]
            right = columns.T @ t
            system = columns.T @ columns
            noise = np.zeros_like(t)
            if self.noise is not None:
                noise = signs(~mixed(self.frames) & BITS_64, self.k) * known[:, None]
                noise *= np.sqrt((t * t).mean() / weight)
                right += weight * (noise * known[:, None])[solved]
                system += np.diag(weight * known[solved])
            d[solved] = np.linalg.solve(system, right)
        after = np.where(seen[:, None], self.operator @ d, t)
        if x is not None:
            soft = weight * known * (self.noise is not None)
            r = self.operator @ x - target
            found = (r * r).sum(axis=1) + soft * ((x - points) ** 2).sum(axis=1)
            made_up = ((after - t) ** 2).sum(axis=1) + soft * ((d - noise) ** 2).sum(axis=1)
            energies = np.stack([found, made_up / 3], axis=1) * seen[:, None]
            newest = energies.sum(axis=0)
            self.total = 0.98 * self.total + newest
            scale = max(of[0] / of[1] for of in (newest, self.total))
            energies[:, 1] /= self.size**2
            self.energies = 0.9 * self.energies + self._smooth(energies, 4)
            mean = self.energies.mean(axis=0)
            relative = self.energies / mean
            self.size = np.clip(np.sqrt((relative[:, 0] + 0.3) / (relative[:, 1] + 0.3)), 0.1, 10)
            variance = (d * d).mean(axis=1)
            self.standard_error = self.sizes[self.label] * np.sqrt(scale * variance)
        else:
            self.standard_error = np.zeros(self.k)
        self.standard_error[~seen] = np.inf
        self.e = after
