"""One scan that is registered: a file of points, a mesh, or the depth images of one moment."""

from pathlib import Path
from typing import Unpack

import numpy as np

from .. import formats
from .._checks import check_number
from .._errors import InputError
from .._report import listed
from ..completion.start import template_of
from ..formats.ply import read_elements
from ..scans import PointScan, ScanReader, open_scans, read_points
from ..scans.cameras import Rig
from ..scans.depth_files import SUFFIXES
from ..scans.pixels import Wanted
from ..scans.point_files import point_formats
from ..scans.reader import ScanSource, read_rig
from ..topology import vertex_normals


class SingleScan(ScanReader):
    """A point cloud, or a mesh, whose vertices are the points."""

    def __init__(self, path: Path, rig: Rig | None) -> None:
        meshes = {suffix for format in formats.FORMATS.values() for suffix in format.suffixes}
        meshes -= point_formats.keys()
        if path.suffix.lower() not in meshes | point_formats.keys():
            raise InputError(
                f"unknown format {path.suffix!r}; scans are {listed(point_formats)} "
                f"files, meshes ({', '.join(sorted(meshes))}), or depth images",
                file=path,
            )
        super().__init__(path, rig, [0], [path])
        self._take_viewpoints([path])
        self._scan, stated = _read(path)
        self._take_unit(stated, path)

    def _load(self, number: int) -> PointScan:
        return self._seen(self._scan, number)


def open_single(
    path: Path, frame: float | None = None, **reading: Unpack[ScanSource]
) -> ScanReader:
    """Opens a point cloud, a mesh, or a folder or pattern with the depth images of one moment.

    Of several scans, it is that with the number `frame`.
    """
    is_images = path.suffix.lower() in SUFFIXES or any(
        file.suffix.lower() in SUFFIXES for file in path.rglob("*")
    )
    reading = {"gaps": "lost", **reading}
    if frame is not None:
        check_number("frame", frame)
        result = open_scans(path, **reading)
        if frame not in result.numbers:
            known = f"{result.numbers[0]} to {result.numbers[-1]}"
            raise InputError(f"there is no scan {frame:g}, only {known}", argument="frame")
        result.choose(slice(frame, np.nextafter(frame, np.inf)))
        return result
    if path.is_dir() and not is_images:
        message = "is a folder; name one scan, or each in a row of a table of jobs"
        raise InputError(message, file=path)
    if not is_images:
        Wanted.of_reading(reading).refuse_points()
        return SingleScan(path, read_rig(path, reading.get("cameras"), reading.get("poses")))
    result = open_scans(path, **reading)
    if result.n_frames > 1:
        raise InputError(
            f"holds {result.n_frames} scans; name one of them by `frame`, such as "
            f"{result.numbers[0]}, or each in a row of a table of jobs",
            file=path,
        )
    return result


def _read(path: Path) -> tuple[PointScan, float | None]:
    """The points of a file, and the metres in their unit, if it is stated.

    Of a mesh, they are its vertices, with their normals, which faces tell best.
    """
    suffix = path.suffix.lower()
    if suffix in point_formats:
        result = read_points(path)
        elements = read_elements(path)[0] if suffix == ".ply" else {}
        is_whole = "face" in elements and len(elements["vertex"]["x"]) == len(result.scan.points)
        if result.scan.normals is not None or not is_whole:
            return result.scan, result.metadata.metres_per_unit
    with formats.open(path) as mesh:
        points = template_of(mesh)
        normals = vertex_normals(mesh.faces, points.astype(np.float64)).astype(points.dtype)
        unit = mesh.header.metres_per_unit
    has_normal = normals.any(axis=1)
    if not has_normal.any():
        return PointScan(points, None, None), unit
    return PointScan(points[has_normal], normals[has_normal], None), unit
