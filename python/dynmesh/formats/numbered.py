"""The numbers of frames in the names of files: one rule for folders, globs and patterns.

A number is digits with their sign and their decimals. In a folder or a glob, it stands where the
names differ. A hyphen after a letter or a digit is no sign, unless another name has none there; nor
is one before 0. After a letter, it could be either if no number is 0 or begins with zeros, and one
is below 2.

A pattern decides where the number stands and how it is written.

Names that differ by a date and a time of day are in the order of these, and frames count from 0.
"""

import errno
import glob
import os
import re
import statistics
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..header import largest_start
from .format import Gaps

Number = int | float
"""That of a frame: an integer wherever it is whole, so that large ones stay exact."""

_conversion = re.compile(r"%(?:(?:0[0-9]+)?d|(?:0[0-9]+)?\.[0-9]+f|g)")
_hashes = re.compile("##+")
_wildcards = {"*": ".*", "?": "."}

_DIGITS = "[0-9]+"
_DECIMAL = r"[0-9]+(?:\.[0-9]+)?"
_SIGNS = (r"(?:(?<![^\W_])[+-](?=[0-9.]*[1-9]))?", "", "[+-]?")
"""What is a sign: no hyphen after a letter or a digit or before 0; none; each. The first of these
for which the names are alike."""

_TIME = re.compile(
    r"(?<![0-9])([0-9]{4})([-_.]?)([0-9]{2})\2([0-9]{2})[-_.T ]?"
    r"([0-9]{2})([-_.:]?)([0-9]{2})\6([0-9]{2})(?:[-_.,]([0-9]{3}|[0-9]{6}))?(?![0-9])"
)
"""A date and a time of day, with or without milliseconds or microseconds."""

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
        return _conversion.sub(lambda found: _text(found[0], number), self.pattern)

    def existing(self) -> dict[Number, Path]:
        """Returns the existing files by ascending number."""
        if not self.numbered:
            file = self.folder / self.pattern
            return {0: file} if file.exists() else {}
        # The folder may not exist.
        numbers = [(self.number(file.name), file) for file in self.folder.glob("*")]
        return by_number([(one, file) for one, file in numbers if one is not None])

    def number(self, name: str) -> Number | None:
        """Returns the number of the frame with this file name; None if no frame has it."""
        if not self.numbered:
            return 0 if name == self.pattern else None
        begin, end = (
            "".join(_wildcards.get(sign) or re.escape(sign) for sign in text)
            for text in _conversion.split(self.pattern)
        )
        match = re.fullmatch(f"{begin}({_SIGNS[-1]}{_DECIMAL}){end}", name)
        if match is None:
            return None
        number, conversion = _number(match[1]), _conversion.findall(self.pattern)[0]
        is_own = conversion == "%g" or _text(conversion, number) == match[1]
        return number if is_own else None


def _number(text: str) -> Number:
    return int(text) if "." not in text else _as_integer(float(text))


def _as_integer(number: float) -> Number:
    return int(number) if number.is_integer() else number


def _text(conversion: str, number: Number) -> str:
    """Writes a number, in ``%g`` with all its decimals."""
    if conversion != "%g":
        return conversion % number
    return str(number) if isinstance(number, int) else np.format_float_positional(number, trim="-")


class _Place(NamedTuple):
    """A number in names that are otherwise alike: what is before and after it, and its texts."""

    before: str
    after: str
    texts: tuple[str, ...]

    @property
    def numbers(self) -> list[Number]:
        return [_number(text) for text in self.texts]

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
    def with_sign(self) -> "_Place | None":
        """The same with the hyphen before it as a sign, if it could be one; else None.

        Negative frames lead up to frame 0, so that frames 1001 and 1002 are no frames -1002 and
        -1001.
        """
        is_hyphen = re.search(r"[^\W\d_]-$", self.before) and "/" not in self.after
        is_plain = all(re.match(r"[1-9]|0\.", text) for text in self.texts)
        if not is_hyphen or not is_plain or not 0 < min(self.numbers) < 2:
            return None
        return _Place(self.before[:-1], self.after, tuple(f"-{text}" for text in self.texts))

    @property
    def pattern(self) -> str:
        """The pattern of the names."""
        return self.before + self.conversion + self.after

    @property
    def is_written(self) -> bool:
        """Whether one way to write numbers gives these texts."""
        if self.conversion == "%g":  # 1.10 beside 1.9 is a version
            return not any(re.search(r"\.[0-9]+0$", text) for text in self.texts)
        return [_text(self.conversion, one) for one in self.numbers] == [*self.texts]

    @property
    def order(self) -> list[int]:
        return sorted(range(len(self.texts)), key=self.numbers.__getitem__)


def _places(stems: Sequence[str], number: str) -> list[_Place] | None:
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
    return [_Place("".join(common[:at]), "".join(common[at + 1 :]), columns[at]) for at in varying]


