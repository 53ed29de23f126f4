"""What is wrong with a sequence: with its mesh, and with what was observed."""

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from itertools import chain
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import formats
from .._arrays import Floats, Integers, Mask, Positions
from .._errors import InputError
from .._report import counted, few, few_frames, percent, tracked
from ..completer import Completer
from ..completion.watched import Held, Places
from ..frame import LARGEST, Frame, Frames
from ..header import Header
from ..metrics import bounding_box_diagonal
from ..topology import TopologyReport, edges_of

_FAR = 4
"""An edge is long if it is longer than in frame 0 by so many mean edges."""

MOST_PLACES = 10_000
"""At most this many vertices and frames are listed in a finding, the first ones."""

Severity = Literal["error", "warning"]
"""error: the sequence cannot be completed. warning: the result is less accurate, or the data is
faulty."""


class Kind(NamedTuple):
    """A kind of finding: what is counted, what is said of these, and what leaves them out."""

    noun: str
    text: str
    remedy: str = ""
    severity: Severity = "warning"


KINDS = {
    "known_not_finite": Kind(
        "position", "marked as known but not finite, or beyond {limit}", severity="error"
    ),
    "no_faces": Kind("vertex", "and no faces", severity="error"),
    "nothing_known": Kind("frame", "in which nothing was observed", severity="error"),
    "zeros": Kind(
        "position", "of exactly (0, 0, 0), {share} of all", "`missing` zero leaves them out"
    ),
    "long_edges": Kind(
        "position", "most of whose edges are longer than in the first frame by at least {least} "
        "mean edges, at most {longest}", "completion leaves outliers out with `reject_outliers`",
    ),
    "held": Kind(
        "position",
        "held: the same bit for bit as in the frame before, while the surface beside moved",
        "completion leaves them out with `reject_outliers`",
    ),
    "coincident_vertices": Kind(
        "vertex", "at exactly the position of another vertex in the first frame"
    ),
}  # fmt: skip
"""By the codes, the most important first: errors before warnings."""


