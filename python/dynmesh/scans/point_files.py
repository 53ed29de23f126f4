"""Files with the points of one frame: PLY and XYZ.

A point whose three coordinates are all NaN was not measured, as in the organised clouds of depth
cameras, and is left out. Other positions must be finite, and normals must have length 1, or 0 where
they are unknown.
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .._checks import refuse_mask
from .._errors import naming
from ..files.header import Metadata, metadata_in
from ..files.ply import coordinates, ply_header, read_elements
from ..sequence import Positions
from .scan import PointScan

_ROUNDED = 0.05
"""By how much the length of a normal may differ from 1, as it was written with a few digits."""


class PointFile(NamedTuple):
    """The points of a file, and what it says of them."""

    scan: PointScan
    metadata: Metadata = Metadata()


def read_points(file: Path) -> PointFile:
    """Reads the points of a file, by its suffix.

    Raises:
        OSError: the file cannot be read.
        ValueError: it does not hold points; the message names the line or the point, and the value.
    """
    with naming(file):
        read = point_formats.get(file.suffix.lower())
        if read is None:
            known = ", ".join(point_formats)
            raise ValueError(f"unknown format {file.suffix!r}; those of points are {known}")
        return read(file)


def write_ply(
    file: Path,
    scan: PointScan,
    metres_per_unit: float | None = None,
    up_axis: str | None = None,
) -> None:
    """Writes points and their normals as PLY, binary and little-endian, in their precision."""
    for name, values in scan._asdict().items():
        refuse_mask(name, values)
    kind = "double" if scan.points.dtype == np.float64 else "float"
    names, columns = [*"xyz"], [scan.points]
    if scan.normals is not None:
        names += ["nx", "ny", "nz"]
        columns.append(scan.normals)
    stated = {"up_axis": up_axis, "metres_per_unit": metres_per_unit}
    comments = [f"{name} {value}" for name, value in stated.items() if value is not None]
    header = ply_header(comments, len(scan.points), dict.fromkeys(names, kind))
    rows = np.concatenate(columns, axis=1).astype("<f8" if kind == "double" else "<f4")
    file.write_bytes(header + rows.tobytes())


def _read_ply(file: Path) -> PointFile:
    columns, comments = read_elements(file)
    vertices = columns.get("vertex", {})
    points = coordinates(vertices, ("x", "y", "z"))
    names = ("nx", "ny", "nz")
    normals = coordinates(vertices, names) if vertices.keys() & names else None
    scan = _checked(points, normals, lambda row: f"point {row}")
    return PointFile(scan, metadata_in(comments))


def _read_xyz(file: Path) -> PointFile:
    rows: list[list[float]] = []
    lines: list[int] = []
    text = file.read_bytes().decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
    for number, line in enumerate(text.split("\n"), start=1):
        words = line.partition("#")[0].replace(",", " ").split()
        if not words:
            continue
        if len(words) not in (3, 6):
            raise ValueError(
                f"line {number}: must be x y z, or x y z nx ny nz, but has {len(words)} words"
            )
        if rows and len(words) != len(rows[0]):
            raise ValueError(
                f"line {number}: has {len(words)} numbers, but line {lines[0]} has {len(rows[0])}"
            )
        rows.append([_number(word, number) for word in words])
        lines.append(number)
    table = np.array(rows).reshape(len(rows), len(rows[0]) if rows else 3)
    comments = (line.partition("#")[2] for line in text.split("\n") if line.startswith("#"))
    normals = table[:, 3:] if table.shape[1] == 6 else None
    scan = _checked(table[:, :3], normals, lambda row: f"line {lines[row]}")
    return PointFile(scan, metadata_in(comments))


def _number(word: str, line: int) -> float:
    try:
        if "_" in word:
            raise ValueError(word)
        return float(word)
    except ValueError:
        raise ValueError(f"line {line}: {word[:40]!r} is not a number") from None


point_formats: dict[str, Callable[[Path], PointFile]] = {
    ".ply": _read_ply,
    ".xyz": _read_xyz,
}
"""What reads a file, by its suffix."""


def _checked(points: Positions, normals: Positions | None, name: Callable[[int], str]) -> PointScan:
    """Leaves out what was not measured, and refuses what cannot be used."""
    if normals is not None and len(normals) != len(points):
        raise ValueError(f"has {len(points)} points, but {len(normals)} normals")
    measured = ~np.isnan(points).all(axis=1)
    rows = np.flatnonzero(measured)
    points = np.ascontiguousarray(points[measured])
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        row = int(finite.argmin())
        raise ValueError(f"{name(int(rows[row]))}: is at {_told(points[row])}, which is not finite")
    if normals is not None:
        normals = np.ascontiguousarray(normals[measured])
        with np.errstate(over="ignore", invalid="ignore"):
            lengths = np.linalg.norm(normals, axis=1)
        wrong = ~((np.abs(lengths - 1) <= _ROUNDED) | (lengths == 0))
        if wrong.any():
            row = int(wrong.argmax())
            raise ValueError(
                f"{name(int(rows[row]))}: its normal {_told(normals[row])} must have length 1, not "
                f"{lengths[row]:.3g}, or 0 if it is unknown; leave out colours and all else"
            )
        normals = normals / np.where(lengths > 0, lengths, 1)[:, None]
    return PointScan(points, normals, None)


def _told(row: Positions) -> str:
    return f"({', '.join(f'{value:g}' for value in row)})"
