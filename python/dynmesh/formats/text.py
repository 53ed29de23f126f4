"""Text in files: lines, words and numbers, and the comments that state what a header says."""

import contextlib
import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from .._core import parse_number
from .._errors import InputError
from ..header import Header, StandardErrorOf

_comment = re.compile(r"(?:^|(?<=\s))#.*")


def lines_in(file: Path) -> list[str]:
    """Returns the lines of a file, with the line ends of any system."""
    content = file.read_bytes()
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError("line 1: is text in UTF-16; save it in UTF-8")
    text = content.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    return re.split("\r\n|\r|\n", text)


def words_in(line: str) -> list[str]:
    """Returns the words of a line before a comment, which begins with # after white space."""
    return _comment.sub("", line).split()


def number_of(word: str, line: int) -> float:
    """Returns the number that a word is, also NaN or infinity as C libraries write them."""
    number = parse_number(word)
    if number is None:
        raise InputError(f"line {line}: {word[:40]!r} is not a number")
    return number


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
