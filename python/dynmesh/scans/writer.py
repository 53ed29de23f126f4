"""Writing scans into a folder, which appears when it is complete."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Self

from .._arrays import plain
from .._checks import path_of
from .._errors import InputError, KindError
from .._report import OutputReport, counted
from ..formats import FORMATS, PathLike
from ..formats.names import Number
from ..formats.output import new_folder
from ..scan import PointScan, Scan
from .cameras import CAMERAS, Rig, write_cameras
from .depth_files import SUFFIXES, write_depth
from .point_files import write_ply


class ScanRun:
    """Scans that are made while they are gone through, once: what a verb makes.

    Attributes:
        n_frames: number of scans.
    """

    def __init__(
        self,
        n_frames: int,
        scans: Iterable[Scan],
        save: Callable[[Path, bool, Iterator[Scan]], OutputReport],
    ) -> None:
        self.n_frames, self._scans, self._save = n_frames, iter(scans), save
        self._has_begun = False
        self.closing: Callable[[], object] = lambda: None

    def __len__(self) -> int:
        return self.n_frames

    def __repr__(self) -> str:
        return f"{type(self).__name__}({counted(self.n_frames, 'scan')}, made when gone through)"

    def __getstate__(self) -> object:
        message = "are made in this process alone, and cannot be pickled or copied; write() them"
        raise KindError(message, argument="scans")

    def __iter__(self) -> Iterator[Scan]:
        if self._has_begun:
            raise InputError("its scans were gone through, which is possible once")
        self._has_begun = True
        return self._scans

    def write(self, path: PathLike, *, overwrite: bool = True) -> OutputReport:
        """Writes the scans to a folder, or the only one of them to a file."""
        return self._save(path_of("path", path), overwrite, iter(self))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.closing()


_OURS = ("frame_*.ply", f"depth_*{SUFFIXES[0]}", CAMERAS)


@contextmanager
def scan_folder(
    path: PathLike, rig: Rig, *, overwrite: bool = False, numbers: Iterable[Number] | None = None
) -> Iterator[Callable[[Scan], None]]:
    """Yields a function that writes the scan of the next frame into a folder.

    They are point clouds, as ``frame_00000.ply``, or depth images of all cameras of the rig, as
    ``depth_00000_left.png``. Until all are written, they are in a hidden folder beside their
    destination, in which no other process writes and which an error removes. The numbers are those
    of the frames, by default from 0. A folder that holds other files than scans is refused, and
    scans are replaced with `overwrite` alone.
    """
    path = path_of("path", path)
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
                file = hidden / f"depth_{number:05d}_{camera.name}{SUFFIXES[0]}"
                write_depth(file, plain("depth", depth), camera)

        yield append


def check_name_of_folder(path: Path) -> None:
    """Refuses the name of a file for a folder of scans that is to be made."""
    is_name_of_file = any(path.suffix.lower() in one.suffixes for one in FORMATS.values())
    if is_name_of_file and not path.is_dir():
        message = f"scans are written to a folder, but names in {path.suffix} are those of files"
        raise InputError(message, file=path)


def _is_ours(file: Path) -> bool:
    return any(file.match(pattern) for pattern in _OURS)
