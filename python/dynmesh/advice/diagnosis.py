"""Problems of a sequence: of its mesh, of what was observed, and of its motion."""

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from .. import formats
from .._arrays import Mask, Positions
from .._errors import InputError
from .._report import as_json, counted, few, few_frames, percent, runs_of, tracked
from ..completer import Completer
from ..completion.watched import Held, Places, medians_at
from ..frame import LARGEST, Frame, Frames
from ..header import Header
from ..metrics import bounding_box_diagonal
from ..topology import TopologyReport, components_of, edges_of, likely_up
from ..whole_frames.window import best_frame

Severity = Literal["error", "warning"]
"""error: the sequence cannot be completed. warning: the result is less accurate, or the data is
faulty."""

MOST_PLACES = 10_000
"""At most this many vertices, faces and frames are listed in a finding, the first ones."""


class Kind(NamedTuple):
    """A kind of finding: what is counted, what is said of these, and what they do to completion."""

    noun: str
    text: str
    effect: str
    severity: Severity = "warning"


_ACROSS = "Motion propagates across them."

KINDS = {
    "known_not_finite": Kind(
        "position", "marked as known but not finite, or beyond {limit}",
        "Completion refuses such a frame.", "error",
    ),
    "no_faces": Kind(
        "vertex", "and no faces", "Completion needs them: motion propagates along edges.", "error"
    ),
    "first_frame_incomplete": Kind(
        "vertex", "of {all} missing", "{start} Frames before it are completed backwards."
    ),
    "scrambled_frames": Kind(
        "frame", "with scrambled vertices: up to {share} of the edges are much too long",
        "Completion needs vertices that are numbered alike in all frames.",
    ),
    "zeros": Kind(
        "position", "of exactly (0, 0, 0), {share} of all",
        "As positions, they pull the mesh there; `missing` zero leaves them out.",
    ),
    "leaps": Kind(
        "frame", "with a jump of up to {worst} diagonals, where {typical} is typical",
        "Estimates are inaccurate after a jump.",
    ),
    "outliers": Kind(
        "outlier", "that edges longer than around tear off, by {worst} mean edges",
        "They displace the vertices around them; completion can reject outliers.",
    ),
    "held": Kind(
        "position",
        "held: the same bit for bit as in the frame before, while the surface beside moved",
        "They hold back the vertices around them; completion can reject outliers.",
    ),
    "frames_without_anchors": Kind(
        "frame", "without any known vertex, at most {worst} in a row",
        "The mesh stands still in these frames and jumps afterwards.",
    ),
    "never_seen": Kind(
        "vertex", "in patches, {share} of all, never known after frame {first}",
        "Nothing corrects their estimates, in which errors accumulate.",
    ),
    "coincident_vertices": Kind(
        "vertex", "at exactly the position of another vertex in the first frame",
        "No edge joins the sides of a cut there, which are completed separately and may open.",
    ),
    "non_manifold_edges": Kind("triangle", "at edges with two others", _ACROSS),
    "non_manifold_vertices": Kind(
        "triangle", "at vertices where sheets touch in a single point", _ACROSS
    ),
    "degenerate_faces": Kind("triangle", "with a repeated vertex", "Only their edges count."),
}  # fmt: skip
"""By the codes, the most important first."""


@dataclass(frozen=True, eq=False)
class Finding:
    """One problem of a sequence.

    Attributes:
        code: names the problem.
        severity: how much it matters.
        count: how many there are of what the message counts.
        vertices: int64, ascending, at most `MOST_PLACES`.
        faces: the same, rows of the sequence's triangles.
        frames: the same, counted from 0; messages and JSON have their numbers in the file.
        message: what was found, in a sentence.
        advice: the effect on completion, and what to do.
        worst: the worst value, in the unit that docs/diagnosis.md lists for this code, or None.
    """

    code: str
    severity: Severity
    count: int
    vertices: NDArray[np.int64]
    faces: NDArray[np.int64]
    frames: NDArray[np.int64]
    message: str
    advice: str
    worst: float | None = None

    def as_dict(self, header: Header) -> dict[str, Any]:
        """Returns what JSON has."""
        described: dict[str, Any] = as_json(self)
        return described | {"frames": [header.number(int(frame)) for frame in self.frames]}


