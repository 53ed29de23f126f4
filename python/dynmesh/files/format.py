"""A file format: its name, its reader and its writer."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..polygons import Polygons
from .comments import Said
from .reader import Reader
from .writer import Writer


@dataclass(frozen=True, eq=False)
class Template:
    """A mesh that lends its faces to a file that has none."""

    faces: NDArray[np.integer[Any]]
    polygons: Polygons | None
    n_vertices: int | None
    """None where only faces were given."""
    said: Said = field(default_factory=Said)
    files: tuple[Path, ...] = ()
    """Those that it was read from."""


def template_of(reader: Reader) -> Template:
    """The mesh that is read, to lend its faces."""
    header = reader.header
    said = Said(header.up_axis, header.metres_per_unit)
    return Template(header.faces, header.polygons, header.n_vertices, said, tuple(reader.files))


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes:
        name: by which people choose it, as "npz".
        suffixes: of file names, in lower case, as ".npz".
        what: one line for people.
        reader: makes a reader of a path, a template for its faces or None, and the name of one mesh
            among others or None.
        writer: makes a writer; None where the format is only read.
        takes: what its reader takes beside the path: "faces", from elsewhere; "prim", the name of
            one mesh among others.
        library: the module that its reader and its writer need, and the extra that installs it;
            None where they need none.
    """

    name: str
    suffixes: tuple[str, ...]
    what: str
    reader: Callable[[Path, Template | None, str | None], Reader]
    writer: type[Writer] | None
    takes: frozenset[str] = frozenset()
    library: tuple[str, str] | None = None


def refuse_template(template: Template | None) -> None:
    """For formats with faces of their own."""
    if template is not None:
        raise ValueError("has faces of its own; faces from elsewhere are for .npy, .pc2 and .mdd")


def refuse_mesh_name(prim: str | None) -> None:
    """For formats that hold one mesh only."""
    if prim is not None:
        raise ValueError("holds one mesh; a prim is named in USD and Alembic files only")
