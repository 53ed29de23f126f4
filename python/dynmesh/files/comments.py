"""What files say of a sequence in comments, as they have no field for it.

A line is `up_axis z`, `metres_per_unit 0.01` or `standard_error_of surface`. All other comments are
ignored.
"""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

from ..sequence import StandardErrorOf
from .header import Header


class Metadata(NamedTuple):
    """The content of the comments, named like the fields of a header."""

    up_axis: str | None = None
    metres_per_unit: float | None = None
    standard_error_of: StandardErrorOf = "position"


def comments_of(header: Header) -> list[str]:
    """Returns the comment lines for a header."""
    metadata: dict[str, Any] = Metadata(header.up_axis, header.metres_per_unit)._asdict()
    metadata["standard_error_of"] = header.standard_error_of if header.has_standard_error else None
    return [f"{name} {value}" for name, value in metadata.items() if value is not None]


def metadata_in(comments: Iterable[str]) -> Metadata:
    """Parses comment lines."""
    metadata = Metadata()
    for comment in comments:
        match comment.split():
            case ["up_axis", "x" | "y" | "z" as axis]:
                metadata = metadata._replace(up_axis=axis)
            case ["metres_per_unit", word] if (length := _length(word)) is not None:
                metadata = metadata._replace(metres_per_unit=length)
            case ["standard_error_of", "position" | "surface" as errors]:
                metadata = metadata._replace(standard_error_of=errors)
    return metadata


def _length(word: str) -> float | None:
    try:
        length = float(word)
    except ValueError:
        return None
    return length if 0 < length < math.inf else None
