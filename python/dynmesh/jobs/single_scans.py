"""Scans that are registered one by one: a file, or all those of a folder."""

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import numpy as np

from .. import files
from .._errors import InputError
from .._extras import require
from ..files.numbered import Found
from ..files.scans import PointScan, ScanReader, read_points
from ..files.scans.point_files import point_formats
from ..frames.naming import naming
from .start import template_of

_TRIMESH = (".stl", ".glb")
"""Formats of meshes, not of sequences, that trimesh reads."""


class SingleScans(ScanReader):
    """Point clouds and meshes, whose vertices are the points, in the order of their names."""

    def __init__(self, path: Path) -> None:
        """Finds the files.

        Raises:
            ValueError: a folder holds none.
        """
        found = [path]
        if path.is_dir():
            known = {*point_formats, *_TRIMESH, ".obj", ".off"}
            found = sorted(file for file in path.iterdir() if file.suffix.lower() in known)
            if not found:
                raise InputError("holds no point clouds and no meshes", file=path)
        super().__init__(path, None, Found([*found]), found)

    def clouds(self) -> Iterator[PointScan]:
        """Yields one scan after another."""
        return map(self._load, range(self.n_frames))

    def _load(self, number: int) -> PointScan:
        scan = _read(self.files[number])
        self._unchanged.check([self.files[number]])
        return scan


def _read(path: Path) -> PointScan:
    """The points of a file; of a mesh, its vertices."""
    if path.suffix.lower() in point_formats:
        return read_points(path).scan
    if path.suffix.lower() in _TRIMESH:
        return _read_with_trimesh(path)
    with files.open(path) as mesh:
        return PointScan(template_of(mesh), None, None)


def _read_with_trimesh(path: Path) -> PointScan:
    """The vertices of a file that holds no sequence, each once."""
    trimesh = require("trimesh", extra="scans")
    with naming(path):
        opened = path.read_bytes()
        kind = path.suffix.lower()[1:]
        try:
            mesh = trimesh.load(BytesIO(opened), file_type=kind, force="mesh", process=False)
            points = np.unique(np.asarray(mesh.vertices, np.float64).reshape(-1, 3), axis=0)
        except Exception as error:  # of any kind if the file is damaged
            raise ValueError(f"cannot be read as {kind.upper()}: {error}") from error
        if not len(points):  # of a file that is cut, too
            raise ValueError(f"cannot be read as {kind.upper()}: it has no vertices")
        if not np.isfinite(points).all():
            raise ValueError("has a vertex that is not finite")
    return PointScan(points, None, None)
