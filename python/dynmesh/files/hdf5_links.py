"""The datasets of an HDF5 file, including those in files of its folder that it refers to.

A file can refer to any other file: by external links, as sources of virtual datasets, and as raw
storage. HDF5 follows all of them to any location. Here, links and sources are followed only within
the folder of the file and its subfolders, and not through symbolic links, which HDF5 and this
module might resolve differently. Raw storage, which can be any bytes of any file, is refused.
"""

import contextlib
import os
from pathlib import Path
from typing import Any

most_links = 32
"""The largest number of links that may lead to one object."""


class Hdf5Tree:
    """An HDF5 file with the files that it refers to.

    Attributes:
        root: the file itself.
    """

    def __init__(self, h5py: Any, path: Path, **options: Any) -> None:
        """Opens the file; `options` are passed to h5py."""
        self._h5py = h5py
        self._options = options
        self._stack = contextlib.ExitStack()
        self._open: dict[Path, Any] = {}
        self._own = path.resolve()
        self.root = self._file(self._own)

    @property
    def files(self) -> list[Path]:
        """The files opened so far, starting with the file itself."""
        return [*self._open]

    @property
    def size(self) -> int:
        """The total size of these files in bytes."""
        return sum(path.stat().st_size for path in self._open)

    def has(self, name: str) -> bool:
        """Whether the root group has an entry of that name, even if its link is broken."""
        group = self.root["/"]  # its links can be asked for while it exists
        return bool(group.id.links.exists(name.encode()))

    def find(self, name: str) -> Any:
        """Returns the object of that name, whose data must be in the file or its folder.

        Raises:
            ValueError: the object does not exist, or some of its data are elsewhere.
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
        """Returns the object of that name in a file, and the file that contains it."""
        h5l = self._h5py.h5l
        found = self._file(path)["/"]
        target, parts = name, _parts(name)
        followed = 0
        while parts:
            part = parts.pop()
            if not isinstance(found, self._h5py.Group) or not found.id.links.exists(part):
                place = f"{os.fsdecode(target)!r} in {path.name}"
                raise ValueError(f"leads to {place}, which does not exist")
            kind = found.id.links.get_info(part).type
            if kind == h5l.TYPE_HARD:
                found = found[part]
                continue
            followed += 1
            if followed > most_links:
                raise ValueError("leads in a circle, or through too many links")
            if kind == h5l.TYPE_EXTERNAL:
                file, target = found.id.links.get_val(part)
                path = self._beside(path, file)
                found = self._file(path)["/"]
            elif kind == h5l.TYPE_SOFT:
                target = found.id.links.get_val(part)
                if target.startswith(b"/"):
                    found = self._file(path)["/"]
            else:
                raise ValueError(f"{os.fsdecode(part)!r} is a link of the unknown kind {kind}")
            parts += _parts(target)
        return path, found

    def _beside(self, path: Path, name: bytes) -> Path:
        """Returns the file of that name, which `path` refers to."""
        named = os.fsdecode(name)
        wanted = Path(os.path.normpath(path.parent / named))
        found = wanted.resolve()
        why = None
        if not found.is_relative_to(self._own.parent):
            why = "is not read because it is outside of the folder of the file that refers to it"
        elif found != wanted:
            why = "is not read because it is or contains a symbolic link"
        elif not found.is_file():
            why = "does not exist in that folder"
        if why is not None:
            raise ValueError(f"is in the file {named!r}, which {why}")
        return found

    def _check_data(self, path: Path, found: Any, checked: dict[tuple[Path, int], bool]) -> None:
        """Raises an error for a dataset with data in places that are not read.

        `checked` maps the virtual datasets visited so far to whether their check is complete.
        """
        if not isinstance(found, self._h5py.Dataset):
            return
        for name, *_ in found.external or []:
            raise ValueError(
                f"has its data in the file {name!r} as raw storage, which is not read; "
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
                    f"has its data in files with the pattern {file!r}, {name!r}, which are not read"
                )
            other = path if file == "." else self._beside(path, os.fsencode(file))
            self._check_data(*self._follow(other, name.encode()), checked)
        checked[key] = True


def _parts(name: bytes) -> list[bytes]:
    """Returns the parts of a path, the last one first."""
    return [part for part in reversed(name.split(b"/")) if part not in (b"", b".")]
