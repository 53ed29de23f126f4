"""Problems of the motion: frames that jump, and outliers."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .._arrays import Mask, Positions
from .._report import counted
from ..header import Header
from .finding import Finding, Places, frames_listed, percent
from .mesh import Mesh

_RECENT = 3  # frames; vertices last seen earlier do not count for the motion
_FEWEST = 3  # vertices, to measure the motion of a frame
_ENOUGH = 30  # vertices also seen in the previous frame; then only these count

_AROUND = 4  # frames on each side, except the next ones, to compare a frame's motion with
_MANY_TIMES = 6
_LEAST_LEAP = 0.02  # of the diagonal

_FAR = 4  # mean edges
_SCRAMBLED = 0.4  # of the edges


class Motion:
    """Measures how the vertices move, frame by frame.

    Attributes:
        medians: of each frame so far, the median distance that a vertex moved per frame, in
            diagonals of frame 0; NaN if too few vertices were seen recently.
    """

    def __init__(self, header: Header, mesh: Mesh) -> None:
        self._header = header
        self.medians: list[float] = [np.nan]
        self._mesh = mesh
        self._last = mesh.first.copy()
        self._last_seen = np.where(mesh.present, 0, -_RECENT - 1)
        self._astray = Places(len(mesh.first))
        self._farthest = 0.0
        self._scrambled: list[int] = []
        self._worst_share = 0.0
        self._limits = (mesh.lengths + _FAR * mesh.mean_edge) ** 2  # comparisons with NaN are false

    def watch(self, number: int, points: Positions, observed: Mask) -> None:
        """Takes the next frame into account."""
        gap = number - self._last_seen
        moved = np.flatnonzero(observed & (gap == 1))
        if len(moved) < _ENOUGH:
            moved = np.flatnonzero(observed & (gap <= _RECENT))
        distance = np.linalg.norm(points[moved].astype(np.float64) - self._last[moved], axis=1)
        unit = self._mesh.diagonal or 1.0
        are_enough = len(moved) >= min(_FEWEST, len(points))
        self.medians.append(
            float(np.median(distance / gap[moved]) / unit) if are_enough else np.nan
        )
        self._find_astray(number, points, observed)
        self._last[observed] = points[observed]
        self._last_seen[observed] = number

    def findings(self) -> Iterator[Finding]:
        """Yields the problems found in all frames."""
        if self._scrambled:
            yield Finding.at(
                "scrambled_frames",
                f"{counted(len(self._scrambled), 'frame')} with scrambled vertices: up to "
                f"{percent(self._worst_share)} of the edges are more than {_FAR} mean edges too "
                f"long, in {frames_listed(self._scrambled, self._header)}.",
                "The vertices do not correspond to those of the first frame, or the unit changes. "
                "dynmesh completes tracked meshes: number the vertices alike in all frames.",
                frames=self._scrambled,
                worst=self._worst_share,
            )
        yield from self._leaps()
        if count := self._astray.count:
            yield Finding.at(
                "outliers",
                f"{counted(count, 'outlier')} more than {_FAR} mean edges from the surface around "
                f"them, at most {self._farthest:.3g}, {self._astray.told(self._header)}.",
                "They displace the vertices that are estimated around them. Let completion reject "
                "outliers, or mark them as missing in the known mask.",
                **self._astray.places,
                worst=self._farthest,
            )

    def _find_astray(self, number: int, points: Positions, observed: Mask) -> None:
        ends = self._mesh.ends
        steps = points[ends[:, 0]] - points[ends[:, 1]]
        # Unobserved positions are arbitrary; they are excluded below, among the few long edges.
        with np.errstate(invalid="ignore", over="ignore"):
            far = np.flatnonzero(np.einsum("ij,ij->i", steps, steps) > self._limits)
        far = far[observed[ends[far]].all(axis=1)]
        if not len(far):
            return
        k = len(points)
        both = observed[ends].all(axis=1)
        share = len(far) / int(both.sum())
        near = np.copy(both)
        near[far] = False
        whole, part = _parts(ends[both], k), _parts(ends[near], k)
        # A part that long edges tear off is astray, as holes are that were filled with one place.
        astray = 2 * np.bincount(part)[part] < np.bincount(whole)[whole]
        if share > _SCRAMBLED:
            self._scrambled.append(number)
            self._worst_share = max(self._worst_share, share)
        elif astray.any():
            self._astray.add(number, astray)
            pairs = far[astray[ends[far]].any(axis=1)]
            a, b = points[ends[pairs]].astype(np.float64).transpose(1, 0, 2)
            length = np.linalg.norm(a - b, axis=1) / self._mesh.mean_edge
            nearest = np.full(k, np.inf)
            for end in ends[pairs].T:
                np.minimum.at(nearest, end, length)
            self._farthest = max(self._farthest, float(nearest[np.isfinite(nearest)].max()))

    def _leaps(self) -> Iterator[Finding]:
        medians = np.array(self.medians)
        frames = np.array([t for t in range(1, len(medians)) if _leaps_at(medians, t)], np.int64)
        scrambled = np.array(self._scrambled, np.int64)
        frames = np.setdiff1d(frames, np.concatenate([scrambled, scrambled + 1]))
        if not len(frames):
            return
        worst = float(medians[frames].max())
        typical = float(np.nanmedian(medians))
        yield Finding.at(
            "leaps",
            f"{counted(len(frames), 'frame')} with a jump of up to {worst:.3g} diagonals, where "
            f"{typical:.2g} is typical: {frames_listed(frames, self._header)}.",
            "This is a cut, a gap in the recording, or a misplaced frame (two jumps, there and "
            "back). Estimates are inaccurate after a jump: start a new sequence at a cut, and "
            "remove misplaced frames.",
            frames=frames,
            worst=worst,
        )


def _parts(edges: NDArray[np.integer], n_vertices: int) -> NDArray[np.int64]:
    """Returns the number of the first vertex of the part of each vertex, as edges join them."""
    part = np.arange(n_vertices)
    while True:
        least = part.copy()
        for one, other in (edges.T, edges.T[::-1]):
            np.minimum.at(least, one, part[other])
        least = least[least]
        if np.array_equal(least, part):
            return part
        part = least


def _leaps_at(medians: NDArray[np.float64], t: int) -> bool:
    """Whether a frame moves much more than the frames around it, except its direct neighbours."""
    if not medians[t] > _LEAST_LEAP:
        return False
    before, after = (
        medians[max(1, t - 1 - _AROUND) : max(1, t - 1)],
        medians[t + 2 : t + 2 + _AROUND],
    )
    usual = [float(np.nanmedian(side)) for side in (before, after) if np.isfinite(side).any()]
    return bool(usual) and medians[t] > _MANY_TIMES * max(usual)
