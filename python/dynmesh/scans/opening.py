"""Opens scans: what files a folder or a pattern means, of what kind, and their cameras."""

import errno
import os
from pathlib import Path
from typing import TypedDict

from .._checks import check_choice, path_of
from .._errors import InputError, naming
from ..formats.conversion import agreed
from ..formats.format import Gaps
from ..formats.names import files_in, find_files
from ..formats.table import PathLike
from .cameras import CAMERAS, Rig, read_cameras
from .depth_files import SUFFIXES
from .image_files import folder_of_masks, images_in
from .point_files import POINTS, point_formats
from .reader import DepthReader, PointReader, ScanReader
from .trajectories import Direction


class BesideScans(TypedDict, total=False):
    """What is read beside scans: keywords of :func:`open_scans`."""

    cameras: PathLike | Rig | None
    poses: Direction | None
    subject: PathLike | None
    least_confidence: float | None


class ScanSource(BesideScans, total=False):
    """How scans are read: keywords of :func:`open_scans`."""

    gaps: Gaps


def unit_of_scans(scans: ScanReader, said: str | float | None) -> float | None:
    """Returns the metres in the unit of the scans: as their files state it, or as it is given."""
    file = None if scans.rig is None else scans.rig.file
    return agreed(scans.metres_per_unit, said, "scan_unit", file or scans.path)


def open_scans(
    path: PathLike,
    *,
    cameras: PathLike | Rig | None = None,
    poses: Direction | None = None,
    gaps: Gaps = "refuse",
    subject: PathLike | None = None,
    least_confidence: float | None = None,
    frames: slice | range | None = None,
    colours: PathLike | None = None,
) -> ScanReader:
    """Opens scans, to read them frame by frame.

    Args:
        path: a folder, a pattern such as ``scan_%04d.ply`` or a glob such as ``*.xyz``, of point
            clouds (PLY, XYZ) or depth images (PNG, TIFF, OpenEXR, NPY). The names of depth images
            end in the name of the camera, as ``depth_00012_left.png``, or are in a folder with the
            name of the camera, as ``left/00012.png`` or ``left/depth/00012.png``. The only camera
            need not be named.
        cameras: poses and intrinsics of the cameras, or their file, required for depth images;
            else, `cameras.json` beside the scans.
        poses: where the poses of the cameras lead: "camera-to-world" or "world-to-camera"; else, as
            the kind of their file has it.
        gaps: what frames and images are whose file or pose is missing: "refuse" makes them an
            error, "lost" what was not observed.
        subject: a folder of masks with the names of the depth images, which are not 0 where the
            subject is; other pixels count as not measured.
        least_confidence: pixels whose confidence is less count as not measured. The images of
            confidences have the names of the depth images, with "confidence" instead of "depth".
        frames: the numbers of the frames to read, as a slice; None for all.
        colours: "points", if the scans are to have the colours of their files (PLY), or a folder of
            colour images, registered to depth, with the numbers or about the times of the depth
            images.
    """
    path = path_of("path", path)
    check_choice("gaps", gaps, Gaps)
    rig = read_rig(path, cameras, poses)
    masks = folder_of_masks(subject, least_confidence)
    with naming(path):
        suffix = _suffix_in(path, rig)
        if suffix in SUFFIXES:
            if rig is None:
                raise InputError(
                    f"depth images need cameras: {CAMERAS} beside them, or another file",
                    argument="cameras",
                )
            folder = None if colours is None else path_of("colours", colours)
            reader: ScanReader = DepthReader(path, rig, gaps, masks, least_confidence, folder)
        else:
            folder_of_masks(subject, least_confidence, of_points=True)
            if colours is not None and path_of("colours", colours) != Path(POINTS).absolute():
                message = f"must be {POINTS!r} for files of points, not {str(colours)!r}"
                raise InputError(message, argument="colours")
            found = find_files(path, suffix, gaps)
            has_colours = colours is not None
            reader = PointReader(path, rig, found.files, found.numbers, gaps, coloured=has_colours)
        reader.choose(frames)
        return reader


def read_rig(
    path: Path, cameras: PathLike | Rig | None, poses: Direction | None = None
) -> Rig | None:
    """Reads the cameras of scans from their file, or from the one that is usual, if it exists."""
    if poses is not None:
        check_choice("poses", poses, Direction)
    if isinstance(cameras, Rig):
        return cameras
    folder = path if path.is_dir() else path.parent
    beside = folder / CAMERAS
    if cameras is None and not beside.is_file():
        return None
    file = beside if cameras is None else path_of("cameras", cameras)
    return read_cameras(file, poses, folder)


def _suffix_in(path: Path, rig: Rig | None) -> str:
    suffixes = (*point_formats, *SUFFIXES)
    if not path.is_dir():
        if not path.suffix and not path.exists():
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        if path.suffix.lower() not in suffixes:
            raise InputError(f"unknown format {path.suffix!r}; scans are {', '.join(suffixes)}")
        return path.suffix.lower()
    images = [] if rig is None else images_in(path, rig)
    found = {suffix for suffix in suffixes if files_in(path, suffix)}
    if images:
        found = {file.suffix.lower() for file in images} | (found & point_formats.keys())
    if len(found) > 1:
        message = f"is a folder with {' and '.join(sorted(found))} files"
        raise InputError(f"{message}; name one kind by a pattern")
    if not found:
        message = f"is a folder without scans, which are {', '.join(suffixes)}"
        below = sorted(one for one in path.glob("*") if one.is_dir())
        inside = [one.name for one in below if any(files_in(one, kind) for kind in suffixes)]
        where = f"; there are some in {' and in '.join(inside[:3])}" if inside else ""
        raise InputError(message + where)
    return found.pop()
