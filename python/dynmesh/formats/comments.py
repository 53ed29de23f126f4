"""The comments in which files state what a header says of the positions."""

import contextlib
import math
from collections.abc import Iterable
from typing import Any, NamedTuple

from ..header import Header, StandardErrorOf


class Metadata(NamedTuple):
    """The content of the comments, named like the fields of a header."""

    up_axis: str | None = None
    metres_per_unit: float | None = None
    standard_error_of: StandardErrorOf = "position"


def comments_of(header: Header, *, errors: bool = True) -> list[str]:
    """Returns the comment lines for a header, without what standard errors are of if unwanted."""
    metadata: dict[str, Any] = Metadata(header.up_axis, header.metres_per_unit)._asdict()
    if not (errors and header.has_standard_error):
        metadata["standard_error_of"] = None
    else:
        metadata["standard_error_of"] = header.standard_error_of
    return [f"{name} {value}" for name, value in metadata.items() if value is not None]


def metadata_in(comments: Iterable[str]) -> Metadata:
    """Parses comment lines, such as `up_axis z` or `metres_per_unit 0.01`; others are ignored."""
    metadata = Metadata()
    for comment in comments:
        match comment.split():
            case ["up_axis", "x" | "y" | "z" as axis]:
                metadata = metadata._replace(up_axis=axis)
            case ["metres_per_unit", word]:
                with contextlib.suppress(ValueError):
                    if 0 < (length := float(word)) < math.inf:
                        metadata = metadata._replace(metres_per_unit=length)
            case ["standard_error_of", "position" | "surface" as errors]:
                metadata = metadata._replace(standard_error_of=errors)
    return metadata
