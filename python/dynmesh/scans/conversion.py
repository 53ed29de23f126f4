"""Point clouds in other units and axes."""

from pathlib import Path

import numpy as np

from ..files.comments import Metadata
from ..files.conversion import Changes
from ..files.header import Header
from ..files.numbered import files_in, find_files
from ..files.ply import read_elements
from .point_files import PointFile, point_formats
from .scan import PointScan


def clouds_in(path: Path) -> list[Path]:
    """Returns the files of a path, pattern or folder if they hold points alone, else none."""
    possible = [one for one in point_formats if files_in(path, one)] if path.is_dir() else []
    suffix = possible[0] if possible else path.suffix.lower()
    if suffix not in point_formats:
        return []
    try:
        found = [file for file in find_files(path, suffix, "lost").files if file is not None]
    except (FileNotFoundError, ValueError):  # which the reader of sequences explains
        return []
    is_mesh = suffix == ".ply" and "face" in read_elements(found[0])[0]
    return [] if is_mesh else found


def converted(found: PointFile, changes: Changes) -> PointFile:
    """Returns points with the axes and units that are asked for.

    Raises:
        ValueError: the file states another axis or unit, or one is needed that nothing states.
    """
    scan, said = found.scan, found.metadata
    no_faces = np.zeros((0, 3), np.int64)
    one = Header(no_faces, 1, len(scan.points), scan.points.dtype, **said._asdict())
    conversion, _ = changes.of(one)
    normals = scan.normals
    if normals is not None:
        normals = np.asarray(normals @ conversion.turn.T, normals.dtype)
    made = conversion.header
    return PointFile(
        PointScan(conversion.moved(scan.points), normals, None),
        Metadata(made.up_axis, made.metres_per_unit),
    )