def found(
    code: str,
    header: Header,
    *,
    vertices: Any = (),
    faces: Any = (),
    frames: Any = (),
    count: int | None = None,
    worst: float | None = None,
    severity: Severity | None = None,
    **words: object,
) -> Finding:
    """Makes a finding; without a `count`, of the first of these places. `words` enter its text."""
    kind, given = KINDS[code], {"vertices": vertices, "faces": faces, "frames": frames}
    places: dict[str, Any] = {name: np.asarray(one, np.int64) for name, one in given.items()}
    count = count or next(len(one) for one in places.values() if len(one))
    words = {"worst": None if worst is None else f"{worst:.3g}", **words}
    message = f"{counted(count, kind.noun)} {kind.text.format(**words)}"
    message += f", in {few_frames(places['frames'], header)}" if len(places["frames"]) else ""
    named = [few(what, one) for what, one in (("vertex", vertices), ("face", faces)) if len(one)]
    return Finding(
        code=code,
        severity=severity or kind.severity,
        count=count,
        message=": ".join([message, *named]) + ".",
        advice=kind.effect.format(**words),
        worst=worst,
        **{name: one[:MOST_PLACES] for name, one in places.items()},
    )


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
        motion: (n,) float64, the median distance that a vertex moved since the previous frame, in
            diagonals; NaN for frame 0 and for frames with too few observed vertices.
        likely_up: "y" or "z"; a guess if the file does not state it.
    """

    findings: tuple[Finding, ...]
    header: Header
    topology: TopologyReport | None
    diagonal: float
    mean_edge: float | None
    known_share: NDArray[np.float64]
    motion: NDArray[np.float64]
    likely_up: str

    @property
    def counts(self) -> dict[Severity, int]:
        """The number of findings of each severity."""
        every = [finding.severity for finding in self.findings]
        return {severity: every.count(severity) for severity in get_args(Severity)}

    @property
    def summary(self) -> str:
        """How many problems there are, such as "1 error, 2 warnings"."""
        messages = [counted(n, severity) for severity, n in self.counts.items() if n]
        return ", ".join(messages) or "No problems were found."

    def as_dict(self) -> dict[str, Any]:
        """Returns dicts, lists, strings, numbers and None, as JSON has them."""
        header, topology = self.header, self.topology
        shares, motion = self.known_share[1:], self.motion[np.isfinite(self.motion)]

        def measures(values: NDArray[np.float64], **of: Any) -> dict[str, float | None]:
            return {name: float(one(values)) if len(values) else None for name, one in of.items()}

        of_mesh = {} if topology is None else as_json(topology)
        of_mesh |= {"refused_faces": topology and len(topology.refused_faces)}
        return {
            "findings": [one.as_dict(header) for one in self.findings],
            "sequence": {
                "frames": header.n_frames,
                "vertices": header.n_vertices,
                "dtype": str(header.dtype),
                "likely_up": self.likely_up,
                **{name: as_json(getattr(header, name)) for name in _STATED},
            },
            "mesh": {
                **of_mesh,
                "triangles": len(header.faces),
                "diagonal": self.diagonal,
                "mean_edge": self.mean_edge,
            },
            "known_share": measures(shares, mean=np.mean, least=np.min, most=np.max),
            "motion": measures(motion, median=np.median, most=np.max),
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
        motion=np.array(watch.medians),
        likely_up=likely_up(watch.first[watch.present], header.up_axis),
    )


class _Watch:
    """Watches the frames of a sequence, one after another."""

    def __init__(self, header: Header, frame: Frame) -> None:
        self.header, k = header, len(frame.points)
        self.present = _plausible(frame)
        self.first = np.where(self.present[:, None], frame.points, 0).astype(frame.points.dtype)
        self.ends = edges_of(header.faces, k)
        self.lengths = np.linalg.norm(
            np.diff(self.first[self.ends].astype(np.float64), axis=1)[:, 0], axis=1
        )
        self.lengths[~self.present[self.ends].all(axis=1)] = np.nan
        is_known = np.isfinite(self.lengths).any()
        self.mean_edge = (float(np.nanmean(self.lengths)) if is_known else 0.0) or 1.0
        there = self.first[self.present]
        self.diagonal = bounding_box_diagonal(there) if len(there) else 0.0
        has_faces = len(header.faces) > 0
        self.topology = Completer(header.faces, self.first).topology if has_faces else None
        self.shares, self.medians = list[float](), [np.nan]
        self._places = {
            code: Places(k) for code in ("known_not_finite", "zeros", "held", "outliers")
        }
        self._in_first = self.present & frame.observed
        self._seen = np.zeros(k, np.bool_)
        self._counts = list[int]()
        self._held = Held(self.ends, self.mean_edge)
        self._last, self._last_seen = self.first.copy(), np.where(self.present, 0, -_RECENT - 1)
        self._scrambled: dict[int, float] = {}
        self._farthest = 0.0
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
        ends = self.ends[both]
        a, b = points[ends].astype(np.float64).transpose(1, 0, 2)
        length = np.linalg.norm(a - b, axis=1)
        longer = np.nan_to_num((length - self.lengths[both]) / self.mean_edge)
        far = longer > _FAR
        if not far.any():
            return
        if (share := float(np.mean(far))) > _SCRAMBLED:
            self._scrambled[number] = share
            return
        # Where a surface stretches, all edges around become longer, too.
        k = len(points)
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
        missing = np.flatnonzero(~self._in_first)
        if len(missing):
            severity: Severity = "warning" if any(self._counts) else "error"
            yield found(
                "first_frame_incomplete",
                header,
                vertices=missing,
                frames=[0],
                severity=severity,
                all=k,
                start=self._start(),
            )
        share = self._places["zeros"].count / (k * len(self.shares))
        limit = f"{LARGEST[self.first.dtype.itemsize]:.0e}".replace("+", "")
        worst = {"zeros": share, "outliers": self._farthest}
        words = {"zeros": {"share": percent(share)}, "known_not_finite": {"limit": limit}}
        for code, places in self._places.items():
            if places.count:
                of_all = {**places.places, "worst": worst.get(code), **words.get(code, {})}
                yield found(code, header, **of_all)
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
        scrambled = np.array([*self._scrambled], np.int64)
        if len(scrambled):
            share = max(self._scrambled.values())
            of_all = {"worst": share, "share": percent(share)}
            yield found("scrambled_frames", header, frames=scrambled, **of_all)
        medians = np.array(self.medians)
        each = [t for t in range(1, len(medians)) if _leaps_at(medians, t)]
        leaps = np.setdiff1d(each, np.concatenate([scrambled, scrambled + 1])).astype(np.int64)
        if len(leaps):
            worst_leap, typical = float(medians[leaps].max()), f"{np.nanmedian(medians):.2g}"
            yield found("leaps", header, frames=leaps, worst=worst_leap, typical=typical)

    def _start(self) -> str:
        k, counts = len(self.first), self._counts
        best = counts.index(k) if k in counts else best_frame(counts)
        known, start = counts[best], f"Completion starts from frame {self.header.number(best)}"
        if known == 0:
            return "Nothing was observed in any frame, so the sequence cannot be completed."
        if known == k:
            return f"{start}, the first complete one."
        never = np.count_nonzero(~(self._seen | self._in_first))
        return (
            f"No frame is complete. {start}, which knows most vertices, {percent(known / k)}; "
            f"{percent((k - known - never) / k)} are put together from other frames."
        )


def _leaps_at(medians: NDArray[np.float64], t: int) -> bool:
    """Whether a frame moves much more than the frames around it, except its direct neighbours."""
    if not medians[t] > _LEAST_LEAP:
        return False
    before, after = medians[max(1, t - 1 - _AROUND) : max(1, t - 1)], medians[t + 2 :][:_AROUND]
    usual = [float(np.nanmedian(side)) for side in (before, after) if np.isfinite(side).any()]
    return bool(usual) and medians[t] > _MANY_TIMES * max(usual)


def _plausible(frame: Frame) -> Mask:
    """Returns which vertices have a position, and are not at the origin with another one."""
    zero = frame.present & ~frame.points.any(axis=1)
    return frame.present & ~zero if np.count_nonzero(zero) > 1 else frame.present