@dataclass(frozen=True, eq=False)
class Finding:
    """One problem of a sequence.

    Attributes:
        code: names the problem.
        severity: how much it matters.
        count: how many there are of what the message counts.
        vertices: int64, ascending, at most `MOST_PLACES`.
        frames: the numbers of as many frames in their file.
        message: what was found, in a sentence.
    """

    code: str
    severity: Severity
    count: int
    vertices: Integers
    frames: NDArray[Any]
    message: str


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What a mesh and its frames are, and what is wrong with them.

    Attributes:
        findings: the most important first; empty if there are no problems.
        header: what the file states.
        topology: the report of the topology; None if there are no faces.
        diagonal: of the bounding box of frame 0, in the unit of the positions.
        mean_edge: of frame 0, in the same unit; None if no edge is longer than 0.
        known_share: (n,) float64, the share of the vertices that was observed in each frame.
        never_known: number of vertices that were observed in no frame after the first.
    """

    findings: tuple[Finding, ...]
    header: Header
    topology: TopologyReport | None
    diagonal: float
    mean_edge: float | None
    known_share: Floats
    never_known: int

    @property
    def known_later(self) -> tuple[float, float, float] | None:
        """The mean, the least and the largest share after the first frame."""
        shares = self.known_share[1:]
        return (shares.mean(), shares.min(), shares.max()) if len(shares) else None


def diagnose(reader: Frames, *, progress: bool | None = None) -> Diagnosis:
    """Looks for problems of a sequence, in one pass and in constant memory.

    Problems of the mesh and of the positions are findings, not errors.
    """
    with formats.naming(reader.path), closing(reader.frames()) as frames:
        header = reader.header
        if header.n_vertices == 0:
            raise InputError("has no vertices")
        watched = tracked(frames, header.n_frames, "reading", progress)
        first = next(watched)
        watch = _Watch(header, first)
        for number, frame in enumerate(chain([first], watched)):
            watch.add(number, frame)
    return Diagnosis(
        findings=tuple(watch.findings()),
        header=header,
        topology=watch.topology,
        diagonal=watch.diagonal,
        mean_edge=watch.mean_edge if np.nansum(watch.lengths) > 0 else None,
        known_share=np.array(watch.shares),
        never_known=int(np.count_nonzero(~watch.seen)),
    )


class _Watch:
    """Watches the frames of a sequence, one after another."""

    def __init__(self, header: Header, frame: Frame) -> None:
        self.header, k = header, len(frame.points)
        self.present = _plausible(frame)
        self.first = np.where(self.present[:, None], frame.points, 0).astype(frame.points.dtype)
        self.ends = edges_of(header.faces, k)
        self.lengths = _lengths(self.first, self.ends)
        self.lengths[~self.present[self.ends].all(axis=1)] = np.nan
        is_known = np.isfinite(self.lengths).any()
        self.mean_edge = (float(np.nanmean(self.lengths)) if is_known else 0.0) or 1.0
        there = self.first[self.present]
        self.diagonal = bounding_box_diagonal(there) if len(there) else 0.0
        has_faces = len(header.faces) > 0
        self.topology = Completer(header.faces, self.first).topology if has_faces else None
        self.shares = list[float]()
        self.seen = np.zeros(k, np.bool_)  # after the first frame
        self._longest = 0.0
        self._held = Held(self.ends, self.mean_edge)
        codes = ("known_not_finite", "zeros", "held", "long_edges")
        self._places = {code: Places(k) for code in codes}

    def add(self, number: int, frame: Frame) -> None:
        """Takes a frame into account."""
        present = _plausible(frame)
        self.shares.append(float(frame.observed.mean()))
        if number > 0:
            self.seen |= frame.observed
        found = {
            "zeros": frame.present & ~present,
            "known_not_finite": frame.claimed & ~frame.present,
            "held": self._held.watch(frame.points, frame.observed & present),
            "long_edges": self._at_long_edges(frame.points, present),
        }
        for code, mask in found.items():
            self._places[code].add(number, mask)

    def _at_long_edges(self, points: Positions, present: Mask) -> Mask:
        """Of which vertices most edges are long: of outliers, but not of those beside one."""
        both = present[self.ends].all(axis=1) & np.isfinite(self.lengths)
        ends = self.ends[both]
        longer = (_lengths(points, ends) - self.lengths[both]) / self.mean_edge
        self._longest = max(self._longest, float(longer.max(initial=0)))
        n_long, n = (
            np.bincount(of.reshape(-1), minlength=len(points)) for of in (ends[longer > _FAR], ends)
        )
        return np.asarray(2 * n_long > n)

    def findings(self) -> Iterator[Finding]:
        """Yields the problems, the most important first."""
        there = np.flatnonzero(self.present)
        _, group, sizes = np.unique(
            self.first[there], axis=0, return_inverse=True, return_counts=True
        )
        same = there[sizes[group.reshape(-1)] > 1]
        found: dict[str, tuple[int, Any, Any]] = {
            "no_faces": (len(self.first) if self.topology is None else 0, (), ()),
            "nothing_known": (0 if any(self.shares) else len(self.shares), (), ()),
            "coincident_vertices": (len(same), same, ()),
            **{code: (at.count, at.vertices, at.frames) for code, at in self._places.items()},
        }
        limit = f"{LARGEST[self.first.dtype.itemsize]:.0e}".replace("+", "")
        share = found["zeros"][0] / (len(self.first) * len(self.shares))
        lengths = {"least": _FAR, "longest": f"{self._longest:.3g}"}
        for code, kind in KINDS.items():
            count, vertices, frames = found[code]
            if not count:
                continue
            text = kind.text.format(share=percent(share), limit=limit, **lengths)
            message = f"{counted(count, kind.noun)} {text}"
            message += f", in {few_frames(frames, self.header)}" if len(frames) else ""
            message += f": {few('vertex', vertices)}" if len(vertices) else ""
            message += f"; {kind.remedy}" if kind.remedy else ""
            listed = np.asarray(vertices, np.int64)[:MOST_PLACES]
            numbers = np.array([self.header.number(frame) for frame in frames[:MOST_PLACES]])
            yield Finding(code, kind.severity, count, listed, numbers, f"{message}.")


def _lengths(points: Positions, ends: Integers) -> Floats:
    along = np.diff(points[ends].astype(np.float64), axis=1)[:, 0]
    return np.asarray(np.linalg.norm(along, axis=1))


def _plausible(frame: Frame) -> Mask:
    """Returns which vertices have a position, and are not at the origin with another one."""
    zero = frame.present & ~frame.points.any(axis=1)
    return frame.present & ~zero if np.count_nonzero(zero) > 1 else frame.present
