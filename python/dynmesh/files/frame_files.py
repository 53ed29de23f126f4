"""Code that all formats with one file per frame share."""

import os
from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from .._errors import naming
from ..attributes import ATTRIBUTES, flags_of
from ..polygons import Polygons, as_polygons, split_polygons
from .format import HOLDS_FACES, OTHER_MESHES, Gaps, Template, find_template
from .frame import Frame
from .header import Header, MeshFile, Metadata
from .new_output import exchange, unfinished_folder
from .numbered import FrameNames, find_files, names_to_write, numbered_like
from .reader import Reader
from .times import frame_numbers, numbers_of_files, timing_of
from .writer import Writer


class FramesReader(Reader):
    """A sequence in one file per frame.

    The first file determines what all files must have: the number of vertices, and the same faces
    or none, since scanners write only points. The up axis and the unit are taken from it alone. A
    subclass reads one file.
    """

    suffix: ClassVar[str]

    def __init__(self, path: Path, *, faces: Template | None = None, gaps: Gaps = "refuse") -> None:
        """Finds the files and reads the first, for which `faces` are if it holds none."""
        self._files, numbers = find_files(path, self.suffix, gaps)
        n_frames, present = len(self._files), [file for file in self._files if file is not None]
        self._first = present[0]
        with naming(self._first):
            frame, polygons, metadata = self._load(self._first)
            k = len(frame.points)
            if k == 0:
                raise ValueError("has no vertices")
            if len(polygons.sizes) == 0:
                template = find_template(faces, k, {})
                polygons = as_polygons(template.faces, template.polygons)
            elif faces is not None:
                raise ValueError(HOLDS_FACES)
            self._polygons = polygons
            triangles, polygons_or_none = split_polygons(polygons)
            header = Header(
                faces=triangles,
                n_frames=n_frames,
                n_vertices=k,
                dtype=frame.points.dtype,
                polygons=polygons_or_none,
                mesh_file=MeshFile.of(self._first, self._held_beside(self._first)),
                **timing_of(numbers),
                **metadata._asdict(),
                **flags_of(frame.attributes()),
            )
        lost = frozenset(number for number, file in enumerate(self._files) if file is None)
        super().__init__(path, header, present, lost)

    @abstractmethod
    def _load(self, file: Path) -> tuple[Frame, Polygons, Metadata]:
        """Reads one file; without polygons if the file holds only points."""

    @abstractmethod
    def _held_beside(self, file: Path) -> set[str]:
        """Returns what a file holds beside positions, polygons and attributes, in words."""

    def _frames(self, numbers: range) -> Iterator[Frame]:
        for number in numbers:
            file = self._files[number]
            if file is None:
                yield self._lost_frame()
                continue
            with naming(file):
                frame, polygons, metadata = self._load(file)
                self._compare(frame, polygons, metadata)
            yield replace(frame, points=frame.points.astype(self.dtype, copy=False))

    def _lost_frame(self) -> Frame:
        """A frame in which nothing was observed."""
        k = self.n_vertices
        attributes: dict[str, Any] = {
            name: np.full(k, row.absent, row.dtype) for name, row in self.header.attributes.items()
        }
        return Frame(np.full((k, 3), np.nan, self.dtype), **attributes)

    def _compare(self, frame: Frame, polygons: Polygons, metadata: Metadata) -> None:
        """Raises an error unless a frame matches the first one."""
        first = self._first.name
        n_vertices, n_faces = len(frame.points), len(polygons.sizes)
        if n_vertices != self.n_vertices:
            raise ValueError(
                f"has {n_vertices} vertices, but {first} has {self.n_vertices}; {OTHER_MESHES}"
            )
        if n_faces not in (0, len(self._polygons.sizes)):
            raise ValueError(f"has {n_faces} faces, but {first} has {len(self._polygons.sizes)}")
        if n_faces and not all(map(np.array_equal, polygons, self._polygons)):
            raise ValueError(f"its {n_faces} faces are not those of {first}")
        if not np.can_cast(frame.points.dtype, self.dtype):
            raise ValueError(f"its positions are {frame.points.dtype}, but {self.dtype} in {first}")
        found = frame.attributes()
        for name, row in ATTRIBUTES.items():
            wanted = name in self.header.attributes
            if (name in found) != wanted:
                raise ValueError(f"has {'no ' if wanted else ''}{row.what}, unlike {first}")
        ours, theirs = metadata.standard_error_of, self.header.standard_error_of
        if self.header.has_standard_error and ours != theirs:
            raise ValueError(f"has standard errors of the {ours}, but {first} of the {theirs}")


