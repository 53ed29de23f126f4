"""The table of formats, and which of them a file has."""

import errno
import glob
import os
from pathlib import Path
from typing import TypeAlias

from .._checks import path_of
from .._errors import InputError, naming, require
from .._report import listed
from ..frame import Frames
from .alembic import alembic
from .format import Format
from .hdf5 import hdf5
from .names import FrameNames, files_in, matching, with_gaps
from .npz import npz, npz_frames
from .obj import obj
from .pc2 import pc2
from .ply import ply
from .rows import npy
from .trimesh_files import model
from .usd import usd, usdz

PathLike: TypeAlias = str | os.PathLike[str]


_OWN = (npz, npz_frames, hdf5, npy, pc2, ply, obj, usd, usdz, alembic, model)

FORMATS: dict[str, Format] = {format.name: format for format in _OWN}
"""The formats by name."""


def format_of(path: PathLike, name: str | None = None) -> Format:
    """Returns the format of that name or else of the sequence at `path`."""
    path = path_of("path", path)
    if name is None and not path.suffix and not path.exists() and not glob.has_magic(str(path)):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    with naming(path):
        advice = "give a file such as body.ply, or name the format; dynmesh track takes scans"
        return _choose(path, name, advice)


def existing_file(path: Path, format: Format) -> Path:
    """Returns the path or, of a format with one file a sequence, the only file it stands for."""
    if format.is_per_frame or path.exists():
        return path
    result = _files_of(path)
    if len(result) > 1:
        raise InputError(
            f"stands for {len(result)} files, from {result[0].name} on, which are no sequence, as "
            f"each {format.name} file is one of its own; name one"
        )
    return result[0] if result else path


def _files_of(path: Path) -> list[Path]:
    """The files that a pattern or a glob stands for."""
    return [*FrameNames.of(path).existing().values()] or sorted(matching(path))


def _choose(path: Path, name: str | None, otherwise: str, *, written: bool = False) -> Format:
    """Returns the format of that name or of the path, which is to be read or `written`.

    Errors list the possible formats, and `otherwise` is their advice.
    """
    possible = {of: format for of, format in FORMATS.items() if format.write or not written}
    refused = "cannot write format" if written else "unknown format"
    if name is not None:
        if name not in possible:
            raise InputError(f"{refused} '{name}'; the formats are {listed(possible)}")
        return possible[name]
    if path.is_dir():
        numbered = {
            format.suffixes[0]: format for format in FORMATS.values() if format.is_per_frame
        }
        results = [suffix for suffix in numbered if files_in(path, suffix)]
        if len(results) > 1 and npz_frames.suffixes[0] in results:  # results beside the frames
            results.remove(npz_frames.suffixes[0])
        if len(results) == 1:
            return numbered[results[0]]
        what = " and ".join(results) or f"no {' or '.join(numbered)}"
        raise InputError(f"is a folder with {what} files; {otherwise}")
    if not path.suffix:
        raise InputError(f"has no suffix, which would determine the format; {otherwise}")
    suffix = path.suffix.lower()
    fitting = [format for format in possible.values() if suffix in format.suffixes]
    if len(fitting) > 1 and not path.exists() and len(_files_of(path)) > 1:
        fitting.sort(key=lambda format: not format.is_per_frame)
    if fitting:
        return fitting[0]
    suffixes = listed(dict.fromkeys(one for format in possible.values() for one in format.suffixes))
    raise InputError(f"{refused} '{path.suffix}'; the suffixes are {suffixes}")


def check_format(path: PathLike, name: str | None) -> None:
    """Refuses a file, before any work is done, whose format cannot be written."""
    path = path_of("path", path)
    if name is not None or path.suffix:
        format_of_output(path, name)


def format_of_output(path: Path, name: str | None) -> Format:
    """Returns the format of that name or else of a path, in which frames are written."""
    with naming(path):
        otherwise = f"write {path / 'frame_%04d.ply'}, or name the format"
        chosen = _choose(path, name, otherwise, written=True)
        if chosen.library is not None:
            module, extra = chosen.library
            require(module, extra=extra)
        return chosen


def named_like(frames: Frames, folder: Path) -> Path:
    """Where frames are written for which a folder is given: there, by the pattern of the input.

    If no pattern gives the names of the input, frames are numbered from 0.
    """
    path = frames.path
    if (folder.suffix and not folder.is_dir()) or not frames.files:
        return folder
    written = (one for one in FORMATS.values() if one.write and one.is_per_frame)
    for suffix in (one.suffixes[0] for one in written):
        if files_in(path, suffix) if path.is_dir() else path.suffix.lower() == suffix:
            break
    else:
        return folder
    with naming(path):
        found = with_gaps(path, suffix)
    names = FrameNames(folder, found.pattern or "")
    by_number = zip(found.numbers, found.names, strict=True)
    is_named = names.numbered and all(names.name(number) == name for number, name in by_number)
    return folder / (names.pattern if is_named else f"frame_%04d{suffix}")
