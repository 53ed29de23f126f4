"""Which axis is up and how long a unit is, in the comments of files that have no field for it.

A line is `up_axis z` or `metres_per_unit 0.01`. Any other is a comment of somebody else.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

from .header import Header


class Said(NamedTuple):
    """What comments say, under the names of a header; None where they do not."""

    up_axis: str | None = None
    metres_per_unit: float | None = None

    def agrees_with(self, header: Header) -> bool:
        """Whether it says nothing else than the header."""
        return self.up_axis in (None, header.up_axis) and self.metres_per_unit in (
            None,
            header.metres_per_unit,
        )


def comments_of(header: Header) -> list[str]:
    """The lines that say it."""
    said = Said(header.up_axis, header.metres_per_unit)
    return [f"{name} {value}" for name, value in said._asdict().items() if value is not None]


def said_in(comments: Iterable[str]) -> Said:
    """What these lines say."""
    said = Said()
    for comment in comments:
        match comment.split():
            case ["up_axis", "y" | "z" as axis]:
                said = said._replace(up_axis=axis)
            case ["metres_per_unit", word] if (length := _length(word)) is not None:
                said = said._replace(metres_per_unit=length)
    return said


def _length(word: str) -> float | None:
    try:
        length = float(word)
    except ValueError:
        return None
    return length if 0 < length < math.inf else None
