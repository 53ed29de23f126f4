"""An Alembic archive that is being written, with disk space reserved before each write."""

import os
from pathlib import Path
from typing import Any

from .alembic_archive import library, translating

_SAMPLE, _PROPERTY, _OBJECT = 24, 1 << 9, 1 << 10
"""Bytes of the index at the end of the archive, at most, for each of these."""

_AROUND = 64
"""Bytes that are written with each sample besides its values, at most."""

_STEP = 1 << 20
"""Bytes that are reserved at once, since asking the system takes longer than a small write."""


class OutputArchive:
    """An archive to which objects, properties and samples are added.

    The library ends the process if the system refuses a write while it closes an archive.
    Therefore, room for the index at the end is kept all the time.

    Attributes:
        top: the root object.
    """

    def __init__(self, path: Path, fps: float | None, description: str) -> None:
        """Creates the file, with its frames per second, or None, and a description for users."""
        self._file = path.open("w+b")
        self._index = 1 << 16
        self._granted = -1
        self._archive: Any = None
        self.reserve(0)
        rate = () if fps is None else (fps,)
        with translating(OSError, "cannot be written"):
            self._archive = library("Abc").CreateArchiveWithInfo(
                self._file.name, *rate, "dynmesh", description
            )
        self.top = self._archive.getTop()

    def sampling(self, sampling: Any) -> int:
        """Returns the number of this time sampling in the archive, to which it is added."""
        return int(self._archive.addTimeSampling(sampling))

    def make(self, kind: str, parent: Any, name: str) -> Any:
        """Adds an object of this class of the library."""
        self.reserve(0, index=_OBJECT + 8 * _PROPERTY)
        with translating(OSError, "cannot be written"):
            return getattr(library("AbcGeom"), kind)(parent, name)

    def set(self, schema: Any, sample: Any, size: int) -> None:
        """Adds a sample with that many bytes to a schema or to a geometry parameter."""
        self.reserve(8 * _AROUND + size, index=8 * _SAMPLE)
        with translating(OSError, "cannot be written"):
            schema.set(sample)

    def parameter(
        self, kind: str, parent: Any, name: str, scope: Any, metadata: Any, sampling: int
    ) -> Any:
        """Adds a geometry parameter of this class of the library, with one value in its scope."""
        self.reserve(0, index=_PROPERTY)
        # They refer to the values, which stay alive here.
        wrapped = map(library("Abc").Argument, (metadata, sampling))
        with translating(OSError, "cannot be written"):
            return getattr(library("AbcGeom"), kind)(parent, name, False, scope, 1, *wrapped)

    def reserve(self, size: int, *, index: int = 0) -> None:
        """Raises OSError if the disk has no room for this many bytes and the end of the archive.

        The index at the end grows by `index` bytes.
        """
        self._index += index
        self._granted -= size + index
        if self._granted < 0:
            self._reserve(size + _STEP)
            self._granted = _STEP

    def _reserve(self, size: int) -> None:
        file = self._file.fileno()
        end = os.fstat(file).st_size
        try:
            os.posix_fallocate(file, end, size + self._index)
        finally:
            os.ftruncate(file, end)

    def finish(self) -> None:
        """Completes the file; all other references to its objects must be gone."""
        self._reserve(0)
        self.top = self._archive = None
        self._file.close()

    def abandon(self) -> None:
        """Closes an unfinished file; all other references to its objects must be gone."""
        if self._archive is not None:
            os.ftruncate(self._file.fileno(), 0)  # frees the space for what Alembic writes now
            self.top = self._archive = None
        self._file.close()
