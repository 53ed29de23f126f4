"""STL, OFF and glTF: one mesh, such as a template, as trimesh reads it (extra `scans`).

Vertices at the same position become one, since STL repeats them in every triangle, and glTF where
texture coordinates or normals differ. Their order depends on that, so several such files are no
sequence. All meshes of a scene become one, in the space of the scene. glTF is in metres, y up.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .._errors import InputError, of_library, require
from ..frame import Frame, Indices
from ..header import Header
from ..stored import FileFrames
from .format import Format

_GLTF = (".glb", ".gltf")


class ModelFrames(FileFrames):
    """A mesh as a sequence of one frame."""

    def __init__(self, path: Path) -> None:
        suffix = path.suffix.lower()
        path.open("rb").close()  # gives the error message of the system
        with of_library(f"cannot be read as {suffix[1:].upper()}"):
            library: Any = require("trimesh", extra="scans")
            mesh = library.load_scene(path, process=False).to_mesh()
            points = np.asarray(mesh.vertices, np.float64).reshape(-1, 3)
            _, first, same = np.unique(points, axis=0, return_index=True, return_inverse=True)
            place = np.argsort(np.argsort(first))[same.ravel()]
            faces = place[np.asarray(mesh.faces, np.int64)].astype(np.int32)
        if not len(points):  # of a file that is cut, too
            raise InputError(f"cannot be read as {suffix[1:].upper()}: it has no vertices")
        self._points = points[np.sort(first)]
        up, unit = ("y", 1.0) if suffix in _GLTF else (None, None)
        kind = points.dtype
        header = Header(faces, 1, len(self._points), kind, up_axis=up, metres_per_unit=unit)
        super().__init__(path, header)

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        for _ in numbers:
            yield Frame(self._points)


model = Format("model", (".stl", ".off", *_GLTF), ModelFrames, library=("trimesh", "scans"))
