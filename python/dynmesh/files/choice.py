"""Selection of the format of a file, and questions about the writer of that format."""

import errno
import glob
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TypeAlias

from .._extras import require
from .alembic import alembic
from .format import Format
from .hdf5 import hdf5
from .mdd import mdd
from .naming import naming
from .npy import npy
from .npz import npz
from .numbered import files_in
from .obj import obj
from .paraview import pvd
from .pc2 import pc2
from .ply import ply
from .usd import usd, usdz
from .writer import Writer

PathLike: TypeAlias = str | os.PathLike[str]

formats: dict[str, Format] = {
    format.name: format for format in (npz, hdf5, npy, pc2, mdd, ply, obj, pvd, usd, usdz, alembic)
}
"""All formats by name."""


_NAME_IT = "name the format: --format, in Python format=, in a table of jobs the column format"


def format_of(path: PathLike, name: str | None = None) -> Format:
    """Returns the format of that name or else of the sequence at `path`."""
    path = Path(path)
    if name is None and not path.suffix and not path.exists() and not glob.has_magic(str(path)):
        raise FileNotFoundError(errno.ENOENT, "no such file or folder", str(path))
    with naming(path):
        return _choose(path, name, _NAME_IT)


def writer_of(path: PathLike, format: str | None = None) -> type[Writer]:
    """Returns the writer for `path`; raises ImportError if its library is not installed."""
    path = Path(path)
    with naming(path):
        otherwise = f"write {path / 'frame_%04d.ply'}, or give --output-format"
        chosen = _choose(path, format, otherwise)
        if chosen.writer is None:
            raise ValueError(f"{chosen.name} files can only be read")
        if chosen.library is not None:
            module, extra = chosen.library
            require(module, extra=extra)
        return chosen.writer


def keeps_provenance(path: PathLike, format: str | None = None) -> bool:
    """Whether a file written to `path` can hold the generation and the age of its vertices."""
    return writer_of(path, format).keeps_provenance


def resumable(path: PathLike, format: str | None = None) -> bool:
    """Whether an interrupted writer can be continued by another one."""
    return writer_of(path, format).resumable


def existing(path: PathLike, format: str | None = None) -> list[Path]:
    """Returns the existing files that writing to `path` would replace."""
    path = Path(path)
    with naming(path):
        return writer_of(path, format).existing(path)


def new_folder(path: PathLike, format: str | None = None) -> Path | None:
    """Returns the folder that writing to `path` would create; None if it must exist."""
    path = Path(path)
    with naming(path):
        return writer_of(path, format).new_folder(path)


def listed(names: Iterable[str]) -> str:
    """Joins names to a list such as "a, b and c"."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def _choose(path: Path, name: str | None, otherwise: str) -> Format:
    """Returns the format of that name or of the path; `otherwise` is the advice in errors."""
    if name is not None:
        if name not in formats:
            raise ValueError(f"unknown format '{name}'; the formats are {listed(formats)}")
        return formats[name]
    if path.is_dir():
        return _format_in(path, otherwise)
    if not path.suffix:
        raise ValueError(f"has no suffix, which would determine the format; {otherwise}")
    suffix = path.suffix.lower()
    for format in formats.values():
        if suffix in format.suffixes:
            return format
    suffixes = [suffix for format in formats.values() for suffix in format.suffixes]
    raise ValueError(f"unknown format '{path.suffix}'; the suffixes are {listed(suffixes)}")


def _format_in(folder: Path, otherwise: str) -> Format:
    """Returns the format of the frames in a folder."""
    found = [format for format in (ply, obj) if files_in(folder, format.suffixes[0])]
    if len(found) == 1:
        return found[0]
    what = "both .ply and .obj files" if found else "no .ply or .obj files"
    raise ValueError(f"is a folder with {what}; {otherwise}")
