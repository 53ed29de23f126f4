"""Code that all formats with one file per frame share."""

import contextlib
from abc import abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

import numpy as np

from ..polygons import Polygons, check_polygons, split_polygons
from .comments import Said
from .format import Template, refuse_mesh_name, refuse_template
from .header import Frame, Header
from .naming import naming
from .numbered import FrameNames, find_files, names_to_write
from .reader import Reader
from .times import Timing
from .writer import Writer


class FramesReader(Reader):
    """A sequence in one file per frame.

    The first file determines what all files must have: the number of vertices, and the same faces
        or
    none, since scanners write only points. The up axis and the unit are taken from it alone. A
    subclass reads one file.
    """

    def __init__(self, path: Path, files: list[Path], timing: Timing) -> None:
        """Reads the first file."""
        if not files:
            raise ValueError("does not name a file")
        self._files = files
        with naming(files[0]):
            frame, self._polygons, said = self._load(files[0])
            _check_first(len(frame.points), self._polygons)
        faces, polygons = split_polygons(self._polygons)
        header = Header(
            faces=faces,
            n_frames=len(files),
            n_vertices=len(frame.points),
            dtype=frame.points.dtype,
            polygons=polygons,
            **said._asdict(),
            **timing._asdict(),
            has_known=frame.known is not None,
            has_provenance=frame.generation is not None,
        )
        super().__init__(path, header)

    @property
    def files(self) -> list[Path]:
        """The files that are read."""
        return self._files

    @abstractmethod
    def _load(self, file: Path) -> tuple[Frame, Polygons, Said]:
        """Reads one file; without polygons if the file holds only points."""

    def _frames(self, numbers: range) -> Iterator[Frame]:
        for number in numbers:
            file = self._files[number]
            with naming(file):
                frame, polygons, _ = self._load(file)
                self._compare(frame, polygons)
            points = frame.points.astype(self.dtype, copy=False)
            yield Frame(points, frame.known, frame.generation, frame.age)

    def _compare(self, frame: Frame, polygons: Polygons) -> None:
        """Raises an error unless a frame matches the first one."""
        first = self._files[0].name
        n_vertices, n_faces = len(frame.points), len(polygons.sizes)
        if n_vertices != self.n_vertices:
            raise ValueError(f"has {n_vertices} vertices, but {first} has {self.n_vertices}")
        if n_faces not in (0, len(self._polygons.sizes)):
            raise ValueError(f"has {n_faces} faces, but {first} has {len(self._polygons.sizes)}")
        if n_faces and not all(map(np.array_equal, polygons, self._polygons)):
            raise ValueError(f"its {n_faces} faces are not those of {first}")
        if not np.can_cast(frame.points.dtype, self.dtype):
            raise ValueError(f"its positions are {frame.points.dtype}, but {self.dtype} in {first}")
        for name, values, wanted in (
            ("known masks", frame.known, self.has_known),
            ("generation and age", frame.generation, self.has_provenance),
        ):
            if (values is not None) != wanted:
                raise ValueError(f"has {'no ' if wanted else ''}{name}, unlike {first}")


class NumberedReader(FramesReader):
    """A sequence in numbered files, each of which holds one mesh with its faces."""

    suffix: ClassVar[str]

    def __init__(self, path: Path, template: Template | None, prim: str | None) -> None:
        """Finds the files and reads the first."""
        refuse_template(template)
        refuse_mesh_name(prim)
        files, start = find_files(path, self.suffix)
        super().__init__(path, files, Timing(None, start))


def _check_first(n_vertices: int, polygons: Polygons) -> None:
    if n_vertices == 0:
        raise ValueError("has no vertices")
    if len(polygons.sizes) == 0:
        raise ValueError("has only points, but the first frame needs faces")
    check_polygons(polygons)
    outside = np.flatnonzero((polygons.corners < 0) | (polygons.corners >= n_vertices))
    if len(outside):
        face = np.searchsorted(np.cumsum(polygons.sizes), outside[0], side="right")
        raise ValueError(
            f"face {face}: refers to vertex {polygons.corners[outside[0]]}, counted from 0, "
            f"but there are {n_vertices}"
        )


class FramesWriter(Writer):
    """A sequence that is being written, one file per frame.

    The files are numbered from `start` of the sequence, or from 0 if `start` is negative or
    fractional. A subclass writes one file.
    """

    resumable = True
    suffix: ClassVar[str]

    def __init__(
        self, path: Path, header: Header, *, folder: Path | None = None, resume_at: int = 0
    ) -> None:
        """See :class:`Writer`. Creates the folder of a pattern if it does not exist."""
        self._names = self._names_of(path)
        start = float(header.start)
        first = int(start) if self._names.numbered and start >= 0 and start.is_integer() else 0
        self._numbers = range(first, first + header.n_frames)
        self._made = self.new_folder(path)
        if self._made:
            self._made.mkdir()
        super().__init__(path, header, folder=folder, resume_at=resume_at)

    @classmethod
    def _names_of(cls, path: Path) -> FrameNames:
        return names_to_write(path, cls.suffix)

    @classmethod
    def new_folder(cls, path: Path) -> Path | None:
        """Returns the folder of a pattern if it does not exist."""
        names = cls._names_of(path)
        of_pattern = names.numbered and names.folder == path.parent
        return path.parent if of_pattern and not path.parent.exists() else None

    @classmethod
    def existing(cls, path: Path) -> list[Path]:
        """Returns the existing files that writing to `path` would replace."""
        return list(cls._names_of(path).existing().values())

    @abstractmethod
    def _save(self, file: Path, frame: Frame) -> None:
        """Writes one file."""

    def _begin(self, kept: int) -> None:
        if self.header.n_frames > 1 and not self._names.numbered:
            stem, suffix = self.path.stem, self.path.suffix
            raise ValueError(
                f"one file holds one frame, not {self.header.n_frames}: write {stem}_%04d{suffix}"
            )
        if self._names.folder.exists() and not self._names.folder.is_dir():
            raise ValueError(f"{self._names.folder} exists and is not a folder")
        if len(self.header.faces) == 0:
            raise ValueError("the sequence has no faces, which the first file needs")
        unfinished = FrameNames(self.folder, self._names.pattern).existing()
        for number in self._numbers[:kept]:
            if number not in unfinished:
                raise ValueError(f"the unfinished {self._names.name(number)} is missing")
        for number, file in unfinished.items():
            if number not in self._numbers[:kept]:
                file.unlink()

    def _append(self, frame: Frame) -> None:
        self._save(self.folder / self._names.name(self._numbers[self._frame]), frame)

    def _close(self) -> None:
        pass

    def _destinations(self) -> dict[str, Path]:
        names = map(self._names.name, self._numbers)
        return {name: self._names.folder / name for name in names}

    def _outdated(self) -> list[Path]:
        """Returns all files of an older sequence with the same pattern."""
        existing = self._names.existing().items()
        return [file for number, file in existing if number not in self._numbers]

    @contextlib.contextmanager
    def _undoing(self) -> Iterator[None]:
        try:
            with super()._undoing():
                yield
        finally:
            if self._made:
                with contextlib.suppress(OSError):  # the folder is not empty
                    self._made.rmdir()
