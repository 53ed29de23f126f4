"""Problems of what was observed: missing vertices and unusable positions."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .._arrays import Mask
from .._report import counted
from ..frame import LARGEST, Frame
from ..header import Header
from .finding import Finding, Places, frames_listed, listed, percent, stretches
from .mesh import Mesh

_BACKWARDS = (
    "Frames before it are completed backwards. A complete mesh from a template or a scan at rest "
    "may be a better start."
)


class Presence:
    """Counts observed vertices, frame by frame.

    Attributes:
        shares: of each frame so far, the share of the vertices that was observed.
    """

    def __init__(self, header: Header, mesh: Mesh, first: Frame) -> None:
        self._header = header
        self.shares: list[float] = []
        self._mesh = mesh
        self._in_first = mesh.present & first.observed
        self._n_vertices = len(mesh.first)
        self._limit = f"{LARGEST[first.points.dtype.itemsize]:.0e}".replace("+", "")
        self._seen = np.zeros(self._n_vertices, np.bool_)
        self._best, self._known_in_best = 0, np.count_nonzero(self._in_first)
        self._unusable = Places(self._n_vertices)
        self._zeros = Places(self._n_vertices)
        self._count(0, first)

    def watch(self, number: int, frame: Frame) -> Mask:
        """Takes the next frame into account and returns which of its positions are plausible."""
        self._count(number, frame)
        present = plausible(frame)
        self._seen |= frame.observed
        # A better start is the first complete frame, or else knows more, or as much and is nearer
        # to the middle: see :func:`dynmesh.whole_frames.whole_frame`.
        known, most = np.count_nonzero(present & frame.observed), self._known_in_best
        away, least = (abs(2 * n + 1 - self._header.n_frames) for n in (number, self._best))
        if known > most or (known == most < self._n_vertices and away < least):
            self._best, self._known_in_best = number, known
        return present

    def findings(self) -> Iterator[Finding]:
        """Yields the problems found in all frames."""
        yield from self._frame_0()
        yield from self._not_finite()
        yield from self._zero_rows()
        shares = np.array(self.shares[1:])
        yield from self._empty(shares)
        if len(shares) and shares.any():
            yield from self._never_seen()

    def _count(self, number: int, frame: Frame) -> None:
        self._zeros.add(number, frame.present & ~plausible(frame))
        self.shares.append(float(frame.observed.mean()))
        self._unusable.add(number, frame.claimed & ~frame.present)

    def _frame_0(self) -> Iterator[Finding]:
        missing = np.flatnonzero(~self._in_first)
        if not len(missing):
            return
        k, known = self._n_vertices, self._known_in_best
        start = f"Completion starts from frame {self._header.number(self._best)}"
        if known == 0:
            advice = "Nothing was observed in any frame, so the sequence cannot be completed."
        elif known == k:
            advice = f"{start}, the first complete one. {_BACKWARDS}"
        else:
            never = np.count_nonzero(~(self._seen | self._in_first))
            advice = (
                f"No frame is complete. {start}, which knows most vertices, {percent(known / k)}; "
                f"{percent((k - known - never) / k)} are put together from other frames. "
                f"{_BACKWARDS}"
            )
        yield Finding.at(
            "first_frame_incomplete",
            f"Frame {self._header.number(0)} lacks {len(missing)} of {counted(k, 'vertex')}: "
            f"{listed('vertex', missing)}.",
            advice,
            vertices=missing,
            frames=[0],
            severity="warning" if known else "error",
        )

    def _not_finite(self) -> Iterator[Finding]:
        if count := self._unusable.count:
            yield Finding.at(
                "known_not_finite",
                f"{counted(count, 'position')} marked as known but not finite, or beyond "
                f"{self._limit}, {self._unusable.told(self._header)}.",
                "The sequence cannot be completed: such a frame is refused. Mark them as missing "
                "in the known mask, or write them as NaN in a file without masks.",
                **self._unusable.places,
            )

    def _zero_rows(self) -> Iterator[Finding]:
        if count := self._zeros.count:
            share = count / (self._n_vertices * len(self.shares))
            yield Finding.at(
                "zeros",
                f"{counted(count, 'position')} of exactly (0, 0, 0), {percent(share)} of all, "
                f"{self._zeros.told(self._header)}.",
                "The sensor probably wrote zeros where it observed nothing. Taken as positions, "
                "they pull the mesh towards the origin. If so, say it: `missing` zero.",
                **self._zeros.places,
                worst=share,
            )

    def _empty(self, shares: NDArray[np.float64]) -> Iterator[Finding]:
        none = np.flatnonzero(shares == 0) + 1
        if len(none):
            longest = max(map(len, stretches(none)))
            yield Finding.at(
                "frames_without_anchors",
                f"{counted(len(none), 'frame')} without any known vertex, at most {longest} in a "
                f"row: {frames_listed(none, self._header)}.",
                "The mesh stands still in these frames and jumps afterwards. A frame without known "
                "vertices cannot be completed from the past; if later frames may be used, "
                "interpolate instead.",
                frames=none,
                worst=longest,
            )

    def _never_seen(self) -> Iterator[Finding]:
        never = np.flatnonzero(~self._seen)
        ends = self._mesh.ends
        beside_seen = np.zeros(self._n_vertices, np.bool_)
        beside_seen[ends[self._seen[ends].any(axis=1)]] = True
        if beside_seen[never].all():
            return  # single vertices do little harm
        yield Finding.at(
            "never_seen",
            f"{counted(len(never), 'vertex')}, {percent(len(never) / self._n_vertices)} of all, "
            f"never known after frame {self._header.number(0)}, in patches: "
            f"{listed('vertex', never)}.",
            "Nothing corrects their estimates, in which errors accumulate. Training frames, or "
            "completion from both sides, may help.",
            vertices=never,
        )


def plausible(frame: Frame) -> Mask:
    """Returns which vertices have a position, and are not at the origin with another one."""
    zero = frame.present & ~frame.points.any(axis=1)
    return frame.present & ~zero if np.count_nonzero(zero) > 1 else frame.present
