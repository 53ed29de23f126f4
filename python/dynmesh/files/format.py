"""File formats: their names, readers and writers."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..frames.reader import Reader
from ..frames.scenes import Scene
from ..polygons import Polygons
from .comments import Metadata
from .writer import Writer

Gaps: TypeAlias = Literal["refuse", "lost"]
"""What becomes of frames whose file is missing: an error, or frames without observations."""


@dataclass(frozen=True, eq=False)
class Template:
    """A mesh that provides the faces of a file without faces."""

    faces: NDArray[np.integer[Any]]
    polygons: Polygons | None
    n_vertices: int | None
    """None if only faces were given."""
    metadata: Metadata = field(default_factory=Metadata)
    files: tuple[Path, ...] = ()
    """Those that it was read from."""


def template_of(reader: Reader) -> Template:
    """The mesh that is read to provide its faces."""
    header = reader.header
    metadata = Metadata(header.up_axis, header.metres_per_unit)
    return Template(header.faces, header.polygons, header.n_vertices, metadata, tuple(reader.files))


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes:
        name: by which users choose the format, such as "npz".
        suffixes: of file names, in lower case, such as ".npz".
        what: a description in one line.
        reader: creates a reader from a path, a template for its faces or None, and the path of the
            mesh or None.
        writer: creates a writer; None if the format can only be read.
        takes: what the reader accepts besides the path: "faces", from elsewhere; "prim", the path
            of one mesh among several.
        library: the module that the reader and the writer need, and the extra that installs it;
            None if they need none.
        reader_with_gaps: as `reader`, for sequences in which the files of some frames are missing;
            None if a file holds all frames.
        scene: opens a file with all its meshes; None if a file holds a single mesh.
        mesh_reader: creates a reader of one mesh of an open scene, by its path.
        overlay: creates a layer that changes nothing but the meshes of a scene; None if the format
            has no layers.
    """

    name: str
    suffixes: tuple[str, ...]
    what: str
    reader: Callable[[Path, Template | None, str | None], Reader]
    writer: type[Writer] | None
    takes: frozenset[str] = frozenset()
    library: tuple[str, str] | None = None
    reader_with_gaps: Callable[[Path, Template | None, str | None], Reader] | None = None
    scene: Callable[[Path], Scene] | None = None
    mesh_reader: Callable[[Any, str], Reader] | None = None
    overlay: type[Writer] | None = None


def refuse_template(template: Template | None) -> None:
    """Refuses a template for formats that hold faces."""
    if template is not None:
        raise ValueError("holds its faces; faces can be given only for files that hold none")


def refuse_mesh_name(prim: str | None) -> None:
    """Refuses a prim for formats that hold a single mesh."""
    if prim is not None:
        raise ValueError("holds a single mesh; prim is only for USD and Alembic")


def with_gaps(format: Format) -> Callable[[Path, Template | None, str | None], Reader]:
    """Returns what opens a sequence in which the files of some frames are missing."""
    if format.reader_with_gaps is None:
        raise ValueError(
            f"gaps is for sequences with one file per frame, not for {format.name}; mark vertices "
            "that were not observed as missing"
        )
    return format.reader_with_gaps
