"""What tracking and registration are given: units of length, landmarks, a single scan."""

from pathlib import Path
from typing import Any, NamedTuple, Unpack

import numpy as np

from .. import formats
from .._checks import check_integer, check_number, check_vector
from .._errors import InputError, naming, within
from .._report import listed
from ..completion.start import template_of
from ..formats.conversion import agreed
from ..formats.ply import read_elements
from ..formats.text import Metadata
from ..frame import Frames
from ..registration import Landmarks
from ..scans import PointScan, ScanReader, open_scans, read_points, unit_of_scans
from ..scans.cameras import json_in
from ..scans.depth_files import SUFFIXES
from ..scans.image_files import folder_of_masks
from ..scans.opening import ScanSource, read_rig
from ..scans.point_files import PointFile, point_formats
from ..scans.reader import PointReader
from ..topology import vertex_normals


class Units(NamedTuple):
    """The metres in a unit of a template and of scans; None if they are unknown."""

    template: float | None
    scans: float | None

    @property
    def factor(self) -> float:
        """The unit of the scans in that of the template; 1 if one of them is unknown."""
        if self.template is None or self.scans is None:
            return 1.0
        return self.scans / self.template


def units_of(
    scans: ScanReader,
    template: Frames,
    scan_unit: float | str | None,
    template_unit: float | str | None = None,
    *,
    assumes: bool = False,
) -> Units:
    """Returns the units of scans and a template, as their files state them or as they are given.

    With `assumes`, a template without a unit is in that which the file of the scan states.
    """
    stated = template.header.metres_per_unit
    own = agreed(stated, template_unit, "template_unit", template.path)
    theirs = unit_of_scans(scans, scan_unit)
    if assumes and scan_unit is None and own is None:
        return Units(theirs, theirs)
    if theirs is not None and own is None:
        raise InputError(
            f"states no unit, but the scans are in units of {theirs:g} m; state it by "
            "`template_unit`, such as m",
            file=template.path,
        )
    return Units(own, theirs)


def read_landmarks(path: Path) -> Landmarks:
    """Reads the landmarks of a JSON file."""
    with naming(path):
        given = json_in(path)
        if not isinstance(given, list) or not given:
            raise InputError("must be a list of landmarks, with at least one")
        for number, one in enumerate(given):
            with within(f"landmark {number}"):
                _check(one)
    return (
        np.array([one["vertex"] for one in given]),
        np.array([one["position"] for one in given], np.float64),
    )


def _check(given: Any) -> None:
    if not isinstance(given, dict) or given.keys() != {"vertex", "position"}:
        raise InputError(f"must have a vertex and a position and nothing else, not {given!r}")
    check_integer("vertex", given["vertex"], 0, 2**31 - 1)
    check_vector("position", given["position"])


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
        pixels = reading.get("subject"), reading.get("least_confidence")
        folder_of_masks(*pixels, of_points=True)
        rig = read_rig(path, reading.get("cameras"), reading.get("poses"))
        meshes = {suffix for format in formats.FORMATS.values() for suffix in format.suffixes}
        meshes -= point_formats.keys()
        if path.suffix.lower() not in meshes | point_formats.keys():
            raise InputError(
                f"unknown format {path.suffix!r}; scans are {listed(point_formats)} "
                f"files, meshes ({', '.join(sorted(meshes))}), or depth images",
                file=path,
            )
        return PointReader(path, rig, [path], [0], read=_points_of)
    result = open_scans(path, **reading)
    if result.n_frames > 1:
        raise InputError(
            f"holds {result.n_frames} scans; name one of them by `frame`, such as "
            f"{result.numbers[0]}, or each in a row of a table of jobs",
            file=path,
        )
    return result


def _points_of(path: Path) -> PointFile:
    """The points of a file, or the vertices of a mesh with their normals, which faces tell best."""
    suffix = path.suffix.lower()
    if suffix in point_formats:
        result = read_points(path)
        elements = read_elements(path)[0] if suffix == ".ply" else {}
        is_whole = "face" in elements and len(elements["vertex"]["x"]) == len(result.scan.points)
        if result.scan.normals is not None or not is_whole:
            return result
    with formats.open(path) as mesh:
        points = template_of(mesh)
        normals = vertex_normals(mesh.faces, points.astype(np.float64)).astype(points.dtype)
        unit = Metadata(metres_per_unit=mesh.header.metres_per_unit)
    has_normal = normals.any(axis=1)
    if not has_normal.any():
        return PointFile(PointScan(points, None, None), unit)
    return PointFile(PointScan(points[has_normal], normals[has_normal], None), unit)
