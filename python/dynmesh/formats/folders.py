"""The files of frames in folders, globs and patterns, in the order of their numbers."""

import errno
import glob
import os
import statistics
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from .._errors import InputError
from ..frames import largest_start
from .format import Gaps
from .names import WILDCARDS, FrameNames, Number, as_whole, by_number, numbers_in

_MOST = 1_000_000
"""Frames that may be missing; more mean that the numbers count something else."""


class FrameFiles(NamedTuple):
    """The files of a sequence that is to be read, None where one is missing, and their numbers."""

    files: list[Path | None]
    numbers: list[Number]


def find_files(path: Path, suffix: str, gaps: Gaps = "refuse") -> FrameFiles:
    """Finds the files of a sequence that is to be read, in natural order.

    They are counted from 0 if names differ in several numbers, if `path` is a single file, or if
    the numbers are too large to count frames.

    Args:
        path: a file; a folder, for all its files with `suffix`; a pattern such as
            ``frame_%04d.ply`` or ``frame.####.ply``, for all files that have such a name; or a
            glob such as ``*.ply``, for all files that match.
        suffix: in lower case, such as ".ply".
        gaps: what becomes of numbers that are missing, by the usual distance of the others.
    """
    names = FrameNames.of(path)
    if path.exists() and not path.is_dir():
        return FrameFiles([path], [0])
    if not (names.numbered and not path.is_dir() and (present := names.existing())):
        files = files_in(path, suffix) if path.is_dir() else matching(path)
        if not files and path.is_dir():
            raise InputError(f"holds no {suffix} file")
        if not files:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        numbers, pattern = numbers_in(files)
        present = by_number(zip(numbers, files, strict=True))
        if pattern is None and gaps == "lost":
            raise InputError(
                "the names of its files differ in several numbers, or in none, so lost frames "
                f"cannot be told, as from {files[0].name}"
            )
        names = FrameNames(Path(), pattern or "%d")
    found = [*present]
    every = with_missing(found)
    if len(every) > len(found) and gaps == "refuse":
        missing = next(number for number in every if number not in present)
        raise InputError(
            f"{names.name(missing)} is missing, as its frames are usually "
            f"{usual_distance(found):g} apart: add it; or, with `gaps` lost, nothing was "
            "observed in the frame; or, if no frame is missing, number the files without gaps"
        )
    is_count = max(map(abs, found)) <= largest_start
    result = [present.get(number) for number in every]
    return FrameFiles(result, every if is_count else [*range(len(every))])


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


def has_gaps(numbers: Sequence[Number]) -> bool:
    """Whether ascending numbers are further apart somewhere than usually."""
    most = 1.5 * usual_distance(numbers)
    return any(after - before > most for before, after in pairwise(numbers))


def with_missing(numbers: Sequence[Number]) -> list[Number]:
    """Returns ascending numbers, and those between where there are gaps."""
    usual, result = usual_distance(numbers), [*numbers[:1]]
    for before, after in pairwise(numbers):
        distance = after - before
        n = round(distance / usual) if distance > 1.5 * usual else 1
        if len(result) + n > len(numbers) + _MOST:
            raise InputError(
                f"more than {_MOST} frames would be missing, as its frames are usually {usual:g} "
                f"apart, and {before:.15g} and {after:.15g} are {distance:g}"
            )
        result += [as_whole(before + distance * i / n) for i in range(1, n)]
        result.append(after)
    return result


def names_to_write(path: Path, suffix: str, kept: Sequence[str] = ()) -> FrameNames:
    """Returns the file names of a sequence that is to be written to a file, pattern or folder."""
    names = FrameNames.of(path)
    is_folder = path.is_dir() or not (names.numbered or path.suffix or path.exists())
    if is_folder:
        names = FrameNames(path, f"frame_%04d{suffix}")
    elif any(sign in path.name for sign in WILDCARDS):  # brackets are ordinary in names of files
        raise InputError(f"a glob can only be read; write to frame_%04d{suffix}")
    if is_folder or kept:
        names = replace(names, kept=tuple(kept))
        own = set(names.existing().values())
        others = [file for file in files_in(names.folder, suffix) if file not in own]
        if others:
            wanted = f"among those from {kept[0]} to {kept[-1]}" if kept else f"a {names.pattern}"
            message = f"contains {others[0].name}, which is not {wanted}"
            raise InputError(f"{message}; write to a folder without other frames")
    return names
