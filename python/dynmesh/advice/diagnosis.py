"""Problems of a sequence: of its mesh, of what was observed, and of its motion."""

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from .. import formats
from .._arrays import Floats, Integers, Mask, Positions
from .._errors import InputError
from .._report import as_json, counted, percent, runs_of, tracked
from ..completer import Completer
from ..completion.watched import Held, Places, medians_at
from ..frame import LARGEST, Frame, Frames
from ..header import Header
from ..metrics import bounding_box_diagonal
from ..topology import TopologyReport, components_of, edges_of
from ..whole_frames.window import best_frame
from .findings import KINDS, Finding, Severity, found

_RECENT = 3  # frames; vertices last seen earlier do not count for the motion
_FEWEST = 3  # vertices, to measure the motion of a frame
_ENOUGH = 30  # vertices also seen in the previous frame; then only these count

_AROUND = 4  # frames on each side, except the next ones, to compare a frame's motion with
_MANY_TIMES = 6
_LEAST_LEAP = 0.02  # of the diagonal

_FAR = 4  # mean edges, and times the edges around
_SCRAMBLED = 0.4  # of the edges

_REFUSED = {
    "degenerate": "degenerate_faces",
    "non_manifold_edge": "non_manifold_edges",
    "non_manifold_vertex": "non_manifold_vertices",
}
"""By the kind of a face that a half-edge mesh cannot represent."""

