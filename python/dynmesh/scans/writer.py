"""Writing scans into a folder, which appears when it is complete."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

from .._arrays import plain
from .._errors import InputError
from ..formats import all_formats
from ..formats.names import Number
from ..formats.output import new_folder
from ..scan import PointScan, Scan
from .cameras import Rig, write_cameras
from .depth_files import SUFFIX, write_depth
from .point_files import write_ply
from .reader import CAMERAS

_OURS = ("frame_*.ply", f"depth_*{SUFFIX}", CAMERAS)


@contextmanager
def scan_folder(
    path: Path, rig: Rig, *, overwrite: bool = False, numbers: Iterable[Number] | None = None
) -> Iterator[Callable[[Scan], None]]:
    """Yields a function that writes the scan of the next frame into a folder.

    They are point clouds, as ``frame_00000.ply``, or depth images of all cameras of the rig, as
    ``depth_00000_left.png``. Until all are written, they are in a hidden folder beside their
    destination, in which no other process writes and which an error removes. The numbers are those
    of the frames, by default from 0.

    Raises:
        ValueError: the path has the suffix of a file.
        FileExistsError: the folder holds files, and not only scans that may be replaced.
        BlockingIOError: another process is writing it.
        OSError: it cannot be written.
    """
    check_name_of_folder(path)
    left = count() if numbers is None else iter(numbers)
    with new_folder(path, overwrite, _is_ours) as hidden:
        write_cameras(hidden / CAMERAS, rig)

        def append(scan: Scan) -> None:
            number = next(left)
            if isinstance(scan, PointScan):
                write_ply(hidden / f"frame_{number:05d}.ply", scan, rig.metres_per_unit)
                return
            for camera, depth in zip(rig.cameras, scan.depth, strict=True):
                file = hidden / f"depth_{number:05d}_{camera.name}{SUFFIX}"
                write_depth(file, plain("depth", depth), camera)

        yield append


def check_name_of_folder(path: Path) -> None:
    """Refuses the name of a file for a folder of scans that is to be made."""
    is_name_of_file = any(path.suffix.lower() in one.suffixes for one in all_formats().values())
    if is_name_of_file and not path.is_dir():
        message = f"scans are written to a folder, but names in {path.suffix} are those of files"
        raise InputError(message, file=path)


def _is_ours(file: Path) -> bool:
    return any(file.match(pattern) for pattern in _OURS)
