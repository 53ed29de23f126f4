"""What all formats with one file per frame share."""

from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np

from .._errors import InputError, naming
from ..frame import Frame, Frames, Indices
from ..header import ATTRIBUTES, Header, Origin
from ..polygons import Polygons, as_polygons, split_polygons
from ..stored import FileFrames
from .format import HOLDS_FACES, OTHER_MESHES, Gaps, Template, find_template
from .names import find_files, names_to_write, numbers_in
from .text import Metadata
from .times import numbers_of_files, timing_of

IN_FILES = frozenset({"polygons", "up_axis", "metres_per_unit", "start", "times"})
"""What these formats keep, in each file or as its number."""


class Loaded(NamedTuple):
    """The content of one file."""

    frame: Frame
    polygons: Polygons
    """None of them if the file holds only points."""
    metadata: Metadata
    further: set[str]
    """What the file holds beside these, in words."""


class FilePerFrame(FileFrames):
    """A sequence in one file per frame.

    The first file determines what all files must have: the number of vertices, and the same faces
    or none, since scanners write only points. The up axis and the unit are taken from it alone. A
    subclass reads one file.
    """

    suffix: ClassVar[str]

    def __init__(self, path: Path, *, faces: Template | None = None, gaps: Gaps = "refuse") -> None:
        found = find_files(path, self.suffix, gaps)
        self._files = found.files
        n_frames, present = len(self._files), [file for file in self._files if file is not None]
        self._first = present[0]
        with naming(self._first):
            frame, polygons, metadata, further = self._load(self._first)
            k = len(frame.points)
            if k == 0:
                raise InputError("has no vertices")
            if len(polygons.sizes) == 0:
                template = find_template(faces, k, {})
                polygons = as_polygons(template.faces, template.polygons)
            elif faces is not None:
                raise InputError(HOLDS_FACES)
            self._polygons = polygons
            triangles, polygons_or_none = split_polygons(polygons)
            header = Header(
                faces=triangles,
                n_frames=n_frames,
                n_vertices=k,
                dtype=frame.points.dtype,
                polygons=polygons_or_none,
                **timing_of(found.numbers),
                **metadata._asdict(),
                attributes=frame.attributes(),
            )
            origin = Origin.of(self._first, header, further)
        lost = frozenset(number for number, file in enumerate(self._files) if file is None)
        super().__init__(path, header, present, lost, origin)

    @abstractmethod
    def _load(self, file: Path) -> Loaded:
        """Reads one file."""

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        for number in numbers:
            file = self._files[number]
            if file is None:
                yield self._lost_frame()
                continue
            with naming(file):
                frame, polygons, metadata, _ = self._load(file)
                self._compare(frame, polygons, metadata)
            yield replace(frame, points=frame.points.astype(self.dtype, copy=False))

    def _compare(self, frame: Frame, polygons: Polygons, metadata: Metadata) -> None:
        first = self._first.name
        n_vertices, n_faces = len(frame.points), len(polygons.sizes)
        if n_vertices != self.n_vertices:
            raise InputError(
                f"has {n_vertices} vertices, but {first} has {self.n_vertices}; {OTHER_MESHES}"
            )
        if n_faces not in (0, len(self._polygons.sizes)):
            raise InputError(f"has {n_faces} faces, but {first} has {len(self._polygons.sizes)}")
        if n_faces and not all(map(np.array_equal, polygons, self._polygons)):
            raise InputError(f"its {n_faces} faces are not those of {first}")
        if not np.can_cast(frame.points.dtype, self.dtype):
            raise InputError(f"its positions are {frame.points.dtype}, but {self.dtype} in {first}")
        result = frame.attributes()
        for name, row in ATTRIBUTES.items():
            wanted = name in self.header.attributes
            if (name in result) != wanted:
                raise InputError(f"has {'no ' if wanted else ''}{row.what}, unlike {first}")
        ours, theirs = metadata.standard_error_of, self.header.standard_error_of
        if self.header.has_standard_error and ours != theirs:
            raise InputError(f"has standard errors of the {ours}, but {first} of the {theirs}")


def write_frames(
    path: Path,
    header: Header,
    frames: Iterable[Frame],
    save: Callable[[Path, Frame], None],
) -> list[str]:
    """Writes one file per frame, which are numbered as :func:`numbers_of_files` says.

    Args:
        path: the pattern of the names, or the file of a single frame.
        header: of the frames.
        frames: in their order.
        save: writes one file.
    """
    names = names_to_write(path, path.suffix)
    numbers = numbers_of_files(header, names)
    if header.n_frames > 1 and not names.numbered:
        pattern = numbers_in([Path(path.name)])[1] or f"{path.stem}_%04d{path.suffix}"
        raise InputError(f"one file holds one frame, not {header.n_frames}: write {pattern}")
    if len(header.faces) == 0:
        raise InputError("the sequence has no faces, which the first file needs")
    for number, frame in zip(numbers, frames, strict=True):
        save(path.with_name(names.name(number)), frame)
    if not names.numbered or numbers == header.numbers.tolist():
        return []
    return [
        "the files are numbered from 0, not with the numbers of its frames, which are read back as "
        "other ones or as gaps"
    ]


def mesh_file_of(frames: Frames, suffix: str) -> Path | None:
    """The file of a format that holds more than positions and faces, if it is as it was read."""
    source = frames.own_origin
    if source is None or source.path.suffix.lower() != suffix:
        return None
    return source.path if source.is_unchanged else None