_STATED = (
    "name", "fps", "start", "times", "up_axis", "metres_per_unit", "has_known", "has_provenance"
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The problems of a mesh and its motion.

    Attributes:
        findings: the most important first; empty if there are no problems.
        header: what the file states.
        topology: the report of the topology; None if there are no faces.
        diagonal: of the bounding box of frame 0, in the unit of the positions.
        mean_edge: of frame 0, in the same unit; None if no edge is longer than 0.
        known_share: (n,) float64, the share of the vertices that was observed in each frame.
    """

    findings: tuple[Finding, ...]
    header: Header
    topology: TopologyReport | None
    diagonal: float
    mean_edge: float | None
    known_share: Floats

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
        of_mesh = {} if topology is None else as_json(topology)
        of_mesh |= {"refused_faces": topology and len(topology.refused_faces)}
        return {
            "findings": [one.as_dict(header) for one in self.findings],
            "sequence": {
                "frames": header.n_frames,
                "vertices": header.n_vertices,
                "dtype": str(header.dtype),
                **{name: as_json(getattr(header, name)) for name in _STATED},
            },
            "mesh": {
                **of_mesh,
                "triangles": len(header.faces),
                "diagonal": self.diagonal,
                "mean_edge": self.mean_edge,
            },
            "known_share": as_json({"mean": mean, "least": ends[0], "most": ends[1]}),
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
        watch = _Watch(header, next(watched))
        for number, frame in enumerate(watched, 1):
            watch.next(number, frame)
    result = [*watch.of_mesh(), *watch.of_frames()]
    codes = [*KINDS]
    return Diagnosis(
        findings=tuple(sorted(result, key=lambda one: (one.severity, codes.index(one.code)))),
        header=header,
        topology=watch.topology,
        diagonal=watch.diagonal,
        mean_edge=watch.mean_edge if np.nansum(watch.lengths) > 0 else None,
        known_share=np.array(watch.shares),
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
        self.shares, self.medians = list[float](), [np.nan]
        codes = ("known_not_finite", "zeros", "held", "outliers")
        self._places = {code: Places(k) for code in codes}
        self._in_first = self.present & frame.observed
        self._seen = np.zeros(k, np.bool_)
        self._counts = list[int]()
        self._held = Held(self.ends, self.mean_edge)
        self._last, self._last_seen = self.first.copy(), np.where(self.present, 0, -_RECENT - 1)
        self._scrambled, self._farthest = dict[int, float](), 0.0
        self._observe(0, frame)

    def next(self, number: int, frame: Frame) -> None:
        """Takes the next frame into account."""
        self._observe(number, frame)
        present = _plausible(frame)
        self._seen |= frame.observed
        points, gap = frame.points, number - self._last_seen
        moved = np.flatnonzero(present & (gap == 1))
        if len(moved) < _ENOUGH:
            moved = np.flatnonzero(present & (gap <= _RECENT))
        distance = np.linalg.norm(points[moved].astype(np.float64) - self._last[moved], axis=1)
        median = np.nan
        if len(moved) >= min(_FEWEST, len(points)):
            median = float(np.median(distance / gap[moved]) / (self.diagonal or 1.0))
        self.medians.append(median)
        self._find_astray(number, points, present)
        self._last[present] = points[present]
        self._last_seen[present] = number

    def _observe(self, number: int, frame: Frame) -> None:
        self.shares.append(float(frame.observed.mean()))
        observed = frame.observed & _plausible(frame)
        self._counts.append(int(np.count_nonzero(observed)))
        self._places["zeros"].add(number, frame.present & ~_plausible(frame))
        self._places["known_not_finite"].add(number, frame.claimed & ~frame.present)
        self._places["held"].add(number, self._held.watch(frame.points, observed))

    def _find_astray(self, number: int, points: Positions, observed: Mask) -> None:
        both = observed[self.ends].all(axis=1)
        ends, k = self.ends[both], len(points)
        length = _lengths(points, ends)
        longer = np.nan_to_num((length - self.lengths[both]) / self.mean_edge)
        far = longer > _FAR
        if not far.any():
            return
        if (share := float(np.mean(far))) > _SCRAMBLED:
            self._scrambled[number] = share
            return
        # Where a surface stretches, all edges around become longer, too.
        torn = far & (longer > _FAR * medians_at(ends, longer, k, lower=True)[ends].min(axis=1))
        whole, part = components_of(ends, k), components_of(ends[~torn], k)
        # A part that long edges tear off is astray, as holes are that were filled with one place.
        astray = 2 * np.bincount(part, minlength=k)[part] < np.bincount(whole, minlength=k)[whole]
        self._places["outliers"].add(number, astray)
        nearest = np.full(k, np.inf)
        for end in ends[torn].T:
            np.minimum.at(nearest, end, length[torn] / self.mean_edge)
        of_astray = nearest[astray & np.isfinite(nearest)]
        self._farthest = max(self._farthest, float(of_astray.max(initial=0)))

    def of_mesh(self) -> Iterator[Finding]:
        """Yields the problems of the surface."""
        there = np.flatnonzero(self.present)
        _, group, sizes = np.unique(
            self.first[there], axis=0, return_inverse=True, return_counts=True
        )
        if len(places := there[sizes[group.reshape(-1)] > 1]):
            yield found("coincident_vertices", self.header, vertices=places)
        if self.topology is None:
            yield found("no_faces", self.header, count=len(self.first))
            return
        for kind, code in _REFUSED.items():
            faces = [face.index for face in self.topology.refused_faces if face.kind == kind]
            if faces:
                yield found(code, self.header, faces=faces)

    def of_frames(self) -> Iterator[Finding]:
        """Yields the problems of what was observed, and of the motion."""
        header, k = self.header, len(self.first)
        if not self._in_first.all():
            missing = np.flatnonzero(~self._in_first)
            severity: Severity = "warning" if any(self._counts) else "error"
            of_all: dict[str, Any] = {"all": k, "start": self._start(), "severity": severity}
            yield found("first_frame_incomplete", header, vertices=missing, frames=[0], **of_all)
        share = self._places["zeros"].count / (k * len(self.shares))
        limit = LARGEST[self.first.dtype.itemsize]
        words: dict[str, dict[str, Any]] = {
            "zeros": {"worst": share, "share": percent(share)},
            "outliers": {"worst": self._farthest},
            "known_not_finite": {"limit": f"{limit:.0e}".replace("+", "")},
        }
        for code, places in self._places.items():
            if places.count:
                yield found(code, header, **places.places, **words.get(code, {}))
        shares = np.array(self.shares[1:])
        none = np.flatnonzero(shares == 0) + 1
        if len(none):
            longest = max(map(len, runs_of(none)))
            yield found("frames_without_anchors", header, frames=none, worst=longest)
        never, beside = ~self._seen, np.zeros(k, np.bool_)
        beside[self.ends[self._seen[self.ends].any(axis=1)]] = True
        if shares.any() and not beside[never].all():  # single vertices do little harm
            of_all = {"share": percent(float(never.mean())), "first": header.number(0)}
            yield found("never_seen", header, vertices=np.flatnonzero(never), **of_all)
        scrambled, medians = [*self._scrambled], np.array(self.medians)
        if scrambled:
            share = max(self._scrambled.values())
            of_all = {"worst": share, "share": percent(share)}
            yield found("scrambled_frames", header, frames=scrambled, **of_all)
        if leaps := [t for t in _leaps_of(medians) if not {t, t - 1} & {*scrambled}]:
            of_all = {"worst": medians[leaps].max(), "typical": f"{np.nanmedian(medians):.2g}"}
            yield found("leaps", header, frames=leaps, **of_all)

    def _start(self) -> str:
        k, counts = len(self.first), self._counts
        if not any(counts):
            return "Nothing was observed in any frame, so the sequence cannot be completed."
        best = counts.index(k) if k in counts else best_frame(counts)
        never = np.count_nonzero(~(self._seen | self._in_first))
        return (
            f"Completion starts from frame {self.header.number(best)}, which knows "
            f"{percent(counts[best] / k)}; {percent(never / k)} are never known."
        )


def _lengths(points: Positions, ends: Integers) -> Floats:
    along = np.diff(points[ends].astype(np.float64), axis=1)[:, 0]
    return np.asarray(np.linalg.norm(along, axis=1))


def _leaps_of(medians: Floats) -> Iterator[int]:
    """The frames that move much more than those around them, except their direct neighbours."""
    for t in np.flatnonzero(medians > _LEAST_LEAP):
        before, after = medians[max(1, t - 1 - _AROUND) : max(1, t - 1)], medians[t + 2 :][:_AROUND]
        usual = [float(np.nanmedian(side)) for side in (before, after) if np.isfinite(side).any()]
        if usual and medians[t] > _MANY_TIMES * max(usual):
            yield int(t)


def _plausible(frame: Frame) -> Mask:
    """Returns which vertices have a position, and are not at the origin with another one."""
    zero = frame.present & ~frame.points.any(axis=1)
    return frame.present & ~zero if np.count_nonzero(zero) > 1 else frame.present
