"""The numbers of frames in the names of files: one rule for folders, globs and patterns.

A number is digits with their sign and their decimals. In a folder or a glob, it stands where the
names differ. A hyphen after a letter or a digit is no sign, unless another name has none there; nor
is one before 0. After a letter, it could be either if no number is 0 or begins with zeros, and one
is below 2.

A pattern decides where the number stands and how it is written.

Names that differ by a date and a time of day are in the order of these, and frames count from 0.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .frame_names import (
    DECIMAL,
    Number,
    as_whole,
    first_missing,
    number_of,
    text_of,
    usual_distance,
)

_DIGITS = "[0-9]+"

_SIGNS = (r"(?:(?<![^\W_])[+-](?=[0-9.]*[1-9]))?", "", "[+-]?")
"""What is a sign: no hyphen after a letter or a digit or before 0; none; each. The first of these
for which the names are alike."""

_TIME = re.compile(
    r"(?<![0-9])([0-9]{4})([-_.]?)([0-9]{2})\2([0-9]{2})[-_.T ]?"
    r"([0-9]{2})([-_.:]?)([0-9]{2})\6([0-9]{2})(?:[-_.,]([0-9]{3}|[0-9]{6}))?(?![0-9])"
)
"""A date and a time of day, with or without milliseconds or microseconds."""


class NumberPlace(NamedTuple):
    """A number in names that are otherwise alike: what is before and after it, and its texts."""

    before: str
    after: str
    texts: tuple[str, ...]

    @property
    def numbers(self) -> list[Number]:
        """Those of the texts."""
        return [number_of(text) for text in self.texts]

    @property
    def conversion(self) -> str:
        """As long as the shortest text."""
        width = min(map(len, self.texts))
        decimals = {len(text.partition(".")[2]) for text in self.texts}
        is_padded = any(re.match("[+-]?0[0-9]", text) for text in self.texts)
        padded = f"0{width}" if width > 1 and (is_padded or decimals == {0}) else ""
        if decimals == {0}:
            return f"%{padded}d"
        return f"%{padded}.{decimals.pop()}f" if len(decimals) == 1 else "%g"

    @property
    def with_sign(self) -> "NumberPlace | None":
        """The same with the hyphen before it as a sign, if it could be one; else None.

        Negative frames lead up to frame 0, so that frames 1001 and 1002 are no frames -1002 and
        -1001.
        """
        is_hyphen = re.search(r"[^\W\d_]-$", self.before) and "/" not in self.after
        is_plain = all(re.match(r"[1-9]|0\.", text) for text in self.texts)
        if not is_hyphen or not is_plain or not 0 < min(self.numbers) < 2:
            return None
        return NumberPlace(self.before[:-1], self.after, tuple(f"-{text}" for text in self.texts))

    @property
    def pattern(self) -> str:
        """The pattern of the names."""
        return self.before + self.conversion + self.after

    @property
    def is_written(self) -> bool:
        """Whether one way to write numbers gives these texts."""
        if self.conversion == "%g":  # 1.10 beside 1.9 is a version
            return not any(re.search(r"\.[0-9]+0$", text) for text in self.texts)
        return [text_of(self.conversion, number) for number in self.numbers] == [*self.texts]

    @property
    def order(self) -> list[int]:
        """The indices of the texts, by their numbers."""
        return sorted(range(len(self.texts)), key=self.numbers.__getitem__)


def _places(stems: Sequence[str], number: str) -> list[NumberPlace] | None:
    """Returns the numbers in which names differ; None if they also differ otherwise.

    It is the last number if they differ in none.
    """
    for sign in _SIGNS:
        parts = [re.split(f"({sign}{number})", stem) for stem in stems]
        if len({tuple(part[::2]) for part in parts}) == 1:
            break
    else:
        return None
    columns = list(zip(*parts, strict=True))
    common = [column[0] if len(set(column)) == 1 else "*" for column in columns]
    every = range(1, len(columns), 2)
    varying = [at for at in every if common[at] == "*"] or [*every][-1:]
    return [
        NumberPlace("".join(common[:at]), "".join(common[at + 1 :]), columns[at]) for at in varying
    ]


def place_in(files: Sequence[Path], stems: Sequence[str]) -> NumberPlace | None:
    """Finds the number of the frame in the names of files, given without their suffixes.

    Returns:
        None if the names have no number at the same place, or differ by their times.

    Raises:
        ValueError: it could be one of several; the message has the pattern that chooses each.
    """
    if seconds_in(stems):
        return None
    place = _digits_in(files, stems)
    if place is not None and len(stems) > 1 and (signed := place.with_sign) is not None:
        raise _of_several([place, signed], stems, files[0].suffix)
    return place


def seconds_in(stems: Sequence[str]) -> list[Number]:
    """Returns the times by which names differ, in seconds since 1970; none if they differ in more.

    Within a second, the rest may be the number of the frame.
    """
    times = [result for result in map(_TIME.search, stems) if result is not None]
    if len(times) < len(stems) or len({_TIME.sub("", stem, count=1) for stem in stems}) > 1:
        return []
    texts = ["{}-{}-{}T{}:{}:{}".format(*time.group(1, 3, 4, 5, 7, 8)) for time in times]
    if len(set(texts)) < 2:
        return []
    try:
        seconds = np.array(texts, "datetime64[s]").astype(np.int64).tolist()
    except ValueError:  # no dates
        return []
    parts = [float(f"0.{time[9] or 0}") for time in times]
    return [as_whole(second + part) for second, part in zip(seconds, parts, strict=True)]


def _digits_in(files: Sequence[Path], stems: Sequence[str]) -> NumberPlace | None:
    """The same, where a hyphen after a letter is no sign."""
    results = [_places(stems, number) for number in (DECIMAL, _DIGITS)]
    single = [places[0] for places in results if places is not None and len(places) == 1]
    suffix = files[0].suffix
    if not single:
        several = next(filter(None, results), None)
        if several is not None:
            raise _of_several(several, stems, suffix)
        return None
    decimal, digits = single[0], single[-1]
    is_alone = not (decimal.before.rpartition("/")[2] or decimal.after)
    of_shots = len(results[1] or ()) > 1 and not is_alone  # perhaps: take1.0001, take2.0001
    if of_shots and first_missing(sorted(decimal.numbers)) is not None:
        raise _of_several([decimal], stems, suffix)
    if decimal.before == digits.before or not digits.is_written:
        return decimal
    if not decimal.is_written or is_alone:
        return decimal if decimal.is_written else digits
    counts = usual_distance(sorted(digits.numbers)) in (None, 1)
    # That of a shot or a version, which is no 0, comes before the point.
    is_of_shot = decimal.before[-1:].isalpha() and decimal.numbers[0] >= 1
    if counts or (is_of_shot and decimal.order == digits.order):
        return digits
    raise _of_several([decimal, digits], stems, suffix)


def _of_several(places: Iterable[NumberPlace], stems: Sequence[str], suffix: str) -> ValueError:
    """The error for names of which it cannot be told what numbers the frames."""
    ways = [
        f"'{place.pattern}{suffix}' ({', '.join(place.texts[:3])})"
        for place in places
        if len(set(place.numbers)) == len(place.numbers)
    ]
    if len(ways) < 2:
        kinds = kinds_of(stems, suffix, _DIGITS)
        ways.append(f"those of several sequences, {listed_kinds(kinds)}")
    message = "the numbers of the frames could be " + " or ".join(ways)
    return ValueError(f"{message}; give the pattern that is meant")


def kinds_of(stems: Iterable[str], suffix: str, number: str) -> Counter[str]:
    """Returns the names without their last numbers, and how many there are of each."""
    last = f"[+-]?{number}(?=[^0-9]*$)"
    return Counter(re.sub(last, "*", stem) + suffix for stem in stems)


def listed_kinds(kinds: Counter[str]) -> str:
    """Lists the most frequent ones."""
    return " and ".join(f"'{kind}' ({n})" for kind, n in kinds.most_common(3))
