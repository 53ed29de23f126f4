"""The header of a sequence, which describes all frames, and how comments in files state it."""

import contextlib
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._checks import check_array, check_integer
from .._errors import InputError
from .._report import listed
from ..attributes import ATTRIBUTES, Flags
from ..polygons import as_polygons
from ..sequence import Description, StandardErrorOf, check_corners, check_faces, check_vertices

TEXTURE = "texture coordinates"
"""How messages call them."""


@dataclass(frozen=True)
class MeshFile:
    """A file which holds more around a mesh than dynmesh reads.

    Attributes:
        path: of the file.
        holds: what it holds beside positions and faces, such as "texture coordinates".
    """

    path: Path
    holds: tuple[str, ...]

    @classmethod
    def of(cls, path: Path, holds: Iterable[str]) -> "MeshFile | None":
        """Describes a file, unless it holds nothing more."""
        found = tuple(sorted(holds))
        return cls(path, found) if found else None


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
        moved_by: what moves the mesh beside its points, such as "a skeleton", and is not read.
        subdivision: the subdivision scheme that a USD stage states, or None.
        texture: (c, 2) float32, the texture coordinates of each corner of the polygons, one polygon
            after another, if USD or Alembic state them; or None.

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
    moved_by: tuple[str, ...] = ()
    subdivision: str | None = None
    texture: NDArray[np.float32] | None = None

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
        if self.texture is not None:
            check_array("texture", self.texture)
            expected = (len(as_polygons(self.faces, self.polygons).corners), 2)
            if self.texture.shape != expected:
                told = f"must have shape {expected} to match corners, not {self.texture.shape}"
                raise InputError(told, argument="texture")
        for row in self.attributes.values():
            for needed in row.needs:
                if not getattr(self, flag := ATTRIBUTES[needed].flag):
                    raise ValueError(f"{row.flag}: requires {flag}")
        self._check_description(self.n_frames)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What of the motion is not read, for the user."""
        if not self.moved_by:
            return ()
        told = f"the mesh is moved by {listed(self.moved_by)}, which dynmesh does not read"
        return (f"{told}; bake its points, unless their own motion is meant",)


class Metadata(NamedTuple):
    """The content of the comments, named like the fields of a header."""

    up_axis: str | None = None
    metres_per_unit: float | None = None
    standard_error_of: StandardErrorOf = "position"


def comments_of(header: Header) -> list[str]:
    """Returns the comment lines for a header."""
    metadata: dict[str, Any] = Metadata(header.up_axis, header.metres_per_unit)._asdict()
    metadata["standard_error_of"] = header.standard_error_of if header.has_standard_error else None
    return [f"{name} {value}" for name, value in metadata.items() if value is not None]


def metadata_in(comments: Iterable[str]) -> Metadata:
    """Parses comment lines, such as `up_axis z` or `metres_per_unit 0.01`; others are ignored."""
    metadata = Metadata()
    for comment in comments:
        match comment.split():
            case ["up_axis", "x" | "y" | "z" as axis]:
                metadata = metadata._replace(up_axis=axis)
            case ["metres_per_unit", word]:
                with contextlib.suppress(ValueError):
                    if 0 < (length := float(word)) < math.inf:
                        metadata = metadata._replace(metres_per_unit=length)
            case ["standard_error_of", "position" | "surface" as errors]:
                metadata = metadata._replace(standard_error_of=errors)
    return metadata
