"""The file names of a sequence with one file per frame."""

import errno
import glob
import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from ..sequence import largest_start

_conversion = re.compile("%(?:0[0-9]+)?d")
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

    def name(self, number: int) -> str:
        """Returns the file name of this frame."""
        return self.pattern % number if self.numbered else self.pattern

    def existing(self) -> dict[int, Path]:
        """Returns the existing files by ascending number."""
        if not self.numbered:
            file = self.folder / self.pattern
            return {0: file} if file.exists() else {}
        begin, end = map(re.escape, _conversion.split(self.pattern))
        found = {}
        for file in self.folder.glob("*"):  # empty if the folder does not exist
            match = re.fullmatch(f"{begin}([0-9]+){end}", file.name)
            if match and self.name(int(match[1])) == file.name:
                found[int(match[1])] = file
        return dict(sorted(found.items()))


def files_in(folder: Path, suffix: str) -> list[Path]:
    """Returns the files in a folder with this suffix, except hidden ones, in natural order."""
    return _in_natural_order(
        file
        for file in folder.glob("*")
        if file.suffix.lower() == suffix and not file.name.startswith(".")
    )


def find_files(path: Path, suffix: str) -> tuple[list[Path], int]:
    """Finds the files of a sequence to be read, and the number of the first frame.

    In a folder or a glob, the number is the last one in a name. It is 0 if the names also differ
    otherwise, if `path` is a single file, or if the number is too large to count frames. The
    numbers may be several apart, for example if only every second frame exists, but must be evenly
    spaced.

    Args:
        path: a file; a folder, for all its files with `suffix` in natural order; a pattern such as
            ``frame_%04d.ply``, for all files from the lowest number to the highest; or a glob such
            as ``*.ply``, for all files that match, in natural order.
        suffix: in lower case, such as ".ply".

    Raises:
        FileNotFoundError: there is no file.
        ValueError: a number is missing, or the folder contains no such file.
    """
    names = FrameNames(path.parent, path.name)
    first = 0
    if path.is_dir():
        if not (found := files_in(path, suffix)):
            raise ValueError(f"holds no {suffix} file")
        first = _first_number(found)
        _check_no_gap(found)
    elif path.exists():
        found = [path]
    elif names.numbered:
        by_number = names.existing()
        for before, after in pairwise(by_number):
            if after > before + 1:
                raise ValueError(_missing(names.name(before + 1)))
        found, first = list(by_number.values()), next(iter(by_number), 0)
    else:
        matching = glob.glob(str(path))  # noqa: PTH207 (which would find hidden files, too)
        found = _in_natural_order(map(Path, matching))
        first = _first_number(found)
        _check_no_gap(found)
    if not found:
        raise FileNotFoundError(errno.ENOENT, "no such file", str(path))
    return found, first if first <= largest_start else 0


def _first_number(files: list[Path]) -> int:
    """Returns the last number in the first name, or 0 if the names also differ otherwise."""
    return next(iter(_numbers(files)), 0)


def _numbers(files: list[Path]) -> list[int]:
    """Returns the last numbers in the names, or none if the names also differ otherwise."""
    common = {(file.parent, _last_number.sub("/", file.stem)) for file in files}
    found = [_last_number.search(file.stem) for file in files] if len(common) == 1 else []
    return [int(number[0]) for number in found if number]


def _check_no_gap(files: list[Path]) -> None:
    """Raises an error if a file is missing between two others.

    Numbers that are not multiples of one step apart are not checked: they may be times.
    """
    numbers = _numbers(files)
    steps = [after - before for before, after in pairwise(numbers)]
    step = min(steps, default=0)
    if step == 0 or any(one % step for one in steps):
        return
    for file, number, one in zip(files, numbers, steps, strict=False):
        if one > step:
            raise ValueError(_missing(_renumbered(file, number + step)))


def _renumbered(file: Path, number: int) -> str:
    """Returns the name that the file would have with this number."""
    name = _last_number.sub(lambda old: str(number).zfill(len(old[0])), file.stem)
    return name + file.suffix


def _missing(name: str) -> str:
    return f"{name} is missing: add it or, if no frame is missing, number the files without gaps"


def names_to_write(path: Path, suffix: str) -> FrameNames:
    """Returns the file names of a sequence that is to be written to `path`.

    Args:
        path: a file, for one frame; a pattern such as ``frame_%04d.ply``; or a folder.
        suffix: in lower case, such as ".ply".

    Raises:
        ValueError: `path` is a glob, or a folder with files that would become part of the sequence.
    """
    names = FrameNames(path.parent, path.name)
    if path.is_dir() or not (names.numbered or path.suffix or path.exists()):
        names = FrameNames(path, f"frame_%04d{suffix}")
        own = set(names.existing().values())
        others = [file for file in files_in(path, suffix) if file not in own]
        if others:
            raise ValueError(
                f"contains {others[0].name}, which does not match {names.pattern}; "
                "write to a folder without other frames"
            )
    elif glob.has_magic(path.name):
        raise ValueError(f"a glob can only be read; write to frame_%04d{suffix}")
    return names


def _in_natural_order(files: Iterable[Path]) -> list[Path]:
    """Sorts files such that frame2 comes before frame10."""

    def key(file: Path) -> tuple[list[Any], str]:
        parts = re.split("([0-9]+)", str(file))
        return [int(part) if part.isdecimal() else part for part in parts], str(file)

    return sorted(files, key=key)
