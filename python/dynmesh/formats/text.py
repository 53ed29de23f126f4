"""Text with numbers, as dynmesh reads it in every file: marks, line ends, comments and numbers."""

import re
from pathlib import Path

from .._core import parse_number
from .._errors import InputError

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
