"""Files with one frame each: their natural order, their numbers, and patterns of their names.

Numbers in names count as numbers, from left to right. A hyphen at the beginning or after a point,
an underscore or another hyphen is the sign of a number. Upper and lower case are the same.
"""

import errno
import glob
import os
import re
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, TypeAlias

from .._errors import InputError
from ..header import largest_start
from .format import Gaps

Number = int | float
"""That of a frame: an integer wherever it is whole, so that large ones stay exact."""

_Key: TypeAlias = tuple[str | Decimal, ...]
"""What names are ordered by: texts and numbers, by turns."""

_conversion = re.compile(r"%(?:0[0-9]+)?(?:d|\.[0-9]+f)")
_WHOLE = re.compile(r"((?:(?<![^._-])-)?[0-9]+)")
_DECIMAL = re.compile(r"((?:(?<![^._-])-)?[0-9]+(?:\.[0-9]+)?)")
_COUNTED = re.compile(r"[0-9]\.(?:[0-9]+0|[0-9]+\.[0-9]+)(?![0-9])")
"""What follows a point is no fraction if it ends in 0, as in 1.10, or a third number follows."""

_MOST = 1_000_000
"""Frames that may be missing; more mean that the numbers count something else."""


def numbers_in(
    files: Sequence[Path], stems: Sequence[str] | None = None
) -> tuple[list[Number], str | None]:
    """Finds the number of each frame: the one that differs in the names.

    If several differ, or decimals that float64 cannot tell apart, frames are counted from 0.

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
    columns = [*zip(*keys, strict=True)]
    differing = [at for at in range(1, len(columns), 2) if len({*columns[at]}) > 1]
    at = differing[0] if differing else len(columns) - 2
    numbers = [_number(Decimal(number)) for number in columns[at]] if at > 0 else []
    if at < 0 or len(differing) > 1 or len({*numbers}) < len({*keys}):
        ranks = {key: rank for rank, key in enumerate(sorted({*keys}))}
        return [ranks[key] for key in keys], None
    parts = [kind.split(stem) for stem in stems]
    width = min(len(part[at]) for part in parts)
    decimals = max(len(part[at].partition(".")[2]) for part in parts)
    parts[0][at] = ("%" if width == 1 else f"%0{width}") + (f".{decimals}f" if decimals else "d")
    return numbers, "".join(parts[0]) + files[0].suffix


def _keys_of(files: Sequence[Path], stems: Sequence[str]) -> tuple[re.Pattern[str], list[_Key]]:
    """Returns what a number is, and the keys of names: decimals if nothing else tells them apart.

    That is, if nothing else is in the names, or if fractions differ in length.
    """
    whole, decimal = ([_key(stem, kind) for stem in stems] for kind in (_WHOLE, _DECIMAL))
    texts, of_decimals = ({key[::2] for key in keys} for keys in (whole, decimal))
    lengths = {len(key) for key in re.findall(r"(?<=[0-9])\.([0-9]+)", " ".join(stems))}
    is_counted = len(lengths) > 1 and any(map(_COUNTED.search, stems))
    if of_decimals == {("", "")} or (len(of_decimals) == 1 < len(texts) and not is_counted):
        return _DECIMAL, decimal
    if len(texts) > 1 and any(map(_WHOLE.search, stems)):
        other = next(f for f, key in zip(files, whole, strict=True) if key[::2] != whole[0][::2])
        raise InputError(
            f"holds several sequences, as {files[0].name} and {other.name} differ in more than "
            "numbers; name one by a pattern or a glob"
        )
    if is_counted:
        return _WHOLE, whole
    orders = [sorted(range(len(keys)), key=keys.__getitem__) for keys in (whole, decimal)]
    for pair in zip(*orders, strict=True):
        if len({*pair}) > 1:
            names = " and ".join(files[at].name for at in pair)
            raise InputError(
                f"{names} are in one order if their numbers are decimals, and in another if they "
                "are not; write all numbers with the same number of digits"
            )
    return (_DECIMAL, decimal) if len(lengths) > 1 else (_WHOLE, whole)


def _key(stem: str, kind: re.Pattern[str]) -> _Key:
    parts = enumerate(kind.split(stem))
    return tuple(Decimal(part) if at % 2 else part.casefold() for at, part in parts)


def _number(exact: Decimal) -> Number:
    return int(exact) if exact == exact.to_integral_value() else float(exact)


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
        pattern: a name with ``%d`` or ``%04d`` for the number of the frame, or ``%.2f`` or
            ``%07.2f`` for one with so many decimals; or a plain name for a sequence of one frame.
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
        name, hashes = path.name, re.findall("##+", path.name)
        if len(hashes) == 1 and "%" not in name and not path.exists():
            name = name.replace(hashes[0], f"%0{len(hashes[0])}d")
        return cls(path.parent, name)

    def name(self, number: Number | Decimal) -> str:
        """Returns the file name of this frame."""

        def text(place: re.Match[str]) -> str:
            return format(int(number) if place[0].endswith("d") else number, place[0][1:])

        return _conversion.sub(text, self.pattern)

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
        begin, end = map(re.escape, _conversion.split(self.pattern))
        match = re.fullmatch(rf"{begin}(-?[0-9]+(?:\.[0-9]+)?){end}", name)
        exact = None if match is None else Decimal(match[1])
        return None if exact is None or self.name(exact) != name else _number(exact)


class FrameFiles(NamedTuple):
    """The files of a sequence that is to be read.

    Attributes:
        files: one for each frame, None where one is missing.
        numbers: those of the frames: as the files have them, unless they are too large for counts.
        names: those of the files, also of missing ones.
        pattern: of the names; None if frames are counted.
    """

    files: list[Path | None]
    numbers: list[Number]
    names: list[str]
    pattern: str | None


def find_files(path: Path, suffix: str, gaps: Gaps = "refuse") -> FrameFiles:
    """Finds the files of a sequence that is to be read, in natural order.

    Args:
        path: a file; a folder, for all its files with `suffix`; a pattern such as
            ``frame_%04d.ply`` or ``frame.####.ply``, for all files that have such a name; or a
            glob such as ``*.ply``, for all files that match.
        suffix: in lower case, such as ".ply".
        gaps: what becomes of numbers that are missing, by the usual distance of the others.
    """
    result = with_gaps(path, suffix)
    if not result.files and path.is_dir():
        raise InputError(f"holds no {suffix} file")
    if not result.files:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    if result.pattern is None and gaps == "lost" and len(result.files) > 1:
        raise InputError(
            "the names of its files differ in several numbers, or in none, so lost frames "
            f"cannot be told, as from {result.names[0]}"
        )
    if None in result.files and gaps == "refuse":
        present = [n for n, f in zip(result.numbers, result.files, strict=True) if f is not None]
        raise InputError(
            f"{result.names[result.files.index(None)]} is missing, as its frames are usually "
            f"{usual_distance(present):g} apart: add it; or, with `gaps` lost, nothing was "
            "observed in the frame; or, if no frame is missing, number the files without gaps"
        )
    return result


def with_gaps(path: Path, suffix: str) -> FrameFiles:
    """The files of a folder, pattern, glob or single file, among which some may be missing."""
    names, present = FrameNames.of(path), dict[Number, Path]()
    if path.exists() and not path.is_dir():
        names, present = FrameNames(path.parent, ""), {0: path}
    elif names.numbered and not path.is_dir():
        present = names.existing()
    if not present:
        files = files_in(path, suffix) if path.is_dir() else matching(path)
        numbers, pattern = numbers_in(files) if files else ([], None)
        names = FrameNames(path, Path(pattern or "").name)
        present = by_number(zip(numbers, files, strict=True))
    every = with_missing([*present])
    is_count = max(map(abs, every), default=0) <= largest_start
    return FrameFiles(
        [present.get(number) for number in every],
        every if is_count else [*range(len(every))],
        [present[n].name if n in present else names.name(n) for n in every],
        names.pattern or None,
    )


def files_in(folder: Path, suffix: str) -> list[Path]:
    """Returns the files in a folder with this suffix, except hidden ones, by their names."""
    return sorted(
        file
        for file in folder.glob("*")
        if file.suffix.lower() == suffix and not file.name.startswith(".")
    )


def matching(path: Path) -> list[Path]:
    """Returns the files that match a glob; the path of an existing folder is none."""
    folder = str(path.parent)
    folder = glob.escape(folder) if path.parent.is_dir() else folder
    result = glob.glob(str(Path(folder) / path.name))  # noqa: PTH207 (which would find hidden files, too)
    return sorted(map(Path, result))


def usual_distance(numbers: Sequence[Number]) -> Number:
    """Returns that between ascending numbers; 1 of one."""
    steps = [after - before for before, after in pairwise(numbers)]
    return statistics.median_low(steps) if steps else 1


def with_missing(numbers: Sequence[Number]) -> list[Number]:
    """Returns ascending numbers, and those between where they are further apart than usually."""
    usual, result = usual_distance(numbers), [*numbers[:1]]
    for before, after in pairwise(numbers):
        distance = after - before
        n = round(distance / usual) if distance > 1.5 * usual else 1
        if len(result) + n > len(numbers) + _MOST:
            raise InputError(
                f"more than {_MOST} frames would be missing, as its frames are usually {usual:g} "
                f"apart, and {before:.15g} and {after:.15g} are {distance:g}"
            )
        between = [before + distance * i / n for i in range(1, n)]
        result += [int(one) if float(one).is_integer() else one for one in between]
        result.append(after)
    return result


def names_to_write(path: Path, suffix: str) -> FrameNames:
    """Returns the file names of a sequence that is to be written to a file, pattern or folder."""
    names = FrameNames.of(path)
    is_folder = path.is_dir() or not (names.numbered or path.suffix or path.exists())
    if is_folder:
        names = FrameNames(path, f"frame_%04d{suffix}")
        own = set(names.existing().values())
        others = [file for file in files_in(names.folder, suffix) if file not in own]
        if others:
            message = f"contains {others[0].name}, which is not a {names.pattern}"
            raise InputError(f"{message}; write to a folder without other frames")
    elif {"*", "?"} & {*path.name}:  # brackets are ordinary in names of files
        raise InputError(f"a glob can only be read; write to frame_%04d{suffix}")
    return names


def check_one_file(path: Path) -> None:
    """Refuses names of several files for a sequence that is to be written to one."""
    if FrameNames.of(path).numbered or {"*", "?"} & {*path.name}:
        raise InputError(
            f"stands for several files, but one {path.suffix} file holds all frames; name one file"
        )
