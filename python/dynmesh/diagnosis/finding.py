"""The findings of a diagnosis, and a description of the sequence."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .._arrays import Mask
from .._report import as_json, counted
from .._report import listed as joined
from ..header import Header
from ..topology import TopologyReport

Severity = Literal["error", "warning"]
"""error: the sequence cannot be completed. warning: the result is less accurate, or the data is
faulty."""

SEVERITIES: tuple[Severity, ...] = ("error", "warning")

SEVERITY_OF: dict[str, Severity] = {
    "known_not_finite": "error",
    "no_faces": "error",
    "first_frame_incomplete": "warning",
    "scrambled_frames": "warning",
    "zeros": "warning",
    "leaps": "warning",
    "outliers": "warning",
    "frames_without_anchors": "warning",
    "never_seen": "warning",
    "coincident_vertices": "warning",
    "first_vertex_unused": "warning",
    "non_manifold_edges": "warning",
    "non_manifold_vertices": "warning",
    "degenerate_faces": "warning",
}
"""The severities of all findings by their codes, the most important first."""

CODES = tuple(SEVERITY_OF)

Indices = NDArray[np.int64]

MOST_PLACES = 10_000
"""At most this many vertices, faces and frames are listed in a finding, the first ones."""

_MOST_SHOWN = 5


@dataclass(frozen=True, eq=False)
class Where:
    """The vertices, faces and frames of a finding, ascending, at most `MOST_PLACES` of each.

    Attributes:
        vertices: int64
        faces: int64, rows of the sequence's triangles.
        frames: int64, counted from 0; messages and JSON have their numbers in the file.
    """

    vertices: Indices
    faces: Indices
    frames: Indices


@dataclass(frozen=True, eq=False)
class Finding:
    """One problem of a sequence.

    Attributes:
        code: identifies the problem, for programs; the codes do not change.
        severity: how much it matters.
        count: how many there are of what the message counts.
        where: the first of them.
        message: what was found, in a sentence.
        advice: the effect on completion, and what to do.
        worst: the worst value, in the unit that docs/diagnosis.md lists for this code, or
            None.
    """

    code: str
    severity: Severity
    count: int
    where: Where
    message: str
    advice: str
    worst: float | None = None

    @classmethod
    def at(
        cls,
        code: str,
        message: str,
        advice: str,
        *,
        vertices: Any = (),
        faces: Any = (),
        frames: Any = (),
        count: int | None = None,
        worst: float | None = None,
        severity: Severity | None = None,
    ) -> "Finding":
        """A finding at these indices; without a `count`, of the first of them, or of one thing."""
        places = vertices, faces, frames
        return cls(
            code,
            severity or SEVERITY_OF[code],
            count or next((len(result) for result in places if len(result)), 1),
            Where(*(np.asarray(result, np.int64)[:MOST_PLACES] for result in places)),
            message,
            advice,
            worst,
        )


class Places:
    """Counts vertices in frames, and keeps which ones they are.

    Attributes:
        count: how many there were, over all frames.
        frames: in which there were any.
    """

    def __init__(self, n_vertices: int) -> None:
        self.count = 0
        self.frames: list[int] = []
        self._met = np.zeros(n_vertices, np.bool_)

    def add(self, number: int, mask: Mask) -> None:
        """Adds those of a frame."""
        if n := int(np.count_nonzero(mask)):
            self.count += n
            self.frames.append(number)
            self._met |= mask

    @property
    def vertices(self) -> Indices:
        """Those that were met in any frame."""
        return np.flatnonzero(self._met)

    @property
    def places(self) -> dict[str, Any]:
        """Where and how many they are, as keywords of a finding."""
        return {"vertices": self.vertices, "frames": self.frames, "count": self.count}

    def told(self, header: Header) -> str:
        """Lists the first of them, such as "in frames 3 and 4: vertices 3, 7 and 12 others"."""
        return f"in {frames_listed(self.frames, header)}: {listed('vertex', self.vertices)}"


def listed(what: str, places: Sequence[int] | Indices) -> str:
    """Lists the first few indices, such as "vertices 3, 7 and 12 others"."""
    shown = [str(int(place)) for place in places[:_MOST_SHOWN]]
    return _joined(what, shown, len(places), len(places) - len(shown))


def stretches(frames: Sequence[int] | Indices) -> list[Indices]:
    """Splits ascending numbers into runs of consecutive numbers."""
    numbers = np.asarray(frames, np.int64)
    return np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)


def frames_listed(frames: Sequence[int] | Indices, header: Header) -> str:
    """Lists the first few frames and joins consecutive ones: "frames 3, 7 to 9 and 12 others"."""
    few = stretches(frames)[:_MOST_SHOWN]
    shown: list[str] = []
    for stretch in few:
        numbers = [header.number(int(frame)) for frame in stretch]
        shown += [f"{numbers[0]} to {numbers[-1]}"] if len(numbers) > 2 else map(str, numbers)
    return _joined("frame", shown, len(frames), len(frames) - sum(len(s) for s in few))


def percent(share: float) -> str:
    """Formats a share; never shows 0 % or 100 % for a share that is not exactly that."""
    if 0 < share < 0.0005:
        return "less than 0.1 %"
    if 0.9995 < share < 1:
        return "more than 99.9 %"
    return f"{100 * share:.3g} %"


def _joined(what: str, shown: list[str], count: int, others: int) -> str:
    noun = counted(count, what).partition(" ")[2]
    if others > 0:
        return f"{noun} {', '.join(shown)} and {counted(others, 'other')}"
    return f"{noun} {joined(shown)}"


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

    def __repr__(self) -> str:
        return f"Diagnosis({', '.join(f.code for f in self.findings) or 'no findings'})"

    def __str__(self) -> str:
        messages = [f"{f.severity}: {f.message}\n  {f.advice}" for f in self.findings]
        return "\n".join([self.summary, *messages])

    @property
    def summary(self) -> str:
        """How many problems there are, such as "1 error, 2 warnings"."""
        counts = [(self.count(severity), severity) for severity in SEVERITIES]
        messages = [f"{n} {severity}{'s' if n > 1 else ''}" for n, severity in counts if n]
        return ", ".join(messages) or "No problems were found."

    @property
    def severity(self) -> Severity | None:
        """The severity of the most important finding; None if there are none."""
        return self.findings[0].severity if self.findings else None

    def count(self, severity: Severity) -> int:
        """Returns the number of findings of this severity."""
        return sum(finding.severity == severity for finding in self.findings)

    def as_dict(self) -> dict[str, Any]:
        """Returns dicts, lists, strings, numbers and None, as JSON has them."""
        header, topology, shares = self.header, self.topology, self.known_share[1:]
        motion = self.motion[np.isfinite(self.motion)]
        return {
            "schema": "dynmesh-diagnosis",
            "version": 1,
            "severity": self.severity,
            "counts": {severity: self.count(severity) for severity in SEVERITIES},
            "findings": [_finding_as_dict(one, header) for one in self.findings],
            "sequence": {
                "frames": header.n_frames,
                "vertices": header.n_vertices,
                "dtype": str(header.dtype),
                "likely_up": self.likely_up,
                **{name: as_json(getattr(header, name)) for name in _STATED},
            },
            "mesh": {
                "components": topology and topology.components,
                "isolated_vertices": topology and topology.isolated_vertices,
                "boundary_edges": topology and topology.boundary_edges,
                "closed": topology and topology.boundary_edges == 0,
                "refused_faces": topology and len(topology.refused_faces),
                "triangles": len(header.faces),
                "polygons": None if header.polygons is None else len(header.polygons.sizes),
                "diagonal": self.diagonal,
                "mean_edge": self.mean_edge,
            },
            "known_share": {
                "mean": float(shares.mean()) if len(shares) else None,
                "least": float(shares.min()) if len(shares) else None,
                "most": float(shares.max()) if len(shares) else None,
            },
            "motion": {
                "median": float(np.median(motion)) if len(motion) else None,
                "most": float(motion.max()) if len(motion) else None,
            },
        }


def _finding_as_dict(finding: Finding, header: Header) -> dict[str, Any]:
    described: dict[str, Any] = as_json(finding)
    described["where"]["frames"] = [header.number(int(frame)) for frame in finding.where.frames]
    return described
