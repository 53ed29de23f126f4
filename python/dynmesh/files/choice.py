"""Selection of the format of a file."""

import errno
import glob
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TypeAlias

from .alembic import alembic
from .format import Format
from .hdf5 import hdf5
from .model import model
from .naming import naming
from .npy import npy
from .npz import npz
from .numbered import files_in
from .obj import obj
from .pc2 import pc2
from .ply import ply
from .usd import usd, usdz

PathLike: TypeAlias = str | os.PathLike[str]

formats: dict[str, Format] = {
    format.name: format for format in (npz, hdf5, npy, pc2, ply, obj, usd, usdz, alembic, model)
}
"""All formats by name."""


_NAME_IT = "name the format"


def format_of(path: PathLike, name: str | None = None) -> Format:
    """Returns the format of that name or else of the sequence at `path`."""
    path = Path(path)
    if name is None and not path.suffix and not path.exists() and not glob.has_magic(str(path)):
        raise FileNotFoundError(errno.ENOENT, "no such file or folder", str(path))
    with naming(path):
        return choose(path, name, _NAME_IT)


def check_suffix(path: PathLike) -> None:
    """Refuses a path that does not tell its format, where no option can.

    Raises:
        ValueError: it does not.
    """
    path = Path(path)
    with naming(path):
        choose(path, None, "give the path of a mesh file, such as body.ply")


def listed(names: Iterable[str]) -> str:
    """Joins names to a list such as "a, b and c"."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def choose(path: Path, name: str | None, otherwise: str, *, written: bool = False) -> Format:
    """Returns the format of that name or of the path, which is to be read or `written`.

    Errors list the possible formats, and `otherwise` is their advice.
    """
    possible = {of: one for of, one in formats.items() if one.writer or not written}
    refused = "cannot write format" if written else "unknown format"
    if name is not None:
        if name not in possible:
            raise ValueError(f"{refused} '{name}'; the formats are {listed(possible)}")
        return possible[name]
    if path.is_dir():
        numbered = {one.suffixes[0]: one for one in formats.values() if "gaps" in one.takes}
        found = [suffix for suffix in numbered if files_in(path, suffix)]
        if len(found) == 1:
            return numbered[found[0]]
        what = " and ".join(found) or f"no {' or '.join(numbered)}"
        raise ValueError(f"is a folder with {what} files; {otherwise}")
    if not path.suffix:
        raise ValueError(f"has no suffix, which would determine the format; {otherwise}")
    suffix = path.suffix.lower()
    for format in possible.values():
        if suffix in format.suffixes:
            return format
    suffixes = listed(suffix for format in possible.values() for suffix in format.suffixes)
    raise ValueError(f"{refused} '{path.suffix}'; the suffixes are {suffixes}")
