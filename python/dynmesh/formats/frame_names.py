"""The names of the files of frames: a pattern with a number, and which numbers are missing."""

import re
import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

Number = int | float
"""That of a frame: an integer wherever it is whole, so that large ones stay exact."""

_conversion = re.compile(r"%(?:(?:0[0-9]+)?d|(?:0[0-9]+)?\.[0-9]+f|g)")
_hashes = re.compile("##+")
WILDCARDS = {"*": ".*", "?": "."}
DECIMAL = r"[0-9]+(?:\.[0-9]+)?"

_MOST = 1_000_000
"""Frames that may be missing; more mean that the numbers count something else."""


@dataclass(frozen=True)
class FrameNames:
    """The file names of a sequence.

    Attributes:
        folder: the folder of the files.
        pattern: a name with ``%d`` or ``%04d`` for the number of the frame, ``%.2f`` or ``%07.2f``
            for one with so many decimals, or ``%g`` for one with as many as it has; or a plain name
            for a sequence of one frame. Where it is only read, ``*`` and ``?`` stand for anything.
    """

    folder: Path
    pattern: str

    @property
    def numbered(self) -> bool:
        """Whether the pattern contains exactly one number."""
        return self.pattern.count("%") == 1 and _conversion.search(self.pattern) is not None

    @classmethod
    def of(cls, path: Path) -> "FrameNames":
        """The names that a path stands for, in which ``####`` is the number, as ``%04d``."""
        return cls(path.parent, path.name if path.exists() else with_conversion(path.name))

    def name(self, number: Number) -> str:
        """Returns the file name of this frame."""
        return _conversion.sub(lambda place: text_of(place[0], number), self.pattern)

    def existing(self) -> dict[Number, Path]:
        """Returns the existing files by ascending number."""
        if not self.numbered:
            file = self.folder / self.pattern
            return {0: file} if file.exists() else {}
        # The folder may not exist.
        numbers = [(self.number(file.name), file) for file in self.folder.glob("*")]
        return by_number([(number, file) for number, file in numbers if number is not None])

    def number(self, name: str) -> Number | None:
        """Returns the number of the frame with this file name; None if no frame has it."""
        if not self.numbered:
            return 0 if name == self.pattern else None
        begin, end = (
            "".join(WILDCARDS.get(sign) or re.escape(sign) for sign in text)
            for text in _conversion.split(self.pattern)
        )
        match = re.fullmatch(f"{begin}([+-]?{DECIMAL}){end}", name)
        if match is None:
            return None
        number, conversion = number_of(match[1]), _conversion.findall(self.pattern)[0]
        is_own = conversion == "%g" or text_of(conversion, number) == match[1]
        return number if is_own else None


def number_of(text: str) -> Number:
    """Reads a number."""
    return int(text) if "." not in text else as_whole(float(text))


def as_whole(number: float) -> Number:
    """Returns an integer if the number is whole."""
    return int(number) if number.is_integer() else number


def text_of(conversion: str, number: Number) -> str:
    """Writes a number, in ``%g`` with all its decimals."""
    if conversion != "%g":
        return conversion % number
    return str(number) if isinstance(number, int) else np.format_float_positional(number, trim="-")


def by_number(numbered: Iterable[tuple[Number, Path]]) -> dict[Number, Path]:
    """Returns files by ascending number, of which no two may be the same."""
    ordered = sorted(numbered, key=lambda pair: (pair[0], str(pair[1])))
    for (number, file), (other, second) in pairwise(ordered):
        if number == other:
            message = f"{file.name} and {second.name} have the same number; move one elsewhere"
            raise ValueError(message)
    return dict(ordered)


def usual_distance(numbers: Sequence[Number]) -> Number | None:
    """Returns that between ascending numbers; None of one."""
    steps = [after - before for before, after in pairwise(numbers)]
    return statistics.median_low(steps) if steps else None


def with_missing(numbers: Sequence[Number]) -> Iterator[Number]:
    """Yields ascending numbers and, where their distance is not the usual one, those between.

    Raises:
        ValueError: there are too many.
    """
    usual = usual_distance(numbers) or 1
    yield from numbers[:1]
    left = _MOST
    for before, after in pairwise(numbers):
        distance = after - before
        n = round(distance / usual) if distance > 1.5 * usual else 1
        for i in range(1, min(n, left)):
            yield as_whole(before + distance * i / n)
        left -= n - 1
        if left <= 0:
            raise ValueError(
                f"more than {_MOST} frames would be missing, as its frames are usually {usual:g} "
                f"apart, and {before:.15g} and {after:.15g} are {distance:g}"
            )
        yield after


def first_missing(numbers: Sequence[Number]) -> Number | None:
    """Returns the first number that is missing between others; None if there is none."""
    pairs = zip(with_missing(numbers), numbers, strict=False)
    return next((every for every, number in pairs if every != number), None)


def with_conversion(name: str) -> str:
    """Returns the pattern with ``%04d`` for ``####``, as animation programs write it."""
    result = _hashes.findall(name)
    return (
        _hashes.sub(f"%0{len(result[0])}d", name) if len(result) == 1 and "%" not in name else name
    )
