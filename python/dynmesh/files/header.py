"""The header of a sequence, which describes all frames."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from .._checks import check_array, check_integer
from ..attributes import ATTRIBUTES, Flags, flags_of
from ..sequence import (
    Description,
    Sequence,
    StandardErrorOf,
    check_corners,
    check_errors_of,
    check_faces,
    check_vertices,
)


@dataclass(frozen=True)
class MeshFile:
    """A file which holds more around a mesh than dynmesh reads.

    Attributes:
        path: of the file.
        holds: what it holds beside positions and faces, such as "texture coordinates".
    """

    path: Path
    holds: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Header(Description, Flags):
    """The properties that all frames of a file share.

    Attributes:
        faces: (m, 3) integers, triangles; or other polygons, as of a Sequence.
        n_frames: n.
        n_vertices: k.
        dtype: of the positions, float32 or float64.
        mesh_file: from which files of the same format, or layers over it, keep what it holds, or
            None.
        subdivision: the subdivision scheme that a USD stage states, or None.

    `has_known`, `has_provenance` and `has_standard_error` say which attributes each frame has. They
    and the attributes of :class:`dynmesh.Description`, from `fps` to `standard_error_of`, are
    keywords as well.

    Raises:
        TypeError, ValueError: an attribute is of the wrong kind or shape.
    """

    faces: NDArray[np.integer[Any]]
    n_frames: int
    n_vertices: int
    dtype: np.dtype[Any]
    mesh_file: MeshFile | None = None
    subdivision: str | None = None

    def __post_init__(self) -> None:
        """Raises an error unless the properties are consistent."""
        check_integer("n_frames", self.n_frames, 0)
        check_integer("n_vertices", self.n_vertices, 0)
        self._take_faces(self.n_vertices)
        check_array("faces", self.faces)
        object.__setattr__(self, "dtype", np.dtype(self.dtype))  # float is a dtype to numpy
        check_vertices(self.dtype, (self.n_frames, self.n_vertices, 3))
        check_faces(self.faces.dtype, self.faces.shape)
        check_corners(self.faces, self.n_vertices)
        for row in self.attributes.values():
            for needed in row.needs:
                if not getattr(self, flag := ATTRIBUTES[needed].flag):
                    raise ValueError(f"{row.flag}: requires {flag}")
        self._check_description(self.n_frames)


def errors_of(text: str | None) -> StandardErrorOf:
    """What a file says that its standard errors are of; files that say nothing hold positions.

    Raises:
        ValueError: it is none of the possible values.
    """
    if text is None:
        return "position"
    check_errors_of(text)
    return cast(StandardErrorOf, text)


def header_of(sequence: Sequence) -> Header:
    """What a file would say of the sequence."""
    n_frames, n_vertices, _ = sequence.vertices.shape
    return Header(
        sequence.faces,
        n_frames,
        n_vertices,
        sequence.vertices.dtype,
        **flags_of(sequence.attributes()),
        **sequence.described(),
    )
