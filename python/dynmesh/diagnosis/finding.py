"""Findings, of which a diagnosis consists."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Severity = Literal["error", "warning", "note"]
"""error: the sequence cannot be completed. warning: the result is less accurate, or the data is
faulty. note: information."""

SEVERITIES: tuple[Severity, ...] = ("error", "warning", "note")

CODES = (
    "first_frame_incomplete",
    "known_not_finite",
    "no_faces",
    "scrambled_frames",
    "first_frame_zeros",
    "zeros",
    "leaps",
    "outliers",
    "frames_without_anchors",
    "hardly_any_anchors",
    "never_seen",
    "component_disconnected",
    "coincident_vertices",
    "isolated_vertices",
    "far_from_origin",
    "non_manifold_edges",
    "non_manifold_vertices",
    "flat_faces",
    "degenerate_faces",
    "duplicate_faces",
    "flipped_faces",
    "one_sided_surface",
    "few_anchors",
    "repeated_frames",
    "several_components",
    "small_holes",
    "needle_faces",
    "unlikely_unit",
)
"""The codes of all findings, the most important first."""

Indices = NDArray[np.int64]

MOST_PLACES = 10_000
"""At most this many vertices, faces and frames are listed in a finding, the first ones."""

_MOST_SHOWN = 5


def _none() -> Indices:
    return np.empty(0, np.int64)


@dataclass(frozen=True, eq=False)
class Where:
    """The vertices, faces and frames of a finding, ascending, at most `MOST_PLACES` of each.

    Attributes:
        vertices: int64
        faces: int64, rows of the sequence's triangles.
        frames: int64, counted from 0.
    """

    vertices: Indices = field(default_factory=_none)
    faces: Indices = field(default_factory=_none)
    frames: Indices = field(default_factory=_none)

    @classmethod
    def of(cls, *, vertices: Any = (), faces: Any = (), frames: Any = ()) -> "Where":
        """Keeps the first indices of each kind."""
        return cls(*(np.asarray(p, np.int64)[:MOST_PLACES] for p in (vertices, faces, frames)))


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
        worst: the worst value, in the unit that docs/reference/findings.md lists for this code, or
            None.
    """

    code: str
    severity: Severity
    count: int
    where: Where
    message: str
    advice: str
    worst: float | None = None


def counted(count: int, what: str) -> str:
    """Returns a number with its noun, such as "1 vertex" or "2 vertices"."""
    plural = "vertices" if what == "vertex" else f"{what}s"
    return f"{count} {what if count == 1 else plural}"


def listed(what: str, places: Sequence[int] | Indices) -> str:
    """Lists the first few indices, such as "vertices 3, 7 and 12 others"."""
    shown = [str(int(place)) for place in places[:_MOST_SHOWN]]
    return _joined(what, shown, len(places), len(places) - len(shown))


def stretches(frames: Sequence[int] | Indices) -> list[Indices]:
    """Splits ascending numbers into runs of consecutive numbers."""
    numbers = np.asarray(frames, np.int64)
    return np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)


def frames_listed(frames: Sequence[int] | Indices) -> str:
    """Lists the first few frames and joins consecutive ones: "frames 3, 7 to 9 and 12 others"."""
    few = stretches(frames)[:_MOST_SHOWN]
    shown: list[str] = []
    for stretch in few:
        first, last = int(stretch[0]), int(stretch[-1])
        shown += [f"{first} to {last}"] if last - first > 1 else [str(f) for f in stretch]
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
    last = shown[-1]
    return f"{noun} {', '.join(shown[:-1])} and {last}" if len(shown) > 1 else f"{noun} {last}"
