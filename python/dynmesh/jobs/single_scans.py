"""Scans that are registered one by one: a file, those of a folder, or depth images by frame."""

from pathlib import Path

import numpy as np

from .. import files
from .._errors import InputError
from ..files import PathLike
from ..files.model import gltf, stl
from ..files.numbered import Found
from ..files.ply import read_elements
from ..files.scans import PointScan, ScanReader, open_scans, read_points
from ..files.scans.corrections import AS_STATED
from ..files.scans.depth_files import SUFFIX
from ..files.scans.point_files import point_formats
from ..files.scans.reader import CAMERAS, Cameras
from .start import template_of
from .true_surface import vertex_normals


class SingleScans(ScanReader):
    """Point clouds and meshes, whose vertices are the points, in the order of their names."""

    def __init__(self, path: Path, cameras: Cameras | None) -> None:
        """Finds the files; cameras say where the sensors were.

        Raises:
            ValueError: a folder holds none.
        """
        found = [path]
        if path.is_dir():
            known = {*point_formats, *stl.suffixes, *gltf.suffixes, ".obj", ".off"}
            found = sorted(file for file in path.iterdir() if file.suffix.lower() in known)
            if not found:
                raise InputError("holds no point clouds and no meshes", file=path)
        super().__init__(path, cameras, Found([*found]), found)

    def _load(self, number: int) -> PointScan:
        scan = _read(self.files[number])
        self._unchanged.check([self.files[number]])
        if scan.viewpoints is None and self.rig is not None:
            return scan._replace(viewpoints=self.rig.viewpoints.astype(scan.points.dtype))
        return scan


def open_single(path: Path, cameras: PathLike | None) -> ScanReader:
    """Opens a scan, or those of a folder: depth images, or else point clouds and meshes.

    Raises:
        OSError, ImportError, ValueError: as :func:`dynmesh.files.scans.open_scans`.
    """
    if path.suffix.lower() == SUFFIX:
        raise InputError(
            "is a single depth image; give the folder of the images of all cameras, with "
            f"{CAMERAS} in it or --cameras FILE",
            file=path,
        )
    beside = (path if path.is_dir() else path.parent) / CAMERAS
    if cameras is None:
        cameras = beside if beside.is_file() else None
    if path.is_dir() and any(path.rglob(f"*{SUFFIX}")):
        return open_scans(path, cameras=cameras)
    rig = None if cameras is None else Cameras.of(Path(cameras), AS_STATED, path)
    return SingleScans(path, rig)


def names_of(scans: ScanReader) -> list[str]:
    """Returns the names of the scans: those of their files, or of their frames."""
    if isinstance(scans, SingleScans):
        return [file.name for file in scans.files[: scans.n_frames]]
    return [f"frame_{scans.number(frame):05d}" for frame in range(scans.n_frames)]


def _read(path: Path) -> PointScan:
    """The points of a file; of a mesh, its vertices, and their normals, which faces tell best."""
    suffix = path.suffix.lower()
    if suffix in point_formats:
        scan = read_points(path).scan
        elements = read_elements(path)[0] if suffix == ".ply" else {}
        is_whole = "face" in elements and len(elements["vertex"]["x"]) == len(scan.points)
        if scan.normals is not None or not is_whole:
            return scan
    with files.open(path) as mesh:
        points = template_of(mesh)
        normals = vertex_normals(mesh.faces, points.astype(np.float64)).astype(points.dtype)
    has_normal = normals.any(axis=1)
    if not has_normal.any():
        return PointScan(points, None, None)
    return PointScan(points[has_normal], normals[has_normal], None)
