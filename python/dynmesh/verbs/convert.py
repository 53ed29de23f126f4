"""Conversion of sequences: other formats, frames, axes, units and rates."""

import contextlib
import os
from collections import Counter
from collections.abc import Generator, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import formats
from .._checks import path_of
from .._errors import InputError, naming, numbering
from .._options import Input, Method
from .._report import Report, tracked
from ..formats import OneSequence, Written
from ..formats.conversion import Changes, Unit
from ..formats.format import Gaps
from ..formats.names import files_in, find_files
from ..formats.output import new_folder, new_output, refuse_inputs
from ..formats.ply import read_elements
from ..frame import Frame
from ..header import Axis, Header
from ..polygons import Faces
from ..run import Run
from ..scans import PointScan, ScanRun, read_points, write_ply
from ..scans.cameras import CAMERAS
from ..scans.point_files import point_formats
from ..scans.writer import check_name_of_folder
from ..sequence import result_of

_OF_CLOUDS = ("up", "unit", "to_up", "to_unit", "scale")
"""What can be changed of point clouds."""


def convert(
    sequence: OneSequence,
    faces: Faces | None = None,
    *,
    frames: Input[slice | range | None] = None,
    up: Input[Axis | None] = None,
    unit: Input[Unit | None] = None,
    to_up: Method[Axis | None] = None,
    to_unit: Method[Unit | None] = None,
    scale: Method[float | None] = None,
    fps: Method[float | None] = None,
    progress: bool | None = None,
) -> Run[Report] | Any:
    """Changes the format of a sequence, its frames, axes, units or rate.

    Points are turned and scaled by `to_up`, `to_unit` and `scale` alone. docs/formats.md says what
    each format keeps. Files that hold points alone, as scanners write them, become PLY files; those
    of a folder keep their names.

    Args:
        sequence: a file, frames, a sequence in memory, positions (n, k, 3) or meshes.
        faces: of positions alone.
        frames: from the number of the first frame to that after the last one, such as 1001:1050;
            the frames keep their numbers.
        up: the up axis of a file that states none.
        unit: the unit of length of a file that states none: m, cm, mm, km, inch, foot, yard, or a
            number of metres.
        to_up: turn the points so that this axis is up.
        to_unit: scale the points to this unit.
        scale: multiply the points by this.
        fps: frames per second; the frames stay as they are.
        progress: whether to show on standard error how far it is; None for what takes long, in a
            terminal.

    Returns:
        The converted frames: a :class:`dynmesh.Sequence` of frames in memory; of others, a
        :class:`dynmesh.frames.Run`, whose frames are made when they are gone through. Of point
        clouds, a :class:`dynmesh.scans.ScanRun`.
    """
    given: dict[str, Any] = {"frames": frames, "up": up, "unit": unit, "to_up": to_up}
    given |= {"to_unit": to_unit, "scale": scale, "fps": fps}
    changes = Changes(**given)
    if isinstance(sequence, str | os.PathLike):
        clouds = convert_clouds(path_of("sequence", sequence), progress=progress, **given)
        if clouds is not None:
            return clouds
    with contextlib.ExitStack() as stack:
        source = stack.enter_context(formats.opened(sequence, faces=faces))
        with naming(source.path):
            conversion, indices = changes.of(source.header)

        def make() -> Generator[Frame, None, Report]:
            chosen = source.frames(indices.start, indices.stop, indices.step)
            with numbering(source.path, source.header.number), closing(chosen):
                yield from conversion.frames(tracked(chosen, len(indices), "converting", progress))
            before: Report | None = source.report
            return Report() if before is None else replace(before, remarks=())

        origin = source.origin
        if origin is not None and conversion.changed:
            origin = origin.after(conversion.changed)
        close = stack.pop_all().close
        run: Run[Report] = Run(conversion.header, make, source, origin=origin, close=close)
    return result_of(run, source)


def convert_clouds(
    path: Path, gaps: Gaps = "refuse", progress: bool | None = None, **given: Any
) -> ScanRun | None:
    """Point clouds with other axes or units; None if a path is not of point clouds.

    The keywords are those of :func:`convert`.
    """
    clouds = _clouds_in(path, gaps)
    if not clouds:
        return None
    for name, value in given.items():
        if name not in _OF_CLOUDS and value is not None:
            message = "is for sequences, not for point clouds"
            raise InputError(message, argument=name, value=value)
    changes, headers = Changes(**given), list[Header]()

    def converted() -> Iterator[PointScan]:
        for cloud in clouds:
            scan, header = _converted(cloud, changes)
            headers.append(header)
            yield scan

    def save(output: Path, overwrite: bool, scans: Iterator[Any]) -> Written:
        if path in clouds:
            with new_output(output, overwrite, ".ply", inputs=clouds) as file:
                n_points = _write(file, next(scans), headers[-1])
        else:
            check_name_of_folder(output)
            names = [f"{file.stem}.ply" for file in clouds]
            if twice := next((name for name, n in Counter(names).items() if n > 1), None):
                message = f"several would be {twice}; convert each folder on its own"
                raise InputError(message, file=output)
            refuse_inputs(output.glob("*"), clouds)
            with new_folder(output, overwrite, lambda file: file.name in names) as hidden:
                each = tracked(zip(names, scans, strict=True), len(clouds), "converting", progress)
                n_points = sum(_write(hidden / name, scan, headers[-1]) for name, scan in each)
        has_cameras = ((path if path.is_dir() else path.parent) / CAMERAS).exists()
        remark = f"{CAMERAS} is not written; that of the scans holds for their unit and axes only"
        return Written(
            output=output,
            frames=len(clouds),
            vertices=n_points // len(clouds),
            remarks=(remark,) if has_cameras else (),
        )

    return ScanRun(len(clouds), converted(), save)


def _write(file: Path, scan: PointScan, header: Header) -> int:
    """Writes a point cloud; returns how many points it has."""
    write_ply(file, scan, header.metres_per_unit, header.up_axis)
    return len(scan.points)


def _converted(path: Path, changes: Changes) -> tuple[PointScan, Header]:
    """The points of a file with other axes or units, and what is said of them."""
    with formats.naming(path):
        scan, said = read_points(path)
        size, no_faces = len(scan.points), np.zeros((0, 3), np.int64)
        conversion, _ = changes.of(Header(no_faces, 1, size, scan.points.dtype, **said._asdict()))
        points, normals = conversion.moved(scan.points), scan.normals
    if normals is not None:
        normals = np.asarray(normals @ conversion.turn.T, normals.dtype)
    return scan._replace(points=points, normals=normals), conversion.header


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
