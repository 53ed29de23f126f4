"""Where a mesh comes from: what its file holds around it, which is no part of its frames."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

TEXTURE = "texture coordinates"
"""How messages call them."""


@dataclass(frozen=True)
class Origin:
    """The file of which a mesh was read, and what of it is not read as frames.

    A reader makes it, and it stays with the mesh through verbs and memory. A format then keeps what
    it can: texture coordinates, what a file of the same format holds, or a whole scene, over which
    another file lies. What is not kept is named when frames are written.

    Attributes:
        path: of the file.
        faces: (m, 3), the triangles of the mesh.
        n_vertices: their number.
        name: the path of the mesh in the file, or None.
        holds: what the file holds beside positions and faces, such as "texture coordinates".
        remarks: what is not read that moves or places the mesh, for the user.
        subdivision: the subdivision scheme that a USD stage states, or None.
        texture: (c, 2) float32, the texture coordinates of each corner of the polygons, one polygon
            after another, if USD or Alembic state them; or None.
        is_scene: whether another file can lie over this one.
        is_below: whether another file that is written shall lie over it.
        stamp: the size and the time of the file when it was read.
    """

    path: Path
    faces: NDArray[np.integer[Any]] = field(repr=False, compare=False)
    n_vertices: int
    name: str | None = None
    holds: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    subdivision: str | None = None
    texture: NDArray[np.float32] | None = field(default=None, repr=False, compare=False)
    is_scene: bool = False
    is_below: bool = False
    stamp: tuple[int, int] | None = None

    @classmethod
    def of(
        cls,
        path: Path,
        faces: NDArray[np.integer[Any]],
        n_vertices: int,
        holds: Iterable[str],
        **more: Any,
    ) -> "Origin | None":
        """Describes a file that has just been read; None if it holds and says nothing more."""
        held = tuple(sorted(holds))
        if not held and not any(map(more.get, ("remarks", "subdivision", "is_scene"))):
            return None
        return cls(path, faces, n_vertices, holds=held, stamp=_stamp_of(path), **more)

    def below(self) -> "Origin":
        """The same file, over which the file that is written shall lie, if that is possible."""
        return replace(self, is_below=self.is_scene)

    def has_mesh(self, faces: NDArray[np.integer[Any]], n_vertices: int) -> bool:
        """Whether this is its mesh; in memory, its faces may have been replaced."""
        return n_vertices == self.n_vertices and (
            faces is self.faces or np.array_equal(faces, self.faces)
        )

    @property
    def is_unchanged(self) -> bool:
        """Whether the file is still the one that was read."""
        return self.path.exists() and self.stamp == _stamp_of(self.path)


def _stamp_of(path: Path) -> tuple[int, int]:
    result = path.stat()
    return result.st_size, result.st_mtime_ns
