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


_TOUCHING = (
    "Motion propagates across them and pulls together sheets that may only touch, and method "
    "detail has no well-defined shape there. Separate the sheets, or delete the inner faces."
)

KINDS = {
    "known_not_finite": Kind(
        "error", "position", "marked as known but not finite, or beyond {limit}",
        "The sequence cannot be completed: such a frame is refused. Mark them as missing in the "
        "known mask, or write them as NaN in a file without masks.",
    ),
    "no_faces": Kind(
        "error", "vertex", "and no faces",
        "The sequence cannot be completed: motion propagates along edges. Give a mesh with faces "
        "if the file holds only positions.",
    ),
    "first_frame_incomplete": Kind(
        "warning", "vertex", "of {all} missing",
        "{start} Frames before it are completed backwards. A complete mesh from a template or a "
        "scan at rest may be a better start.",
    ),
    "scrambled_frames": Kind(
        "warning", "frame",
        "with scrambled vertices: up to {share} of the edges are much too long",
        "The vertices do not correspond to those of the first frame, or the unit changes. dynmesh "
        "completes tracked meshes: number the vertices alike in all frames.",
    ),
    "zeros": Kind(
        "warning", "position", "of exactly (0, 0, 0), {share} of all",
        "The sensor probably wrote zeros where it observed nothing. Taken as positions, they pull "
        "the mesh towards the origin. If so, say it: `missing` zero.",
    ),
    "leaps": Kind(
        "warning", "frame", "with a jump of up to {worst} diagonals, where {typical} is typical",
        "This is a cut, a gap in the recording, or a misplaced frame (two jumps, there and back). "
        "Estimates are inaccurate after a jump: start a new sequence at a cut, and remove "
        "misplaced frames.",
    ),
    "outliers": Kind(
        "warning", "outlier", "that edges longer than around tear off, by {worst} mean edges",
        "They displace the vertices that are estimated around them. Let completion reject "
        "outliers, or mark them as missing in the known mask.",
    ),
    "held": Kind(
        "warning", "position",
        "held: the same bit for bit as in the frame before, while the surface beside moved",
        "The sensor probably repeats the last position of what it has lost. Let completion reject "
        "outliers, or mark them as missing in the known mask.",
    ),
    "frames_without_anchors": Kind(
        "warning", "frame", "without any known vertex, at most {worst} in a row",
        "The mesh stands still in these frames and jumps afterwards. A frame without known "
        "vertices cannot be completed from the past; if later frames may be used, interpolate "
        "instead.",
    ),
    "never_seen": Kind(
        "warning", "vertex", "in patches, {share} of all, never known after frame {first}",
        "Nothing corrects their estimates, in which errors accumulate. Training frames, or "
        "completion from both sides, may help.",
    ),
    "coincident_vertices": Kind(
        "warning", "vertex", "at exactly the position of another vertex in the first frame",
        "The surface is probably cut there, for example along texture seams. The two sides are "
        "completed separately and may open. Merge them first (merge by distance).",
    ),
    "first_vertex_unused": Kind(
        "warning", "vertex", "in no face, and it is the first",
        "The faces may count vertices from 1, and then refer to the wrong ones: subtract 1.",
    ),
    "non_manifold_edges": Kind("warning", "triangle", "at edges with two others", _TOUCHING),
    "non_manifold_vertices": Kind(
        "warning", "triangle", "at vertices where sheets touch in a single point", _TOUCHING
    ),
    "degenerate_faces": Kind(
        "warning", "triangle", "with a repeated vertex",
        "They are ignored, but their edges still count. Delete them.",
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
