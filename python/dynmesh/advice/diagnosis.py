"""What is wrong with a sequence: with its mesh, and with what was observed."""

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from itertools import chain
from typing import Any, get_args

import numpy as np

from .. import formats
from .._arrays import Floats, Integers, Mask, Positions
from .._errors import InputError
from .._report import as_json, counted, percent, tracked
from ..completer import Completer
from ..completion.watched import Held, Places
from ..frame import LARGEST, Frame, Frames
from ..header import Header
from ..metrics import bounding_box_diagonal
from ..topology import TopologyReport, edges_of
from .findings import KINDS, Finding, Severity, found

_FAR = 4
"""An edge is long if it is longer than in frame 0 by so many mean edges."""

_STATED = (
    "name", "fps", "start", "times", "up_axis", "metres_per_unit", "has_known", "has_provenance"
)  # fmt: skip


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
    def summary(self) -> str:
        """How many problems there are, such as "1 error, 2 warnings"."""
        every = [finding.severity for finding in self.findings]
        of_each = {severity: every.count(severity) for severity in get_args(Severity)}
        messages = [counted(n, severity) for severity, n in of_each.items() if n]
        return ", ".join(messages) or "No problems were found."

    def as_dict(self) -> dict[str, Any]:
        """Returns dicts, lists, strings, numbers and None, as JSON has them."""
        header, topology = self.header, self.topology
        shares = self.known_share[1:]
        mean, *ends = (shares.mean(), shares.min(), shares.max()) if len(shares) else (None,) * 3
        return {
            "findings": [one.as_dict(header) for one in self.findings],
            "sequence": {
                "frames": header.n_frames,
                "vertices": header.n_vertices,
                "dtype": str(header.dtype),
                **{name: as_json(getattr(header, name)) for name in _STATED},
                "standard_error_of": header.standard_error_of
                if header.has_standard_error
                else None,
            },
            "mesh": {
                **({} if topology is None else as_json(topology)),
                "triangles": len(header.faces),
                "diagonal": self.diagonal,
                "mean_edge": self.mean_edge,
            },
            "known_share": as_json({"mean": mean, "least": ends[0], "most": ends[1]}),
            "never_known": self.never_known,
        }


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
    codes = [*KINDS]
    return Diagnosis(
        findings=tuple(sorted(watch.findings(), key=lambda one: codes.index(one.code))),
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
        """Yields the problems, in no order."""
        there = np.flatnonzero(self.present)
        _, group, sizes = np.unique(
            self.first[there], axis=0, return_inverse=True, return_counts=True
        )
        if len(same := there[sizes[group.reshape(-1)] > 1]):
            yield found("coincident_vertices", self.header, len(same), same)
        if self.topology is None:
            yield found("no_faces", self.header, len(self.first))
        if not any(self.shares):
            yield found("nothing_known", self.header, len(self.shares))
        limit = f"{LARGEST[self.first.dtype.itemsize]:.0e}".replace("+", "")
        share = self._places["zeros"].count / (len(self.first) * len(self.shares))
        words = {"share": percent(share), "limit": limit, "longest": f"{self._longest:.3g}"}
        for code, at in self._places.items():
            if at.count:
                yield found(code, self.header, at.count, at.vertices, at.frames, **words)


def _lengths(points: Positions, ends: Integers) -> Floats:
    along = np.diff(points[ends].astype(np.float64), axis=1)[:, 0]
    return np.asarray(np.linalg.norm(along, axis=1))


def _plausible(frame: Frame) -> Mask:
    """Returns which vertices have a position, and are not at the origin with another one."""
    zero = frame.present & ~frame.points.any(axis=1)
    return frame.present & ~zero if np.count_nonzero(zero) > 1 else frame.present