def _place_in(files: Sequence[Path], stems: Sequence[str]) -> _Place | None:
    """Finds the number of the frame in the names of files, given without their suffixes.

    Returns:
        None if the names have no number at the same place, or differ by their times.

    Raises:
        ValueError: it could be one of several; the message has the pattern that chooses each.
    """
    if _seconds_in(stems):
        return None
    place = _digits_in(files, stems)
    if place is not None and len(stems) > 1 and (signed := place.with_sign) is not None:
        raise _of_several([place, signed], stems, files[0].suffix)
    return place


def _seconds_in(stems: Sequence[str]) -> list[Number]:
    """Returns the times by which names differ, in seconds since 1970; none if they differ in more.

    Within a second, the rest may be the number of the frame.
    """
    times = [result for result in map(_TIME.search, stems) if result is not None]
    if len(times) < len(stems) or len({_TIME.sub("", stem, count=1) for stem in stems}) > 1:
        return []
    texts = ["{}-{}-{}T{}:{}:{}".format(*one.group(1, 3, 4, 5, 7, 8)) for one in times]
    if len(set(texts)) < 2:
        return []
    try:
        seconds = np.array(texts, "datetime64[s]").astype(np.int64).tolist()
    except ValueError:  # no dates
        return []
    parts = [float(f"0.{one[9] or 0}") for one in times]
    return [_as_integer(second + part) for second, part in zip(seconds, parts, strict=True)]


def _digits_in(files: Sequence[Path], stems: Sequence[str]) -> _Place | None:
    """The same, where a hyphen after a letter is no sign."""
    results = [_places(stems, number) for number in (_DECIMAL, _DIGITS)]
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


def _of_several(places: Iterable[_Place], stems: Sequence[str], suffix: str) -> ValueError:
    """The error for names of which it cannot be told what numbers the frames."""
    ways = [
        f"'{place.pattern}{suffix}' ({', '.join(place.texts[:3])})"
        for place in places
        if len(set(place.numbers)) == len(place.numbers)
    ]
    if len(ways) < 2:
        kinds = _kinds(stems, suffix, _DIGITS)
        ways.append(f"those of several sequences, {_told(kinds)}")
    message = "the numbers of the frames could be " + " or ".join(ways)
    return ValueError(f"{message}; give the pattern that is meant")


def _kinds(stems: Iterable[str], suffix: str, number: str) -> Counter[str]:
    """Returns the names without their last numbers, and how many there are of each."""
    last = f"[+-]?{number}(?=[^0-9]*$)"
    return Counter(re.sub(last, "*", stem) + suffix for stem in stems)


def _told(kinds: Counter[str]) -> str:
    return " and ".join(f"'{kind}' ({n})" for kind, n in kinds.most_common(3))


def by_number(numbered: Iterable[tuple[Number, Path]]) -> dict[Number, Path]:
    """Returns files by ascending number, of which no two may be the same."""
    ordered = sorted(numbered, key=lambda one: (one[0], str(one[1])))
    for (one, file), (other, second) in pairwise(ordered):
        if one == other:
            message = f"{file.name} and {second.name} have the same number; move one elsewhere"
            raise ValueError(message)
    return dict(ordered)


def files_by_number(files: Sequence[Path], stems: Sequence[str]) -> dict[Number, Path]:
    """Returns files by the number in these parts of their names, from the lowest on.

    Raises:
        ValueError: there is none, it could be one of several, or two files have the same.
    """
    place = _place_in(files, stems)
    numbers = _seconds_in(stems) if place is None else place.numbers
    if not numbers:
        raise ValueError(
            f"{files[0].name}: has no number of a frame, or none at the same place as other files"
        )
    return by_number(zip(numbers, files, strict=True))


def number_in(file: Path) -> Number:
    """Returns the number in the name of one file; 0 if it has none. Errors: as for several."""
    place = _place_in([file], [file.stem])
    return 0 if place is None else place.numbers[0]


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
            yield _as_integer(before + distance * i / n)
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


def pattern_like(path: Path, suffixes: Iterable[str]) -> str | None:
    """Returns the pattern of the names of frames in a folder, pattern or glob, if they have one."""
    names = FrameNames.of(path)
    if names.numbered:
        return None if _wildcards.keys() & set(names.pattern) else names.pattern
    result = matching(path) if not path.is_dir() else []
    for suffix in suffixes if path.is_dir() else ():
        result = result or files_in(path, suffix)
    return _pattern_of(result)


def numbered_like(name: str) -> str | None:
    """Returns the pattern of the names of frames like this one; None if it has no number."""
    return _pattern_of([Path(name)])


def _pattern_of(files: Sequence[Path]) -> str | None:
    place = _place_in(files, _stems(files)) if files else None
    name = "" if place is None else Path(place.pattern + files[0].suffix).name
    return name if FrameNames(Path(), name).numbered else None


def files_in(folder: Path, suffix: str) -> list[Path]:
    """Returns the files in a folder with this suffix, except hidden ones, in natural order."""
    return _in_natural_order(
        file
        for file in folder.glob("*")
        if file.suffix.lower() == suffix and not file.name.startswith(".")
    )


