"""Writing scans into a folder, which appears when it is complete."""

import contextlib
import os
from collections.abc import Iterable
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from ..files.new_output import check_folder, exchange, exists_already, making
from .cameras import Rig, write_cameras
from .depth_files import SUFFIX, write_depth
from .point_files import write_ply
from .reader import CAMERAS
from .scan import DepthScan, PointScan

_OURS = ("frame_*.ply", f"depth_*{SUFFIX}", CAMERAS)


class ScanFolder:
    """A folder of scans that is being written. Use it in a ``with`` statement.

    Until all frames are written, they are in a hidden folder beside their destination, in which no
    other process writes and which an error removes.
    """

    def __init__(
        self,
        path: Path,
        rig: Rig,
        *,
        overwrite: bool = False,
        numbers: Iterable[int] | None = None,
    ) -> None:
        """Looks whether the folder can be written, and writes nothing yet.

        The numbers are those of the frames, by default from 0.

        Raises:
            FileExistsError: the folder holds files, and not only scans that may be replaced.
            OSError: it cannot be written.
        """
        self.path = path
        self.rig = rig
        self._real = Path(os.path.realpath(path))
        self._overwrite = overwrite
        self._numbers = count() if numbers is None else iter(numbers)
        self._working = contextlib.ExitStack()
        self._refuse_existing()
        check_folder(path)

    def _refuse_existing(self) -> None:
        path = self.path
        if path.exists() and (not path.is_dir() or any(path.iterdir())):
            ours = {file for pattern in _OURS for file in path.glob(pattern)}
            others = sorted({*path.iterdir()} - ours) if path.is_dir() else [path]
            if others:
                raise FileExistsError(f"{others[0]}: exists already")
            if not self._overwrite:
                raise exists_already(path)

    def __enter__(self) -> Self:
        """Begins the folder.

        Raises:
            BlockingIOError: another process is writing it.
            OSError: it cannot be written.
        """
        with contextlib.ExitStack() as stack:
            self._hidden = stack.enter_context(making(self._real))
            self._refuse_existing()  # those that a killed process had put aside are back
            write_cameras(self._hidden / CAMERAS, self.rig)
            self._working = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, _: object, __: TracebackType | None
    ) -> None:
        """Moves the folder to its destination, or removes it after an error."""
        with self._working:
            if kind is None:
                self._refuse_existing()  # another process may have written it
                exchange(self._hidden, self._real)


class PointFolder(ScanFolder):
    """Point clouds, as ``frame_00000.ply``."""

    def append(self, scan: PointScan) -> None:
        """Writes the next frame."""
        file = self._hidden / f"frame_{next(self._numbers):05d}.ply"
        write_ply(file, scan, self.rig.metres_per_unit)


class DepthFolder(ScanFolder):
    """Depth images, as ``depth_00000_left.png``."""

    def append(self, scan: DepthScan) -> None:
        """Writes the next frame, which has an image of every camera of the rig."""
        number = next(self._numbers)
        for camera, depth in zip(self.rig.cameras, scan.depth, strict=True):
            file = self._hidden / f"depth_{number:05d}_{camera.name}{SUFFIX}"
            write_depth(file, np.asarray(depth), camera)
