"""The files of frames in folders, globs and patterns, in the order of their numbers."""

import errno
import glob
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ..header import largest_start
from .format import Gaps
from .frame_names import (
    DECIMAL,
    WILDCARDS,
    FrameNames,
    Number,
    by_number,
    first_missing,
    usual_distance,
    with_missing,
)
from .numbered import kinds_of, listed_kinds, place_in, seconds_in


def files_by_number(files: Sequence[Path], stems: Sequence[str]) -> dict[Number, Path]:
    """Returns files by the number in these parts of their names, from the lowest on.

    Raises:
        ValueError: there is none, it could be one of several, or two files have the same.
    """
    place = place_in(files, stems)
    numbers = seconds_in(stems) if place is None else place.numbers
    if not numbers:
        raise ValueError(
            f"{files[0].name}: has no number of a frame, or none at the same place as other files"
        )
    return by_number(zip(numbers, files, strict=True))


def number_in(file: Path) -> Number:
    """Returns the number in the name of one file; 0 if it has none. Errors: as for several."""
    place = place_in([file], [file.stem])
    return 0 if place is None else place.numbers[0]


def pattern_like(path: Path, suffixes: Iterable[str]) -> str | None:
    """Returns the pattern of the names of frames in a folder, pattern or glob, if they have one."""
    names = FrameNames.of(path)
    if names.numbered:
        return None if WILDCARDS.keys() & set(names.pattern) else names.pattern
    result = matching(path) if not path.is_dir() else []
    for suffix in suffixes if path.is_dir() else ():
        result = result or files_in(path, suffix)
    return _pattern_of(result)


def numbered_like(name: str) -> str | None:
    """Returns the pattern of the names of frames like this one; None if it has no number."""
    return _pattern_of([Path(name)])


def _pattern_of(files: Sequence[Path]) -> str | None:
    place = place_in(files, _stems(files)) if files else None
    name = "" if place is None else Path(place.pattern + files[0].suffix).name
    return name if FrameNames(Path(), name).numbered else None


def files_in(folder: Path, suffix: str) -> list[Path]:
    """Returns the files in a folder with this suffix, except hidden ones, in natural order."""
    return _in_natural_order(
        file
        for file in folder.glob("*")
        if file.suffix.lower() == suffix and not file.name.startswith(".")
    )


class FrameFiles(NamedTuple):
    """The files of a sequence that is to be read, None where one is missing, and their numbers."""

    files: list[Path | None]
    numbers: list[Number]


def find_files(path: Path, suffix: str, gaps: Gaps = "refuse") -> FrameFiles:
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
        return FrameFiles([path], [0])
    if names.numbered and not is_folder and (existing := names.existing()):
        return _filled(existing, names, gaps)
    files = files_in(path, suffix) if is_folder else _in_natural_order(matching(path))
    if not files and is_folder:
        raise ValueError(f"holds no {suffix} file")
    if not files:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    place = place_in(files, stems := _stems(files))
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


def _unlike(files: list[Path], stems: Sequence[str], gaps: Gaps) -> FrameFiles:
    """Returns files whose names have times, or nothing in common, and so no numbers of frames."""
    if seconds := seconds_in(stems):
        present = by_number(zip(seconds, files, strict=True))
        times = [*present] if gaps == "refuse" else [*with_missing([*present])]
        return FrameFiles([present.get(time) for time in times], [*range(len(times))])
    kinds = kinds_of(stems, files[0].suffix, DECIMAL)
    if len(kinds) > 1 < max(kinds.values()):
        raise ValueError(f"holds several sequences, {listed_kinds(kinds)}; name one by a pattern")
    if gaps == "lost":
        raise ValueError(
            "the names of its files have no number at the same place, so lost frames cannot be "
            f"told, as from {files[0].name}"
        )
    return FrameFiles([*files], [*range(len(files))])


def _filled(present: dict[Number, Path], names: FrameNames, gaps: Gaps) -> FrameFiles:
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
    return FrameFiles(files, every)


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
