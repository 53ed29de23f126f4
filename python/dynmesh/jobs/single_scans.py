"""Scans that are registered one by one: a file, those of a folder, or depth images by frame."""

from pathlib import Path

from .. import files
from .._errors import InputError
from ..files import PathLike
from ..files.model import gltf, stl
from ..files.numbered import Found
from ..files.scans import PointScan, ScanReader, open_scans, read_points
from ..files.scans.corrections import AS_STATED
from ..files.scans.depth_files import SUFFIX
from ..files.scans.point_files import point_formats
from ..files.scans.reader import CAMERAS, Cameras
from .start import template_of


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
    """The points of a file; of a mesh, its vertices."""
    if path.suffix.lower() in point_formats:
        return read_points(path).scan
    with files.open(path) as mesh:
        return PointScan(template_of(mesh), None, None)
