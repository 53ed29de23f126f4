"""What can be wrong with a sequence, and how that is said."""

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from .._arrays import Integers
from .._report import as_json, counted, few, few_frames
from ..header import Header

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
    vertices: Integers
    faces: Integers
    frames: Integers
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
