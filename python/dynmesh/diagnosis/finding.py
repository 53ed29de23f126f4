"""Findings, of which a diagnosis consists."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .._report import counted
from .._report import listed as joined
from ..files import Header

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
        counts = [len(found) for found in places if len(found)]
        return cls(
            code,
            severity or SEVERITY_OF[code],
            [*counts, 1][0] if count is None else count,
            Where(*(np.asarray(found, np.int64)[:MOST_PLACES] for found in places)),
            message,
            advice,
            worst,
        )


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
