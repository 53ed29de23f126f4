"""Writing scans into a folder, which appears when it is complete."""

import shutil
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from .cameras import Rig, write_cameras
from .depth_files import SUFFIX, require_png, write_depth
from .point_files import write_ply
from .reader import CAMERAS
from .scan import DepthScan, PointScan

_OURS = ("frame_*.ply", f"depth_*{SUFFIX}", CAMERAS)


class ScanFolder:
    """A folder of scans that is being written. Use it in a ``with`` statement.

    Until all frames are written, it is a hidden folder beside its destination, which an error
    removes.
    """

    def __init__(self, path: Path, rig: Rig, *, overwrite: bool = False) -> None:
        """Begins the folder.

        Raises:
            FileExistsError: the folder holds files, and not only scans that may be replaced.
            OSError: it cannot be written.
        """
        self.path = path
        self.rig = rig
        self._n_frames = 0
        if path.exists() and (not path.is_dir() or any(path.iterdir())):
            ours = {file for pattern in _OURS for file in path.glob(pattern)}
            others = sorted({*path.iterdir()} - ours) if path.is_dir() else [path]
            if others or not overwrite:
                what = others[0] if others else path
                advice = "" if others else "; --overwrite replaces it"
                raise FileExistsError(f"{what}: exists already{advice}")
        if not path.parent.is_dir():
            raise FileNotFoundError(f"{path}: there is no folder {path.parent}")
        self._hidden = path.with_name(f".{path.name}.unfinished")
        shutil.rmtree(self._hidden, ignore_errors=True)

    def __enter__(self) -> Self:
        """Creates the hidden folder."""
        self._hidden.mkdir()
        write_cameras(self._hidden / CAMERAS, self.rig)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, _: object, __: TracebackType | None
    ) -> None:
        """Moves the folder to its destination, or removes it after an error."""
        if kind is not None:
            shutil.rmtree(self._hidden, ignore_errors=True)
            return
        if self.path.exists():
            shutil.rmtree(self.path)
        self._hidden.rename(self.path)

    @property
    def _number(self) -> str:
        return f"{self._n_frames:05d}"


class PointFolder(ScanFolder):
    """Point clouds, as ``frame_00000.ply``."""

    def append(self, scan: PointScan) -> None:
        """Writes the next frame."""
        file = self._hidden / f"frame_{self._number}.ply"
        write_ply(file, scan, self.rig.metres_per_unit)
        self._n_frames += 1


class DepthFolder(ScanFolder):
    """Depth images, as ``depth_00000_left.png``."""

    def __init__(self, path: Path, rig: Rig, *, overwrite: bool = False) -> None:
        """Begins the folder; see :class:`ScanFolder`.

        Raises:
            ImportError: Pillow is not installed.
        """
        require_png()
        super().__init__(path, rig, overwrite=overwrite)

    def append(self, scan: DepthScan) -> None:
        """Writes the next frame, which has an image of every camera of the rig."""
        for camera, depth in zip(self.rig.cameras, scan.depth, strict=True):
            file = self._hidden / f"depth_{self._number}_{camera.name}{SUFFIX}"
            write_depth(file, np.asarray(depth), camera)
        self._n_frames += 1
