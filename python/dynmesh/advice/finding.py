"""What may be found in a sequence, with the effect on completion and what to do."""

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._report import as_json, counted, few, few_frames
from ..header import Header

Severity = Literal["error", "warning"]
"""error: the sequence cannot be completed. warning: the result is less accurate, or the data is
faulty."""

MOST_PLACES = 10_000
"""At most this many vertices, faces and frames are listed in a finding, the first ones."""


class Kind(NamedTuple):
    """A kind of finding: how much it matters, what is counted, what is said of these, advice."""

    severity: Severity
    noun: str
    text: str
    advice: str


KINDS = {
    "known_not_finite": Kind(
        "error", "position", "marked as known but not finite, or beyond {limit}",
        "Completion refuses such a frame.",
    ),
    "no_faces": Kind(
        "error", "vertex", "and no faces", "Completion needs them: motion propagates along edges.",
    ),
    "first_frame_incomplete": Kind(
        "warning", "vertex", "of {all} missing",
        "{start} Frames before it are completed backwards.",
    ),
    "scrambled_frames": Kind(
        "warning", "frame",
        "with scrambled vertices: up to {share} of the edges are much too long",
        "Completion needs vertices that are numbered alike in all frames.",
    ),
    "zeros": Kind(
        "warning", "position", "of exactly (0, 0, 0), {share} of all",
        "As positions, they pull the mesh there; `missing` zero leaves them out.",
    ),
    "leaps": Kind(
        "warning", "frame", "with a jump of up to {worst} diagonals, where {typical} is typical",
        "Estimates are inaccurate after a jump.",
    ),
    "outliers": Kind(
        "warning", "outlier", "that edges longer than around tear off, by {worst} mean edges",
        "They displace the vertices around them; completion can reject outliers.",
    ),
    "held": Kind(
        "warning", "position",
        "held: the same bit for bit as in the frame before, while the surface beside moved",
        "They hold back the vertices around them; completion can reject outliers.",
    ),
    "frames_without_anchors": Kind(
        "warning", "frame", "without any known vertex, at most {worst} in a row",
        "The mesh stands still in these frames and jumps afterwards.",
    ),
    "never_seen": Kind(
        "warning", "vertex", "in patches, {share} of all, never known after frame {first}",
        "Nothing corrects their estimates, in which errors accumulate.",
    ),
    "coincident_vertices": Kind(
        "warning", "vertex", "at exactly the position of another vertex in the first frame",
        "No edge joins the sides of a cut there, which are completed separately and may open.",
    ),
    "first_vertex_unused": Kind(
        "warning", "vertex", "in no face, and it is the first",
        "Faces that count vertices from 1 refer to the wrong ones.",
    ),
    "non_manifold_edges": Kind(
        "warning", "triangle", "at edges with two others", "Motion propagates across them.",
    ),
    "non_manifold_vertices": Kind(
        "warning", "triangle", "at vertices where sheets touch in a single point",
        "Motion propagates across them.",
    ),
    "degenerate_faces": Kind(
        "warning", "triangle", "with a repeated vertex", "Only their edges count.",
    ),
}  # fmt: skip
"""By the codes, the most important first."""


@dataclass(frozen=True, eq=False)
class Where:
    """The vertices, faces and frames of a finding, ascending, at most `MOST_PLACES` of each.

    Attributes:
        vertices: int64
        faces: int64, rows of the sequence's triangles.
        frames: int64, counted from 0; messages and JSON have their numbers in the file.
    """

    vertices: NDArray[np.int64]
    faces: NDArray[np.int64]
    frames: NDArray[np.int64]


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
        worst: the worst value, in the unit that docs/diagnosis.md lists for this code, or None.
    """

    code: str
    severity: Severity
    count: int
    where: Where
    message: str
    advice: str
    worst: float | None = None

    def as_dict(self, header: Header) -> dict[str, Any]:
        """Returns what JSON has."""
        described: dict[str, Any] = as_json(self)
        described["where"]["frames"] = [header.number(int(frame)) for frame in self.where.frames]
        return described


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
    kind, places = KINDS[code], [np.asarray(one, np.int64) for one in (vertices, faces, frames)]
    count = count or next(len(one) for one in places if len(one))
    words = {"worst": None if worst is None else f"{worst:.3g}", **words}
    message = f"{counted(count, kind.noun)} {kind.text.format(**words)}"
    message += f", in {few_frames(places[2], header)}" if len(places[2]) else ""
    named = [few(what, one) for what, one in (("vertex", vertices), ("face", faces)) if len(one)]
    return Finding(
        code,
        severity or kind.severity,
        count,
        Where(*(one[:MOST_PLACES] for one in places)),
        ": ".join([message, *named]) + ".",
        kind.advice.format(**words),
        worst,
    )
