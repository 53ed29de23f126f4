"""The file names of a sequence with one file per frame."""

import errno
import glob
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from ..sequence import largest_start
from .format import Gaps

_conversion = re.compile("%(?:0[0-9]+)?d")
_hashes = re.compile("##+")
_last_number = re.compile("[0-9]+(?=[^0-9]*$)")


@dataclass(frozen=True)
class FrameNames:
    """The file names of a sequence.

    Attributes:
        folder: the folder of the files.
        pattern: a name with ``%d`` or ``%04d`` for the number of the frame, or a plain name for a
            sequence of one frame.
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

    def name(self, number: int) -> str:
        """Returns the file name of this frame."""
        return self.pattern % number if self.numbered else self.pattern

    def existing(self) -> dict[int, Path]:
        """Returns the existing files by ascending number."""
        if not self.numbered:
            file = self.folder / self.pattern
            return {0: file} if file.exists() else {}
        found = {}
        for file in self.folder.glob("*"):  # empty if the folder does not exist
            number = self.number(file.name)
            if number is not None:
                found[number] = file
        return dict(sorted(found.items()))

    def number(self, name: str) -> int | None:
        """Returns the number of the frame with this file name; None if no frame has it."""
        if not self.numbered:
            return 0 if name == self.pattern else None
        begin, end = map(re.escape, _conversion.split(self.pattern))
        match = re.fullmatch(f"{begin}([0-9]+){end}", name)
        return int(match[1]) if match and self.name(int(match[1])) == name else None


def with_conversion(name: str) -> str:
    """Returns the pattern with ``%04d`` for ``####``, as animation programs write it."""
    found = _hashes.findall(name)
    return _hashes.sub(f"%0{len(found[0])}d", name) if len(found) == 1 and "%" not in name else name


def pattern_like(path: Path, suffixes: Iterable[str]) -> str | None:
    """Returns the pattern of the names of frames in a folder, pattern or glob, if they have one."""
    names = FrameNames.of(path)
    if names.numbered:
        return names.pattern
    found = matching(path) if not path.is_dir() else []
    for suffix in suffixes if path.is_dir() else ():
        found = found or files_in(path, suffix)
    return numbered_like(found[0].name) if found else None


def numbered_like(name: str) -> str | None:
    """Returns the pattern of the names of frames like this one; None if it has no number."""
    stem, suffix = Path(name).stem, Path(name).suffix
    last = _last_number.search(stem)
    if last is None or "%" in name:
        return None
    return f"{stem[: last.start()]}%0{len(last[0])}d{stem[last.end() :]}{suffix}"


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
    start: int = 0
    step: int = 1


def find_files(path: Path, suffix: str, gaps: Gaps = "refuse") -> Found:
    """Finds the files of a sequence that is to be read, and their numbers.

    In a folder or a glob, the number is the last one in a name. It is 0 if the names also differ
    otherwise, if `path` is a single file, or if the number is too large to count frames. The
    numbers may be several apart, for example if only every second frame exists, but must be evenly
    spaced.

    Args:
        path: a file; a folder, for all its files with `suffix`; a pattern such as
            ``frame_%04d.ply`` or ``frame.####.ply``, for all files from the lowest number to the
            highest; or a glob such as ``*.ply``, for all files that match.
        suffix: in lower case, such as ".ply".
        gaps: what becomes of missing numbers between others.

    Raises:
        FileNotFoundError: there is no file.
        ValueError: a number is missing and refused, or the folder contains no such file.
    """
    names = FrameNames.of(path)
    if path.is_dir():
        if not (found := files_in(path, suffix)):
            raise ValueError(f"holds no {suffix} file")
        kinds = Counter(_last_number.sub("*", file.stem) + file.suffix for file in found)
        if len(kinds) > 1 < max(kinds.values()):
            told = " and ".join(f"'{kind}' ({n})" for kind, n in kinds.most_common(3))
            raise ValueError(f"holds several sequences, {told}; name one by a pattern")
        return _evenly_spaced(found, gaps)
    if path.exists():
        return Found([path])
    if names.numbered and (by_number := names.existing()):
        return _filled(by_number, 1, gaps, names.name)
    if not names.numbered and (found := _in_natural_order(matching(path))):
        return _evenly_spaced(found, gaps)
    raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))


def matching(path: Path) -> list[Path]:
    """Returns the files that match a glob; the path of an existing folder is none."""
    folder = str(path.parent)
    folder = glob.escape(folder) if path.parent.is_dir() else folder
    found = glob.glob(str(Path(folder) / path.name))  # noqa: PTH207 (which would find hidden files, too)
    return [Path(file) for file in found]


def _evenly_spaced(files: list[Path], gaps: Gaps) -> Found:
    """Returns the files with the numbers in their names, if these are evenly spaced.

    Numbers that are not multiples of one step apart are not checked: they may be times.
    """
    # If the names also differ otherwise, the last numbers in them are not those of frames.
    common = {(file.parent, _last_number.sub("/", file.stem)) for file in files}
    found = [_last_number.search(file.stem) for file in files] if len(common) == 1 else []
    numbers = [int(number[0]) for number in found if number]
    steps = [after - before for before, after in pairwise(numbers)]
    step = min(steps, default=1)
    if 0 in steps:
        one = steps.index(0)
        raise ValueError(
            f"{files[one].name} and {files[one + 1].name} have the same number; move one elsewhere"
        )
    if any(one % step for one in steps) or not numbers:
        if gaps == "lost":
            raise ValueError(
                "the names of its files do not end in evenly spaced numbers, so lost frames cannot "
                f"be told, as from {files[0].name}"
            )
        return Found(list(files), _countable(numbers[0] if numbers else 0))

    def renumbered(number: int) -> str:
        name = _last_number.sub(lambda old: str(number).zfill(len(old[0])), files[0].stem)
        return name + files[0].suffix

    return _filled(dict(zip(numbers, files, strict=True)), step, gaps, renumbered)


def _filled(by_number: dict[int, Path], step: int, gaps: Gaps, name: Callable[[int], str]) -> Found:
    """Returns the files from the first number to the last, of which some may be missing."""
    numbers = range(min(by_number), max(by_number) + 1, step)
    missing = next((number for number in numbers if number not in by_number), None)
    if missing is not None and gaps == "refuse":
        raise ValueError(
            f"{name(missing)} is missing: add it; or, with `gaps` lost, nothing was "
            "observed in the frame; or, if no frame is missing, number the files without gaps"
        )
    files = [by_number.get(number) for number in numbers]
    return Found(files, _countable(numbers[0]), step)


def _countable(number: int) -> int:
    return number if number <= largest_start else 0


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
