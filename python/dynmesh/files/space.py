"""The space that an output needs on its disk."""

import shutil
from pathlib import Path

from .header import Header

_BYTES = 12
"""Of a position, at least, in every format."""


def bytes_of(header: Header) -> int:
    """Returns the least number of bytes that the frames of a sequence take in a file."""
    of_vertex = _BYTES + sum(row.dtype.itemsize for row in header.attributes.values())
    return header.n_frames * header.n_vertices * of_vertex


def check_space(folder: Path, needed: int) -> None:
    """Refuses an output that the disk of the folder in which it is made has no space for.

    Raises:
        OSError: it needs more bytes than are left.
    """
    left = shutil.disk_usage(folder).free
    if needed > left:
        raise OSError(
            f"needs at least {needed / 1e9:.2g} GB, but its disk has {left / 1e9:.2g} GB left"
        )
