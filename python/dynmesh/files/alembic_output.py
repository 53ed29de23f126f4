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

    def __init__(
        self, path: Path, fps: float | None, description: str, metadata: Any = None
    ) -> None:
        """Creates the file, with the frames per second of the program that wrote it, or None.

        The description is for users; the metadata are the library's.
        """
        self._file = path.open("w+b")
        self._index = 1 << 16
        self._granted = -1
        self._archive: Any = None
        self.reserve(0)
        rate = () if fps is None else (fps,)
        more = () if metadata is None else (library("Abc").Argument(metadata),)
        with translating(OSError, "cannot be written"):
            self._archive = library("Abc").CreateArchiveWithInfo(
                self._file.name, *rate, "dynmesh", description, *more
            )
        self.top = self._archive.getTop()

    def sampling(self, sampling: Any) -> int:
        """Returns the number of this time sampling in the archive, to which it is added."""
        return int(self._archive.addTimeSampling(sampling))

    def object(self, parent: Any, name: str, metadata: Any) -> Any:
        """Adds an object."""
        self.reserve(0, index=_OBJECT)
        with translating(OSError, "cannot be written"):
            return library("Abc").OObject(parent, name, library("Abc").Argument(metadata))

    def make(self, kind: str, parent: Any, name: str) -> Any:
        """Adds an object of this class of the library."""
        self.reserve(0, index=_OBJECT + 8 * _PROPERTY)
        with translating(OSError, "cannot be written"):
            return getattr(library("AbcGeom"), kind)(parent, name)

    def add(self, prop: Any, value: Any) -> None:
        """Adds a sample to a property.

        Raises:
            TypeError: the library cannot write such values.
            OSError: the disk is full.
        """
        self.reserve(_AROUND + _size(value, prop.getDataType().getNumBytes()), index=_SAMPLE)
        with translating(OSError, "cannot be written"):
            try:
                prop.setValue(value)
            except RuntimeError as error:
                if "Unhandled type" in str(error):
                    raise TypeError(str(error)) from error
                raise

    def set(self, schema: Any, sample: Any, size: int) -> None:
        """Adds a sample with that many bytes to a schema or to a geometry parameter."""
        self.reserve(8 * _AROUND + size, index=8 * _SAMPLE)
        with translating(OSError, "cannot be written"):
            schema.set(sample)

    def property(
        self,
        kind: str,
        parent: Any,
        name: str,
        *arguments: Any,
        metadata: Any = None,
        sampling: int | None = None,
    ) -> Any:
        """Adds a property of this class of the library, which takes further arguments."""
        self.reserve(0, index=_PROPERTY)
        given = [value for value in (metadata, sampling) if value is not None]
        wrapped = map(library("Abc").Argument, given)  # refer to the values, which stay alive here
        with translating(OSError, "cannot be written"):
            module = library("AbcGeom" if "Geom" in kind else "Abc")
            return getattr(module, kind)(parent, name, *arguments, *wrapped)

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


def metadata_of(thing: Any) -> Any:
    """Returns a copy of the metadata of an object, a property or a header."""
    return library("AbcCoreAbstract").MetaData(thing.getMetaData())


def _size(value: Any, item: int) -> int:
    """Returns the number of bytes of a sample, at most, if those of an item are known."""
    if isinstance(value, str):
        return 4 * len(value) + 1
    if not hasattr(value, "__len__"):
        return item
    if len(value) and isinstance(value[0], str):
        return sum(4 * len(text) + 1 for text in value)
    return item * len(value)
