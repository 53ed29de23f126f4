"""Scans that are registered one by one: files of points or meshes, or depth images by frame."""

from pathlib import Path

import numpy as np

from .. import files
from .._errors import InputError
from ..completion.start import template_of
from ..files import PathLike
from ..files.model import model
from ..files.numbered import Found, files_of
from ..files.ply import read_elements
from ..scans import PointScan, Scan, ScanReader, open_scans, read_points
from ..scans.cameras import Rig
from ..scans.depth_files import SUFFIX
from ..scans.point_files import point_formats
from ..scans.reader import CAMERAS, read_rig
from ..true_surface import vertex_normals


class SingleScans(ScanReader):
    """Point clouds and meshes, whose vertices are the points, in the order of their names."""

    def __init__(self, path: Path, rig: Rig | None) -> None:
        """Finds the files; cameras say where the sensors were.

        Raises:
            FileNotFoundError: there is no file.
            ValueError: a folder holds none, or a file has a format that is not known.
        """
        usual = (*point_formats, *model.suffixes, ".obj")
        found = files_of(path, usual)
        if not found:
            raise InputError("holds no point clouds and no meshes", file=path)
        meshes = {suffix for format in files.formats.values() for suffix in format.suffixes}
        meshes -= point_formats.keys()
        for file in found:
            if file.suffix.lower() not in meshes | point_formats.keys():
                raise InputError(
                    f"unknown format {file.suffix!r}; scans are {files.listed(point_formats)} "
                    f"files, meshes ({', '.join(sorted(meshes))}), or a folder of depth images",
                    file=file,
                )
        super().__init__(path, rig, Found([*found]), found)

    def _load(self, number: int) -> PointScan:
        scan = _read(self.files[number])
        self._unchanged.check([self.files[number]])
        if scan.viewpoints is None and self.rig is not None:
            return scan._replace(viewpoints=self.rig.viewpoints.astype(scan.points.dtype))
        return scan


class SomeScans(ScanReader):
    """Some of the frames of other scans."""

    def __init__(self, scans: ScanReader, frames: list[int]) -> None:
        """Takes the scans and which of their frames, counted from 0."""
        read = [file for file in scans.files if file not in scans.camera_files]
        super().__init__(scans.path, scans.rig, Found([None] * len(frames)), read)
        self._scans = scans
        self._frames = frames

    def number(self, frame: int) -> int:
        """As those scans number the frame."""
        return self._scans.number(self._frames[frame])

    def _load(self, number: int) -> Scan | None:
        frame = self._frames[number]
        return next(self._scans.frames(frame, frame + 1))


def open_single(path: Path, cameras: PathLike | None) -> ScanReader:
    """Opens a scan, or those of a folder or pattern: depth images, or point clouds and meshes.

    Raises:
        OSError, ImportError, ValueError: as :func:`dynmesh.scans.open_scans`.
    """
    is_image = path.suffix.lower() == SUFFIX
    if is_image and path.is_file():
        raise InputError(
            "is a single depth image; give the folder of the images of all cameras, with "
            f"{CAMERAS} in it, or the file of the cameras",
            file=path,
        )
    if is_image or (path.is_dir() and any(path.rglob(f"*{SUFFIX}"))):
        found = open_scans(path, cameras=cameras, gaps="lost")
        return SomeScans(found, [i for i in range(found.n_frames) if found.cameras_of(i)])
    return SingleScans(path, read_rig(path, cameras))


def paths_of(scans: ScanReader) -> list[Path]:
    """Returns the paths of the scans: their files, or, of depth images, the numbers of frames."""
    if isinstance(scans, SingleScans):
        return scans.files[: scans.n_frames]
    folder = scans.path if scans.path.is_dir() else scans.path.parent
    return [folder / f"frame_{scans.number(frame):05d}" for frame in range(scans.n_frames)]


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
