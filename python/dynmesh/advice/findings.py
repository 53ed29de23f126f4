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
"""At most this many vertices and frames are listed in a finding, the first ones."""


class Kind(NamedTuple):
    """A kind of finding: what is counted, what is said of these, and what they do to completion."""

    noun: str
    text: str
    effect: str
    severity: Severity = "warning"


KINDS = {
    "known_not_finite": Kind(
        "position", "marked as known but not finite, or beyond {limit}",
        "Completion refuses such a frame.", "error",
    ),
    "no_faces": Kind(
        "vertex", "and no faces", "Completion needs them: motion propagates along edges.", "error"
    ),
    "nothing_known": Kind(
        "frame", "in which nothing was observed", "There is nothing to begin with.", "error"
    ),
    "zeros": Kind(
        "position", "of exactly (0, 0, 0), {share} of all",
        "As positions, they pull the mesh there; `missing` zero leaves them out.",
    ),
    "long_edges": Kind(
        "position", "most of whose edges are longer than in the first frame by at least 4 mean "
        "edges, at most {longest}",
        "Completion can reject outliers; vertices must be numbered alike in all frames.",
    ),
    "held": Kind(
        "position",
        "held: the same bit for bit as in the frame before, while the surface beside moved",
        "They hold back the vertices around them; completion can reject outliers.",
    ),
    "coincident_vertices": Kind(
        "vertex", "at exactly the position of another vertex in the first frame",
        "No edge joins the sides of a cut there, which are completed separately and may open.",
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
        frames: the same, counted from 0; messages and JSON have their numbers in the file.
        message: what was found, in a sentence.
        advice: the effect on completion, and what to do.
    """

    code: str
    severity: Severity
    count: int
    vertices: Integers
    frames: Integers
    message: str
    advice: str

    def as_dict(self, header: Header) -> dict[str, Any]:
        """Returns what JSON has."""
        described: dict[str, Any] = as_json(self)
        return described | {"frames": [header.number(int(frame)) for frame in self.frames]}


def found(
    code: str,
    header: Header,
    count: int,
    vertices: Any = (),
    frames: Any = (),
    **words: str,
) -> Finding:
    """Makes a finding of so many things at these places. `words` enter its text."""
    kind = KINDS[code]
    message = f"{counted(count, kind.noun)} {kind.text.format(**words)}"
    message += f", in {few_frames(frames, header)}" if len(frames) else ""
    message += f": {few('vertex', vertices)}" if len(vertices) else ""
    return Finding(
        code=code,
        severity=kind.severity,
        count=count,
        vertices=np.asarray(vertices, np.int64)[:MOST_PLACES],
        frames=np.asarray(frames, np.int64)[:MOST_PLACES],
        message=f"{message}.",
        advice=kind.effect,
    )
