"""The space that an output needs on its disk."""

import errno
import shutil
from pathlib import Path

from ..frames.header import Header
from .lock import unfinished_folder

_BYTES = 12
"""Of a position, at least, in every format."""


def bytes_of(header: Header) -> int:
    """Returns the least number of bytes that the frames of a sequence take in a file."""
    of_vertex = _BYTES + sum(row.dtype.itemsize for row in header.attributes.values())
    return header.n_frames * header.n_vertices * of_vertex


def check_space(path: Path, needed: int) -> None:
    """Refuses an output that its disk has no space for, beside what is unfinished of it.

    Raises:
        OSError: it needs more bytes than are left; the message names the output.
    """
    there = next(folder for folder in path.absolute().parents if folder.is_dir())
    unfinished = unfinished_folder(path)
    kept = sum(file.stat().st_size for file in unfinished.rglob("*") if file.is_file())
    left = shutil.disk_usage(there).free
    if needed > left + kept:
        raise OSError(
            errno.ENOSPC,
            f"needs at least {needed / 1e9:.2g} GB, but its disk has {left / 1e9:.2g} GB left",
            str(path),
        )
