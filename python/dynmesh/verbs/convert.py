"""Conversion of sequences: other formats, frames, axes, units and rates."""

import contextlib
from collections import Counter
from collections.abc import Generator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import formats
from .._errors import InputError, naming, numbering
from .._options import Input, Method
from .._progress import tracked
from .._report import Report
from ..computed import ComputedFrames, report_of
from ..formats import PathLike, Written
from ..formats.conversion import Changes, Unit
from ..formats.folders import files_in, find_files
from ..formats.format import Gaps
from ..formats.output import new_folder, new_output, refuse_inputs
from ..formats.ply import read_elements
from ..frames import Frame, Frames
from ..header import Axis, Header
from ..scans import PointScan, read_points, write_ply
from ..scans.point_files import point_formats
from ..scans.reader import CAMERAS
from ..scans.writer import check_name_of_folder

_OF_CLOUDS = ("up", "unit", "to_up", "to_unit", "scale")
"""What can be changed of point clouds."""


def convert(
    sequence: PathLike | Frames,
    *,
    frames: Input[slice | range | None] = None,
    up: Input[Axis | None] = None,
    unit: Input[Unit | None] = None,
    to_up: Method[Axis | None] = None,
    to_unit: Method[Unit | None] = None,
    scale: Method[float | None] = None,
    fps: Method[float | None] = None,
    progress: bool = False,
) -> ComputedFrames[Report]:
    """Changes the format of a sequence, its frames, axes, units or rate.

    Points are turned and scaled by `to_up`, `to_unit` and `scale` alone. docs/formats.md says what
    each format keeps. Files that hold points alone, as scanners write them, become PLY files; those
    of a folder keep their names.

    Args:
        sequence: a file, or frames.
        frames: from the number of the first frame to that after the last one, such as 1001:1050;
            the frames keep their numbers.
        up: the up axis of a file that states none.
        unit: the unit of length of a file that states none: m, cm, mm, km, inch, foot, yard, or a
            number of metres.
        to_up: turn the points so that this axis is up.
        to_unit: scale the points to this unit.
        scale: multiply the points by this.
        fps: frames per second; the frames stay as they are.
        progress: whether to show on standard error how far it is.

    Returns:
        The converted frames, which are made when they are gone through.

    Raises:
        OSError, ImportError, TypeError, ValueError: a file cannot be read, it states another axis
            or unit, or one is needed that nothing states.
    """
    changes = Changes(frames, up, unit, to_up, to_unit, scale, fps)
    with contextlib.ExitStack() as stack:
        source = stack.enter_context(formats.opened(sequence))
        with naming(source.path):
            conversion, indices = changes.of(source.header)

        def make() -> Generator[Frame, None, Report]:
            chosen = source.frames(indices.start, indices.stop, indices.step)
            with numbering(source.path, source.header.number), closing(chosen):
                yield from conversion.frames(tracked(chosen, len(indices), "converting", progress))
            return replace(report_of(source), remarks=())

        return ComputedFrames(conversion.header, make, source, close=stack.pop_all().close)


def convert_clouds(
    path: Path,
    output: Path,
    *,
    gaps: Gaps = "refuse",
    output_format: str | None = None,
    overwrite: bool = False,
    progress: bool = False,
    **given: Any,
) -> Written | None:
    """Writes point clouds with other axes or units; None if a path is not of point clouds.

    The keywords are those of :func:`dynmesh.open`, :func:`convert` and :func:`dynmesh.write`.
    """
    clouds = _clouds_in(path, gaps)
    if not clouds:
        return None
    for name, value in given.items():
        if name not in _OF_CLOUDS:
            message = "is for sequences, not for point clouds"
            raise InputError(message, argument=name, value=value)
    if output_format not in (None, "ply"):
        message = f"must be ply for point clouds, not {output_format}"
        raise InputError(message, argument="output_format", value=output_format)
    changes = Changes(**given)
    if path in clouds:
        with new_output(output, overwrite, ".ply", inputs=clouds) as file:
            n_points = _convert_cloud(path, file, changes)
    else:
        n_points = _convert_folder(clouds, output, changes, overwrite, progress)
    has_cameras = ((path if path.is_dir() else path.parent) / CAMERAS).exists()
    remark = f"{CAMERAS} is not written; that of the scans holds for their unit and axes only"
    return Written(
        output=output,
        frames=len(clouds),
        vertices=n_points // len(clouds),
        remarks=(remark,) if has_cameras else (),
    )


def _convert_folder(
    clouds: list[Path], output: Path, changes: Changes, overwrite: bool, progress: bool
) -> int:
    """Writes a folder of point clouds; returns how many points they have."""
    check_name_of_folder(output)
    names = [f"{file.stem}.ply" for file in clouds]
    if twice := next((name for name, count in Counter(names).items() if count > 1), None):
        raise InputError(f"several would be {twice}; convert each folder on its own", file=output)
    refuse_inputs(output.glob("*"), clouds)
    with new_folder(output, overwrite, lambda file: file.name in names) as hidden:
        each = tracked(zip(clouds, names, strict=True), len(clouds), "converting", progress)
        return sum(_convert_cloud(cloud, hidden / name, changes) for cloud, name in each)


def _convert_cloud(path: Path, output: Path, changes: Changes) -> int:
    """Writes a point cloud; returns how many points it has."""
    with formats.naming(path):
        scan, said = read_points(path)
        size, no_faces = len(scan.points), np.zeros((0, 3), np.int64)
        conversion, _ = changes.of(Header(no_faces, 1, size, scan.points.dtype, **said._asdict()))
        points, normals = conversion.moved(scan.points), scan.normals
    if normals is not None:
        normals = np.asarray(normals @ conversion.turn.T, normals.dtype)
    header = conversion.header
    write_ply(output, PointScan(points, normals, None), header.metres_per_unit, header.up_axis)
    return size


def _clouds_in(path: Path, gaps: Gaps) -> list[Path]:
    """Returns the files of a path, pattern or folder if they hold points alone, else none."""
    possible = (
        [suffix for suffix in point_formats if files_in(path, suffix)] if path.is_dir() else []
    )
    suffix = possible[0] if possible else path.suffix.lower()
    if suffix not in point_formats:
        return []
    with formats.naming(path):
        results = [file for file in find_files(path, suffix, gaps).files if file is not None]
    with formats.naming(results[0]):
        is_mesh = suffix == ".ply" and "face" in read_elements(results[0])[0]
    return [] if is_mesh else results