class FramesWriter(Writer):
    """A sequence that is being written, one file per frame.

    The files are numbered as :func:`numbers_of_files` says. A subclass writes one file.
    """

    suffix: ClassVar[str]

    def __init__(self, path: Path, header: Header, **options: Any) -> None:
        """See :class:`Writer`."""
        self._names = self._names_of(path)
        self._numbers = numbers_of_files(header, self._names)
        super().__init__(path, header, **options)

    @classmethod
    def _names_of(cls, path: Path) -> FrameNames:
        return names_to_write(path, cls.suffix)

    @classmethod
    def existing(cls, path: Path) -> list[Path]:
        """Returns the frames that exist."""
        return [*cls._names_of(path).existing().values()]

    @property
    def mesh_file(self) -> Path | None:
        """The file of the same format that holds more than positions and faces, if there is one."""
        source = self.header.mesh_file
        return source.path if source and source.path.suffix.lower() == self.suffix else None

    @abstractmethod
    def _save(self, file: Path, frame: Frame) -> None:
        """Writes one file."""

    def _begin(self) -> None:
        if self._names.numbered and self._numbers != frame_numbers(self.header).tolist():
            told = "its frames, which are read back as other ones or as gaps"
            self.remarks.append(f"the files are numbered from 0, not with the numbers of {told}")
        if self.header.n_frames > 1 and not self._names.numbered:
            names = numbered_like(self.path.name) or f"{self.path.stem}_%04d{self.path.suffix}"
            raise ValueError(f"one file holds one frame, not {self.header.n_frames}: write {names}")
        if self._names.folder.exists() and not self._names.folder.is_dir():
            raise ValueError(f"{self._names.folder} exists and is not a folder")
        if len(self.header.faces) == 0:
            raise ValueError("the sequence has no faces, which the first file needs")

    def _append(self, frame: Frame) -> None:
        self._save(self.folder / self._names.name(self._numbers[self._frame]), frame)

    def _close(self) -> None:
        pass

    def _made(self) -> Path:
        """The real folder of the frames, if renaming it is possible and moves nobody else's work.

        Nothing that is in the folder matters here, so that all runs look for the same lock.
        """
        if not self._names.numbered:
            return self.path
        folder = Path(os.path.realpath(self._names.folder))
        if folder.exists() and (
            folder.is_mount()
            or not os.access(folder.parent, os.W_OK)
            or Path.cwd().is_relative_to(folder)
        ):
            return folder / self._names.pattern
        return folder

    def _place(self) -> None:
        """Exchanges the folder as a whole, unless it has other files, or else moves the frames."""
        folder = Path(os.path.realpath(self._names.folder))
        others = folder.iterdir() if folder.exists() else ()
        if self.folder.parent == unfinished_folder(folder) and all(
            self._names.number(file.name) is not None for file in others
        ):
            exchange(self.folder, folder)
        else:
            super()._place()

    def _destinations(self) -> dict[str, Path]:
        names = map(self._names.name, self._numbers)
        return {name: self._names.folder / name for name in names}

    def _outdated(self) -> list[Path]:
        """Returns all files of an older sequence with the same pattern."""
        new = set(self._numbers)
        return [file for number, file in self._names.existing().items() if number not in new]
