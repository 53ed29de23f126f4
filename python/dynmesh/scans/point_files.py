"""Files with the points of one frame: PLY and XYZ.

A point whose three coordinates are all NaN was not measured, as in the organised clouds of depth
cameras, and is left out. Other positions must be finite. Normals are made as long as 1; those that
are NaN or 0 are unknown, and if all are, the scan has none.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._arrays import Positions, floats, plain
from .._checks import path_of, refuse_mask
from .._errors import InputError, naming
from ..formats.ply import coordinates, ply_header, read_elements
from ..formats.table import PathLike
from ..formats.text import Metadata, lines_in, metadata_in, number_of, words_in
from ..scan import PointScan

POINTS = "points"
"""The value of `colours` that means those of the points."""

_LIKE_COLOURS = 31
"""Whole numbers up to 255, of which one is larger than this, are colours, not normals."""


_NORMAL = "nx", "ny", "nz"
_COLOUR = "red", "green", "blue"
_DTYPES = {"float": "<f4", "double": "<f8", "uchar": "u1"}


class PointFile(NamedTuple):
    """The points of a file, and what it says of them."""

    scan: PointScan
    metadata: Metadata = Metadata()


def read_points(file: PathLike) -> PointFile:
    """Reads the points of a file, by its suffix."""
    file = path_of("file", file)
    with naming(file):
        read = point_formats.get(file.suffix.lower())
        if read is None:
            known = ", ".join(point_formats)
            raise InputError(f"unknown format {file.suffix!r}; those of points are {known}")
        return read(file)


def write_ply(
    file: PathLike,
    scan: PointScan,
    metres_per_unit: float | None = None,
    up_axis: str | None = None,
) -> None:
    """Writes points, normals and colours as PLY, binary and little-endian, in their precision.

    Colours that are whole numbers up to 255, of which some are above 1, are bytes.
    """
    refuse_mask("viewpoints", scan.viewpoints)
    points = floats("points", scan.points)
    kinds, columns = dict[str, str](), list[NDArray[Any]]()
    for argument, names, given in (
        ("points", "xyz", points),
        ("normals", _NORMAL, scan.normals),
        ("colours", _COLOUR, scan.colours),
    ):
        if given is None:
            continue
        array = plain(argument, given) if names is _COLOUR else floats(argument, given)
        if array.shape != (shape := (len(points), 3)):
            raise InputError(f"must have shape {shape}, not {array.shape}", argument=argument)
        is_bytes = names is _COLOUR and not (array.max(initial=0) <= 1 or (array % 1).any())
        is_bytes &= bool(((array >= 0) & (array <= 255)).all())
        of_floats = "double" if points.dtype == np.float64 else "float"
        kinds |= dict.fromkeys(names, "uchar" if is_bytes else of_floats)
        columns += [*array.T]
    stated = {"up_axis": up_axis, "metres_per_unit": metres_per_unit}
    comments = [f"{name} {value}" for name, value in stated.items() if value is not None]
    header = ply_header(comments, len(points), kinds)
    rows = np.empty(len(points), [(name, _DTYPES[kind]) for name, kind in kinds.items()])
    for name, column in zip(kinds, columns, strict=True):
        rows[name] = column
    path_of("file", file).write_bytes(header + rows.tobytes())


def _read_ply(file: Path) -> PointFile:
    columns, comments = read_elements(file)
    vertices = columns.get("vertex", {})
    points = coordinates(vertices, ("x", "y", "z"))
    normals = coordinates(vertices, _NORMAL) if vertices.keys() & _NORMAL else None
    colours = None
    if vertices.keys() >= {*_COLOUR}:  # bytes, or numbers up to 1
        colours = np.stack([np.asarray(vertices[name]) for name in _COLOUR], axis=1)
    scan = measured(points, normals, lambda row: f"point {row}", colours)
    return PointFile(scan, metadata_in(comments))


def _read_xyz(file: Path) -> PointFile:
    rows: list[list[float]] = []
    lines: list[int] = []
    text = lines_in(file)
    for number, line in enumerate(text, start=1):
        words = words_in(line.replace(",", " "))
        if not words:
            continue
        if len(words) not in (3, 6):
            raise InputError(
                f"line {number}: must be x y z, or x y z nx ny nz, but has {len(words)} words"
            )
        if rows and len(words) != len(rows[0]):
            raise InputError(
                f"line {number}: has {len(words)} numbers, but line {lines[0]} has {len(rows[0])}"
            )
        rows.append([number_of(word, number) for word in words])
        lines.append(number)
    table = np.array(rows).reshape(len(rows), len(rows[0]) if rows else 3)
    comments = (line.partition("#")[2] for line in text if line.startswith("#"))
    normals = table[:, 3:] if table.shape[1] == 6 else None
    if (
        normals is not None
        and (normals > _LIKE_COLOURS).any()
        and np.isin(normals, np.arange(256)).all()
    ):
        row = int(normals.max(axis=1).argmax())
        message = f"{_told(normals[row])} is a colour, not a normal; leave colours out"
        raise InputError(f"line {lines[row]}: {message}")
    scan = measured(table[:, :3], normals, lambda row: f"line {lines[row]}")
    return PointFile(scan, metadata_in(comments))


point_formats: dict[str, Callable[[Path], PointFile]] = {
    ".ply": _read_ply,
    ".xyz": _read_xyz,
}
"""What reads a file, by its suffix."""


def measured(
    points: Positions,
    normals: Positions | None,
    name: Callable[[int], str],
    colours: NDArray[Any] | None = None,
) -> PointScan:
    """Leaves out what was not measured, and refuses what cannot be used."""
    if normals is not None and len(normals) != len(points):
        raise InputError(f"has {len(points)} points, but {len(normals)} normals")
    measured = ~np.isnan(points).all(axis=1)
    rows = np.flatnonzero(measured)
    points = np.ascontiguousarray(points[measured])
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        row = int(finite.argmin())
        raise InputError(f"{name(int(rows[row]))}: is at {_told(points[row])}, which is not finite")
    if normals is not None:
        normals = np.ascontiguousarray(normals[measured])
        unknown = np.isnan(normals).any(axis=1)
        normals[unknown] = 0
        largest = np.abs(normals).max(axis=1, initial=0)
        if not np.isfinite(largest).all():
            row = int(np.isinf(largest).argmax())
            raise InputError(
                f"{name(int(rows[row]))}: its normal {_told(normals[row])} is infinite"
            )
        normals = normals / np.where(largest > 0, largest, 1)[:, None]  # the squares may overflow
        lengths = np.linalg.norm(normals, axis=1)
        normals = normals / np.where(lengths > 0, lengths, 1)[:, None]
        if not lengths.any():
            normals = None
    if colours is not None:
        colours = np.ascontiguousarray(colours[measured], points.dtype)
        finite = np.isfinite(colours).all(axis=1)
        if not finite.all():
            row = int(finite.argmin())
            wrong = f"{_told(colours[row])}, which is not finite"
            raise InputError(f"{name(int(rows[row]))}: has the colour {wrong}")
    return PointScan(points, normals, None, colours)


def _told(row: Positions) -> str:
    return f"({', '.join(f'{value:g}' for value in row)})"
