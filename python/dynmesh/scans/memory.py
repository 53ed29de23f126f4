"""Scans in memory, read as those in files are."""

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from pathlib import Path
from typing import Any, TypeAlias, Unpack

import numpy as np

from .._arrays import Positions, first_frame
from .._checks import path_of
from .._errors import InputError, KindError, locating, naming
from .._scan_arrays import image_arrays, scan_arrays
from ..formats import PathLike
from ..scan import DepthScan, PointScan, Scan, parts_of
from .opening import ScanSource, open_scans
from .point_files import measured
from .reader import ScanReader
from .writer import ScanRun

OneScan: TypeAlias = Scan | Positions | tuple[Positions, Positions] | None
"""A scan, points (n, 3), points and their normals, or None where there is none."""

InMemory: TypeAlias = ScanRun | ScanReader | Sequence[OneScan] | Positions
"""Scans that a verb makes, those of :func:`open_scans`, or one for each frame."""


class MemoryReader(ScanReader):
    """Scans in memory, each of which is checked when it is reached."""

    def __init__(self, scans: Any) -> None:
        super().__init__(Path("scans"), None, [*range(len(scans))], [])
        self._scans = scans

    def cameras_of(self, frame: int) -> list[str]:
        """Returns the numbers of the sensors of the scan."""
        scan = self._load(self._chosen[frame])
        places = scan.poses if isinstance(scan, DepthScan) else scan and scan.viewpoints
        return [] if places is None else [str(sensor) for sensor in range(len(places))]

    def _load(self, number: int) -> Scan | None:
        scan = self._scans[number]
        if scan is None:
            return None
        with naming(self.path), locating(frame=number):
            if isinstance(scan, DepthScan):
                arrays = image_arrays(*scan, scan.colours)
                images: Any = map(list, zip(*arrays, strict=True))
                depth, intrinsics, poses, shades = images
                seen = [np.where(np.isfinite(one) & (one > 0), one, 0) for one in depth]
                return DepthScan(seen, intrinsics, poses, None if scan.colours is None else shades)
            points, normals, places = parts_of(scan)
            points = first_frame("points", points)
            given = scan.colours if isinstance(scan, PointScan) else None
            _, normals, places, colours = scan_arrays(points, normals, places, points.dtype, given)
            result = measured(points, normals, lambda row: f"point {row}", colours)
            return result._replace(viewpoints=places)


@contextmanager
def opened_scans(
    scans: PathLike | InMemory,
    frames: slice | range | None = None,
    colours: PathLike | None = None,
    **reading: Unpack[ScanSource],
) -> Iterator[ScanReader]:
    """Yields the scans wherever they are; those that a verb makes are kept in a temporary folder.

    The keywords are those of :func:`open_scans`; scans that are read already take none.
    """
    if isinstance(scans, str | os.PathLike):
        yield open_scans(path_of("scans", scans), frames=frames, colours=colours, **reading)
        return
    if isinstance(scans, ScanRun):
        with tempfile.TemporaryDirectory(prefix="dynmesh-") as folder:
            scans.write(Path(folder) / "scans")
            yield open_scans(Path(folder) / "scans", frames=frames, colours=colours, **reading)
        return
    for name, value in {"colours": colours, **reading}.items():
        if value is not None:
            message = "is for the files of scans, not for scans in memory"
            raise InputError(message, argument=name, value=value)
    if isinstance(scans, np.ndarray | list | tuple):
        if len(scans) == 0:
            raise InputError("are none", argument="scans")
        reader: ScanReader = MemoryReader(scans)
    elif isinstance(scans, ScanReader):
        reader = copy(scans)
    else:
        message = f"must be a path or a list of scans, one a frame, not {type(scans).__name__}"
        raise KindError(message, argument="scans")
    reader.choose(frames)
    yield reader
