"""Outliers of frame 0, from which completion starts, found by what other frames say."""

from collections.abc import Iterator

import numpy as np

from ..sequence import Mask, Positions
from .finding import Finding, counted, listed
from .mesh import Mesh

_FEWEST_FRAMES = 5
_FEWEST_EDGES = 3
_LEAST = 0.7  # of the logarithm of a length, as in dynmesh.whole_frame


class FirstFrame:
    """Compares the lengths of edges in frame 0 with those in all other frames."""

    def __init__(self, mesh: Mesh) -> None:
        """Starts with frame 0."""
        self._mesh = mesh
        with np.errstate(divide="ignore"):
            self._lengths = np.log(mesh.lengths)
        self._counts = np.zeros(len(mesh.ends), np.int64)
        self._nearest = np.full((2, len(mesh.ends)), np.inf)

    def watch(self, points: Positions, observed: Mask) -> None:
        """Takes the next frame into account."""
        told = np.flatnonzero(observed[self._mesh.ends].all(axis=1))
        a, b = points[self._mesh.ends[told]].astype(np.float64).transpose(1, 0, 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.abs(np.log(np.linalg.norm(a - b, axis=1)) - self._lengths[told])
        self._counts[told] += 1
        nearest, second = self._nearest[:, told]
        self._nearest[:, told] = np.fmin(nearest, off), np.fmax(nearest, np.fmin(second, off))

    def findings(self) -> Iterator[Finding]:
        """Yields the outliers, if there are any."""
        k, told = len(self._mesh.first), self._counts >= _FEWEST_FRAMES
        told &= np.isfinite(self._lengths)
        # In one of the frames, an end may be an outlier by chance just as far away.
        off = told & (self._nearest[1] > _LEAST)
        n_told, n_off = (
            np.bincount(self._mesh.ends[edges].reshape(-1), minlength=k) for edges in (told, off)
        )
        vertices = np.flatnonzero((n_told >= _FEWEST_EDGES) & (2 * n_off >= n_told))
        if len(vertices):
            yield Finding.at(
                "first_frame_outliers",
                f"{counted(len(vertices), 'outlier')} in frame 0, where edges have other lengths "
                f"than in all other frames: {listed('vertex', vertices)}.",
                "Completion starts from frame 0, so they stay wrong in all frames. Use --start "
                "clean, which leaves them out.",
                vertices=vertices,
                frames=[0],
            )