class Found(NamedTuple):
    """The files of a sequence that is to be read, None where one is missing, and their numbers."""

    files: list[Path | None]
    numbers: list[Number]


def find_files(path: Path, suffix: str, gaps: Gaps = "refuse") -> Found:
    """Finds the files of a sequence that is to be read, in the order of their numbers.

    They are counted from 0 if the names also differ otherwise, or by a date and a time, if `path`
    is a single file, or if the numbers are too large to count frames.

    Args:
        path: a file; a folder, for all its files with `suffix`; a pattern such as
            ``frame_%04d.ply`` or ``frame.####.ply``, for all files that have such a name; or a
            glob such as ``*.ply``, for all files that match.
        suffix: in lower case, such as ".ply".
        gaps: what becomes of numbers that are missing, by the usual distance of the others.

    Raises:
        FileNotFoundError: there is no file.
        ValueError: a number is missing and refused, or could be one of several in the names, or the
            folder contains no such file.
    """
    names, is_folder = FrameNames.of(path), path.is_dir()
    if path.exists() and not is_folder:
        return Found([path], [0])
    if names.numbered and not is_folder and (existing := names.existing()):
        return _filled(existing, names, gaps)
    files = files_in(path, suffix) if is_folder else _in_natural_order(matching(path))
    if not files and is_folder:
        raise ValueError(f"holds no {suffix} file")
    if not files:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    place = _place_in(files, stems := _stems(files))
    if place is None:
        return _unlike(files, stems, gaps)
    names = FrameNames(Path(), place.pattern + files[0].suffix)
    return _filled(by_number(zip(place.numbers, files, strict=True)), names, gaps)


def matching(path: Path) -> list[Path]:
    """Returns the files that match a glob; the path of an existing folder is none."""
    folder = str(path.parent)
    folder = glob.escape(folder) if path.parent.is_dir() else folder
    result = glob.glob(str(Path(folder) / path.name))  # noqa: PTH207 (which would find hidden files, too)
    return [Path(file) for file in result]


def _stems(files: Sequence[Path]) -> list[str]:
    """Returns the names without their suffixes, with their folders if these differ."""
    if len({file.parent for file in files}) == 1:
        return [file.stem for file in files]
    return [file.with_suffix("").as_posix() for file in files]


def _unlike(files: list[Path], stems: Sequence[str], gaps: Gaps) -> Found:
    """Returns files whose names have times, or nothing in common, and so no numbers of frames."""
    if seconds := _seconds_in(stems):
        present = by_number(zip(seconds, files, strict=True))
        times = [*present] if gaps == "refuse" else [*with_missing([*present])]
        return Found([present.get(time) for time in times], [*range(len(times))])
    kinds = _kinds(stems, files[0].suffix, _DECIMAL)
    if len(kinds) > 1 < max(kinds.values()):
        raise ValueError(f"holds several sequences, {_told(kinds)}; name one by a pattern")
    if gaps == "lost":
        raise ValueError(
            "the names of its files have no number at the same place, so lost frames cannot be "
            f"told, as from {files[0].name}"
        )
    return Found([*files], [*range(len(files))])


def _filled(present: dict[Number, Path], names: FrameNames, gaps: Gaps) -> Found:
    """Returns the files from the first number to the last, of which some may be missing."""
    numbers = [*present]
    missing = first_missing(numbers)
    if missing is not None and gaps == "refuse":
        raise ValueError(
            f"{names.name(missing)} is missing, as its frames are usually "
            f"{usual_distance(numbers):g} apart: add it; or, with `gaps` lost, nothing was "
            "observed in the frame; or, if no frame is missing, number the files without gaps"
        )
    every = [*with_missing(numbers)]
    files = [present.get(number) for number in every]
    if max(map(abs, numbers)) > largest_start:
        every = [*range(len(every))]
    return Found(files, every)


def names_to_write(path: Path, suffix: str) -> FrameNames:
    """Returns the file names of a sequence that is to be written to a file, pattern or folder.

    Raises:
        ValueError: `path` is a glob, or a folder with files that would become part of the sequence.
    """
    names = FrameNames.of(path)
    if path.is_dir() or not (names.numbered or path.suffix or path.exists()):
        names = FrameNames(path, f"frame_%04d{suffix}")
        own = set(names.existing().values())
        others = [file for file in files_in(path, suffix) if file not in own]
        if others:
            raise ValueError(
                f"contains {others[0].name}, which does not match {names.pattern}; "
                "write to a folder without other frames"
            )
    elif any(sign in path.name for sign in "*?"):  # brackets are ordinary in names of files
        raise ValueError(f"a glob can only be read; write to frame_%04d{suffix}")
    return names


def _in_natural_order(files: Iterable[Path]) -> list[Path]:
    """Sorts files such that frame2 comes before frame10."""

    def key(file: Path) -> tuple[list[Any], str]:
        parts = re.split("([0-9]+)", str(file))
        return [int(part) if part.isdecimal() else part for part in parts], str(file)

    return sorted(files, key=key)
