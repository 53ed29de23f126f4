"""The names of files with one frame each: their natural order, and patterns with a number.

Numbers in names count as numbers, from left to right, so that dates, times, seconds and nanoseconds
are in order. A hyphen after a letter or a digit separates; any other one before a number is its
sign. Upper and lower case are the same.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from .._errors import InputError

Number = int | float
"""That of a frame: an integer wherever it is whole, so that large ones stay exact."""

_conversion = re.compile(r"%(?:(?:0[0-9]+)?d|(?:0[0-9]+)?\.[0-9]+f|g)")
WILDCARDS = {"*": ".*", "?": "."}

_SIGN = r"(?:(?<![^\W_])(?:\+|-(?=[0-9.]*[1-9])))?"
"""No number is -0."""
_WHOLE = re.compile(rf"({_SIGN}[0-9]+)")
_DECIMAL = re.compile(rf"({_SIGN}[0-9]+(?:\.[0-9]+)?)")
_FRACTION = re.compile(r"(?<=[0-9])\.([0-9]+)")
_COUNTED = re.compile(r"[0-9]\.(?:[0-9]+0(?![0-9])|[0-9]+\.[0-9])")
"""What follows a point is no fraction if it ends in 0, as in 1.10, or a third number follows."""

_CLOCK = re.compile(
    r"(?:19|20)[0-9]{2}(\D?)[0-9]{2}\1[0-9]{2}\D?[0-9]{2}(\D?)[0-9]{2}\2[0-9]{2}"
    r"(?:\D[0-9]{3}(?:[0-9]{3})?(?![0-9]))?"
)
"""A date and a time of day, which skip numbers where no frame is missing."""


def numbers_in(
    files: Sequence[Path], stems: Sequence[str] | None = None
) -> tuple[list[Number], str | None]:
    """Finds the number of each frame: the one that differs in the names.

    If several differ, or a date and a time of day, or decimals that float64 cannot tell apart,
    frames are counted from 0. A decimal is one number instead of two if nothing else is in the
    names, or if decimals differ in length.

    Args:
        files: those of the frames.
        stems: the parts of their names that are compared, if these are not all but the suffixes.

    Returns:
        A number for each file, and the pattern of the names; None if the frames are counted.
    """
    if stems is None:
        is_one_folder = len({file.parent for file in files}) == 1
        stems = [f.stem if is_one_folder else f.with_suffix("").as_posix() for f in files]
    kind, keys = _keys_of(files, stems)
    columns = [*zip(*(key[1::2] for key in keys), strict=False)]
    differing = [at for at, column in enumerate(columns) if len({*column}) > 1]
    rests = {_CLOCK.sub("", stem) for stem in stems}
    is_by_clock = differing and len(rests) == 1 and rests != {*stems}
    at = differing[0] if differing else len(columns) - 1
    numbers = [number_of(str(number)) for number in columns[at]] if columns else []
    is_close = len({*numbers}) < len({*keys})
    if not columns or len(differing) > 1 or is_by_clock or is_close:
        ranks = {key: rank for rank, key in enumerate(sorted({*keys}))}
        return [ranks[key] for key in keys], None
    parts = [kind.split(stem) for stem in stems]
    parts[0][2 * at + 1] = _conversion_of([part[2 * at + 1] for part in parts])
    return numbers, "".join(parts[0]) + files[0].suffix


def _keys_of(files: Sequence[Path], stems: Sequence[str]) -> tuple[re.Pattern[str], list[Any]]:
    """Returns what a number is, and what names are ordered by: texts and numbers, by turns."""
    whole, decimal = ([_key(stem, kind) for stem in stems] for kind in (_WHOLE, _DECIMAL))
    lengths = {len(fraction) for stem in stems for fraction in _FRACTION.findall(stem)}
    is_varied = len(lengths) > 1
    if is_varied and any(map(_COUNTED.search, stems)):
        is_varied, decimal = False, whole
    kinds = Counter(key[::2] for key in whole)
    of_decimals = {key[::2] for key in decimal}
    if of_decimals == {("", "")} or len(of_decimals) == 1 < len(kinds):
        return _DECIMAL, decimal
    if len(kinds) > 1 and any(map(_WHOLE.search, stems)):
        counts = [("*".join(map(str, kind)), n) for kind, n in kinds.most_common(3)]
        listed = " and ".join(f"'{name}{files[0].suffix}' ({n})" for name, n in counts)
        bare = [file.name for file, key in zip(files, whole, strict=True) if len(key) == 1]
        what = f"{bare[0]} has no number of a frame" if bare else "holds several sequences"
        raise InputError(f"{what}, {listed}; name one by a pattern")
    orders = [sorted(range(len(keys)), key=keys.__getitem__) for keys in (whole, decimal)]
    for pair in zip(*orders, strict=True):
        if len({*pair}) > 1:
            names = " and ".join(files[at].name for at in pair)
            raise InputError(
                f"{names} are in one order if their numbers are decimals, and in another if they "
                "are not; give a pattern, such as t%g.obj for decimals"
            )
    return (_DECIMAL, decimal) if is_varied else (_WHOLE, whole)


def _key(stem: str, kind: re.Pattern[str]) -> tuple[str | int | Decimal, ...]:
    parts = enumerate(kind.split(stem))
    return tuple(_exactly(part) if at % 2 else part.casefold() for at, part in parts)


def by_number(numbered: Iterable[tuple[Number, Path]]) -> dict[Number, Path]:
    """Returns files by ascending number, of which no two may be the same."""
    ordered = sorted(numbered, key=lambda pair: (pair[0], str(pair[1])))
    for (number, file), (other, second) in pairwise(ordered):
        if number == other:
            message = f"{file.name} and {second.name} have the same number; move one elsewhere"
            raise InputError(message)
    return dict(ordered)


@dataclass(frozen=True)
class FrameNames:
    """The file names of a sequence.

    Attributes:
        folder: the folder of the files.
        pattern: a name with ``%d`` or ``%04d`` for the number of the frame, ``%.2f`` or ``%07.2f``
            for one with so many decimals, or ``%g`` for one with as many as it has; or a plain name
            for a sequence of one frame. Where it is only read, ``*`` and ``?`` stand for anything.
        kept: names that replace those of the pattern where the files belong, in this order.
    """

    folder: Path
    pattern: str
    kept: tuple[str, ...] = ()

    @property
    def numbered(self) -> bool:
        """Whether the pattern contains exactly one number."""
        return self.pattern.count("%") == 1 and _conversion.search(self.pattern) is not None

    @classmethod
    def of(cls, path: Path) -> "FrameNames":
        """The names that a path stands for, in which ``####`` is the number, as ``%04d``."""
        name, hashes = path.name, re.findall("##+", path.name)
        if len(hashes) == 1 and "%" not in name and not path.exists():
            name = name.replace(hashes[0], f"%0{len(hashes[0])}d")
        return cls(path.parent, name)

    def name(self, number: Number) -> str:
        """Returns the file name of this frame."""
        return _conversion.sub(lambda place: _text_of(place[0], number), self.pattern)

    def existing(self) -> dict[Number, Path]:
        """Returns the existing files by ascending number."""
        if not self.numbered:
            file = self.folder / self.pattern
            return {0: file} if file.exists() else {}
        if self.kept:
            files = enumerate(self.folder / name for name in self.kept)
            return {number: file for number, file in files if file.exists()}
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
        match = re.fullmatch(rf"{begin}([+-]?[0-9]+(?:\.[0-9]+)?){end}", name)
        if match is None:
            return None
        conversion = _conversion.findall(self.pattern)[0]
        is_own = conversion == "%g" or _text_of(conversion, _exactly(match[1])) == match[1]
        return number_of(match[1]) if is_own else None


def number_of(text: str) -> Number:
    """Reads a number."""
    return int(text) if "." not in text else as_whole(float(text))


def _exactly(text: str) -> int | Decimal:
    """Reads a number that float64 may round, such as seconds with nanoseconds since 1970."""
    return int(text) if "." not in text else Decimal(text)


def as_whole(number: float) -> Number:
    """Returns an integer if the number is whole."""
    return int(number) if number.is_integer() else number


def _text_of(conversion: str, number: Number | Decimal) -> str:
    """Writes a number, in ``%g`` with all its decimals."""
    if conversion != "%g":
        return format(int(number) if conversion.endswith("d") else number, conversion[1:])
    return (
        str(number)
        if isinstance(number, int)
        else np.format_float_positional(float(number), trim="-")
    )


def _conversion_of(texts: Sequence[str]) -> str:
    """Returns how numbers are written: with as many decimals, and as long as the shortest."""
    decimals = {len(text.partition(".")[2]) for text in texts}
    width = min(map(len, texts))
    if len(decimals) > 1:
        return "%g"
    padded = f"0{width}" if width > 1 else ""
    return f"%{padded}.{decimals.pop()}f" if decimals != {0} else f"%{padded}d"
