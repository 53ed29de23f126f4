"""STL, glTF and OFF: one mesh, such as a template, which trimesh reads (extra `scans`).

Vertices at the same position become one, since STL repeats them in every triangle, and glTF where
texture coordinates or normals differ. Their order depends on that, so several such files are no
sequence. All meshes of a scene become one, in the space of the scene. glTF is in metres, y up;
its animations are not read.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .._extras import require
from ..sequence import Positions
from .format import Format
from .frame import Frame
from .header import Header
from .reader import Reader

_GLTF = (".glb", ".gltf")


class ModelReader(Reader):
    """A mesh as a sequence of one frame."""

    def __init__(self, path: Path) -> None:
        """Reads the mesh."""
        self._points, faces = _read(path)
        k, dtype = len(self._points), self._points.dtype
        up, unit = ("y", 1.0) if path.suffix.lower() in _GLTF else (None, None)
        super().__init__(path, Header(faces, 1, k, dtype, up_axis=up, metres_per_unit=unit))

    def _frames(self, numbers: range) -> Iterator[Frame]:
        for _ in numbers:
            yield Frame(self._points)


def _read(path: Path) -> tuple[Positions, NDArray[np.int32]]:
    """Returns the vertices, each once, in the order in which they occur, and the triangles."""
    trimesh = require("trimesh", extra="scans")
    kind = path.suffix.lower()[1:]
    path.open("rb").close()  # gives the error message of the system
    try:
        mesh = trimesh.load(path, force="mesh", process=False)
        points = np.asarray(mesh.vertices, np.float64).reshape(-1, 3)
        corners = np.asarray(getattr(mesh, "faces", np.zeros((0, 3))), np.int64).reshape(-1, 3)
    except OSError:
        raise
    except Exception as error:  # of any kind if the file is damaged
        raise ValueError(f"cannot be read as {kind.upper()}: {error}") from error
    if not len(points):  # of a file that is cut, too
        raise ValueError(f"cannot be read as {kind.upper()}: it has no vertices")
    if not np.isfinite(points).all():
        raise ValueError("has a vertex that is not finite")
    _, first, same = np.unique(points, axis=0, return_index=True, return_inverse=True)
    place = np.argsort(np.argsort(first))
    return points[np.sort(first)], place[same.ravel()][corners].astype(np.int32)


model = Format("model", (".stl", ".off", *_GLTF), ModelReader, None, library=("trimesh", "scans"))
