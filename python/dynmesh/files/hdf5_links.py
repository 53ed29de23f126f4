"""The datasets of an HDF5 file, and of the files in its folder that it refers to.

A file can name any other as the place of its data: by external links, as sources of virtual
datasets, and as raw storage. HDF5 by itself follows all of them wherever they lead. Here links and
sources are followed in the file's own folder and below it, and not by symbolic links, for which
HDF5 and this module might mean different files. Raw storage, which is any bytes of any file, is
refused.
"""

import contextlib
import os
from pathlib import Path
from typing import Any

most_links = 32
"""How many links may be followed to one object."""


class Hdf5Tree:
    """An HDF5 file with what it refers to.

    Attributes:
        root: the file itself.
    """

    def __init__(self, h5py: Any, path: Path, **options: Any) -> None:
        """Opens the file; `options` are h5py's."""
        self._h5py = h5py
        self._options = options
        self._stack = contextlib.ExitStack()
        self._open: dict[Path, Any] = {}
        self._own = path.resolve()
        self.root = self._file(self._own)

    @property
    def files(self) -> list[Path]:
        """What was opened so far, the file itself first."""
        return [*self._open]

    @property
    def size(self) -> int:
        """How many bytes these files have."""
        return sum(path.stat().st_size for path in self._open)

    def has(self, name: str) -> bool:
        """Whether the root has an entry of that name, wherever it leads."""
        group = self.root["/"]
        return bool(group.id.links.exists(name.encode()))

    def find(self, name: str) -> Any:
        """The object of that name, with data that are all in the file or its folder.

        Raises:
            ValueError: it is not there, or they are not.
        """
        path, found = self._follow(self._own, name.encode())
        self._check_data(path, found, {})
        return found

    def close(self) -> None:
        """Closes all files."""
        self._stack.close()

    def _file(self, path: Path) -> Any:
        if path not in self._open:
            file = self._h5py.File(path, "r", **self._options)
            self._open[path] = self._stack.enter_context(file)
        return self._open[path]

    def _follow(self, path: Path, name: bytes) -> tuple[Path, Any]:
        """The object of that name in a file, and the file that it is in."""
        h5l = self._h5py.h5l
        found = self._file(path)["/"]
        target, parts = name, _parts(name)
        followed = 0
        while parts:
            part = parts.pop()
            if not isinstance(found, self._h5py.Group) or not found.id.links.exists(part):
                place = f"{os.fsdecode(target)!r} in {path.name}"
                raise ValueError(f"leads to {place}, but there is nothing")
            kind = found.id.links.get_info(part).type
            if kind == h5l.TYPE_HARD:
                found = found[part]
                continue
            followed += 1
            if followed > most_links:
                raise ValueError("leads in a circle, or from link to link without end")
            if kind == h5l.TYPE_EXTERNAL:
                file, target = found.id.links.get_val(part)
                path = self._beside(path, file)
                found = self._file(path)["/"]
            elif kind == h5l.TYPE_SOFT:
                target = found.id.links.get_val(part)
                if target.startswith(b"/"):
                    found = self._file(path)["/"]
            else:
                raise ValueError(f"{os.fsdecode(part)!r} is a link of an unknown kind, {kind}")
            parts += _parts(target)
        return path, found

    def _beside(self, path: Path, name: bytes) -> Path:
        """The file of that name, which `path` refers to."""
        named = os.fsdecode(name)
        wanted = Path(os.path.normpath(path.parent / named))
        found = wanted.resolve()
        if not found.is_relative_to(self._own.parent):
            raise ValueError(
                f"is in the file {named!r}, which is not read, as it is outside of "
                "the folder of the file that refers to it"
            )
        if found != wanted:
            raise ValueError(
                f"is in the file {named!r}, which is not read, as a symbolic link leads to it"
            )
        if not found.is_file():
            raise ValueError(f"is in the file {named!r}, which is no file in that folder")
        return found

    def _check_data(self, path: Path, found: Any, checked: dict[tuple[Path, int], bool]) -> None:
        """Refuses a dataset with data where they are not read from.

        `checked` has all virtual datasets on the way, and whether they are done.
        """
        if not isinstance(found, self._h5py.Dataset):
            return
        for name, *_ in found.external or []:
            raise ValueError(
                f"has its data in the file {name!r} as raw storage, which is not read: "
                "copy them into the HDF5 file"
            )
        if not found.is_virtual:
            return
        key = (path, self._h5py.h5o.get_info(found.id).addr)
        if key in checked:
            if not checked[key]:
                raise ValueError("leads in a circle: a virtual dataset is its own source")
            return
        checked[key] = False
        sources = {(source.file_name, source.dset_name) for source in found.virtual_sources()}
        for file, name in sorted(sources):
            if "%" in file + name:
                raise ValueError(
                    f"is in files that a pattern names, {file!r} with {name!r}, which are not read"
                )
            other = path if file == "." else self._beside(path, os.fsencode(file))
            self._check_data(*self._follow(other, name.encode()), checked)
        checked[key] = True


def _parts(name: bytes) -> list[bytes]:
    """The names of a path, the last one first."""
    return [part for part in reversed(name.split(b"/")) if part not in (b"", b".")]
