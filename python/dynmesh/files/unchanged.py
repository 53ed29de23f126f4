"""Files that must not change while they are read."""

from collections.abc import Iterable
from pathlib import Path

from .._errors import InputError


class Unchanged:
    """What files were when they were opened, which tells whether they are still the same.

    Readers read a frame when it is asked for. If a file is written anew meanwhile, its first frames
    are the old ones and its last ones the new ones, and nothing else would say so.
    """

    def __init__(self, files: Iterable[Path]) -> None:
        """Looks at the files."""
        self._identities = {file: _identity(file) for file in files}

    def check(self, files: Iterable[Path] | None = None) -> None:
        """Raises an error if a file, of all by default, is not what it was.

        One that was removed is no error: what is still read of it is old.
        """
        for file in self._identities if files is None else files:
            found = _identity(file)
            if found is not None and found != self._identities[file]:
                raise InputError("was changed while it was read; read it again", file=file)


def _identity(file: Path) -> tuple[int, int, int, int] | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
