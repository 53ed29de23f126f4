"""Outliers of frame 0, from which completion starts, found by what other frames say."""

from collections.abc import Iterator

import numpy as np

from ..files import Header
from ..sequence import Mask, Positions
from .finding import Finding, counted, listed
from .mesh import Mesh

_FEWEST_FRAMES = 5
_FEWEST_EDGES = 3
_TIMES = 3.0  # as long as in other frames


class FirstFrame:
    """Compares the lengths of edges in frame 0 with those in all other frames."""

    def __init__(self, header: Header, mesh: Mesh) -> None:
        """Starts with frame 0."""
        self._header = header
        self._mesh = mesh
        self._counts = np.zeros(len(mesh.ends), np.int64)
        self._least = np.full((2, len(mesh.ends)), np.inf)

    def watch(self, points: Positions, observed: Mask) -> None:
        """Takes the next frame into account."""
        told = np.flatnonzero(observed[self._mesh.ends].all(axis=1))
        a, b = points[self._mesh.ends[told]].astype(np.float64).transpose(1, 0, 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            times = self._mesh.lengths[told] / np.linalg.norm(a - b, axis=1)
        self._counts[told] += 1
        least, second = self._least[:, told]
        self._least[:, told] = np.fmin(least, times), np.fmax(least, np.fmin(second, times))

    def findings(self) -> Iterator[Finding]:
        """Yields the outliers, if completion starts from frame 0, as that is whole."""
        if not (self._mesh.observed | self._mesh.zeros).all():
            return
        k, told = len(self._mesh.first), self._counts >= _FEWEST_FRAMES
        told &= np.isfinite(self._mesh.lengths)
        # In one of the frames, an end may be an outlier by chance just as far away.
        off = told & (self._least[1] > _TIMES)
        n_told, n_off = (
            np.bincount(self._mesh.ends[edges].reshape(-1), minlength=k) for edges in (told, off)
        )
        vertices = np.flatnonzero((n_told >= _FEWEST_EDGES) & (2 * n_off >= n_told))
        if len(vertices):
            yield Finding.at(
                "first_frame_outliers",
                f"{counted(len(vertices), 'outlier')} in frame {self._header.number(0)}, where "
                f"edges are more than {_TIMES:g} times as long as in all other frames: "
                f"{listed('vertex', vertices)}.",
                "Completion starts from this frame, so they stay wrong in all frames. If outliers "
                "are rejected and completion starts from the best frame, most of them are left out "
                "and estimated anew.",
                vertices=vertices,
                frames=[0],
            )
