"""Conversion of sequences: other formats, frames, axes, units and rates."""

from contextlib import closing
from pathlib import Path

import numpy as np

from .. import files
from .._checks import check_path
from .._command import How, Output, What
from .._errors import InputError, KindError, numbering
from .._progress import tracked
from .._report import Written
from ..files import PathLike, Source
from ..files.conversion import Axis, Changes, Unit
from ..files.format import Gaps
from ..files.header import Header
from ..files.memory import Collected, SequenceReader
from ..files.new_output import check_output, making
from ..files.numbered import files_in, find_files
from ..files.ply import read_elements
from ..scans import PointScan, read_points, write_ply
from ..scans.point_files import point_formats
from ..scans.reader import CAMERAS
from ..scans.writer import check_name_of_folder
from ..sequence import Sequence


def convert_file(
    path: PathLike,
    output: PathLike,
    *,
    frames: What[slice | range | None] = None,
    up: What[Axis | None] = None,
    unit: What[Unit | None] = None,
    format: What[str | None] = None,
    source: Source | None = None,
    to_up: How[Axis | None] = None,
    to_unit: How[Unit | None] = None,
    scale: How[float | None] = None,
    fps: How[float | None] = None,
    output_format: Output[str | None] = None,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> Written:
    """Writes a sequence in another format, or with other frames, axes, units or rates.

    Points are turned and scaled by `to_up`, `to_unit` and `scale` alone. docs/formats.md says what
    each format keeps. Files that hold points alone, as scanners write them, become PLY files; those
    of a folder keep their names.

    Args:
        path: the sequence: a file, a folder, or a pattern such as 'scans/*.ply'.
        output: the result.
        frames: from the number of the first frame to that after the last one, such as 1001:1050;
            the frames keep their numbers.
        up: the up axis of a file that states none.
        unit: the unit of length of a file that states none: m, cm, mm, km, inch, foot, yard, or a
            number of metres.
        format: the format of the file, if its suffix does not say it.
        source: how to read the file.
        to_up: turn the points so that this axis is up.
        to_unit: scale the points to this unit.
        scale: multiply the points by this.
        fps: frames per second; the frames stay as they are.
        output_format: the format of the result, if its suffix does not say it.
        overwrite: whether to replace an existing output.
        progress: whether to show on standard error how far it is.

    Raises:
        FileExistsError: the output exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written; the input
            states another axis or unit; or one is needed that nothing states.
    """
    check_path("path", path)
    check_path("output", output)
    changes = Changes(frames, up, unit, to_up, to_unit, scale, fps)
    gaps = (source or {}).get("gaps", "refuse")
    if {*(source or {})} <= {"gaps"} and not format and (clouds := _clouds_in(Path(path), gaps)):
        if output_format not in (None, "ply"):
            told = f"must be ply for point clouds, not {output_format}"
            raise InputError(told, argument="output_format", value=output_format)
        return _convert_clouds(clouds, Path(path), Path(output), changes, overwrite, progress)
    named = Path(output) if output_format else files.named_like(path, output)
    target = files.target_of(named, output_format)
    with files.open(path, format=format, **(source or {})) as reader:
        target.check(overwrite=overwrite, reader=reader)
        with files.naming(reader.path):
            conversion, indices = changes.of(reader.header)
        header, dropped = target.holding(conversion.header)
        with (
            numbering(reader.path, header.number),
            target.create(header, overwrite=overwrite) as writer,
            closing(reader.frames(indices.start, indices.stop, indices.step)) as read,
        ):
            for frame in conversion.frames(tracked(read, len(indices), "converting", progress)):
                values = frame.attributes()
                writer.append(frame.points, **{name: values[name] for name in header.attributes})
    return Written(
        output=Path(output),
        frames=header.n_frames,
        vertices=header.n_vertices,
        remarks=(*writer.remarks, *dropped),
    )


def _convert_clouds(
    clouds: list[Path],
    path: Path,
    output: Path,
    changes: Changes,
    overwrite: bool,
    progress: bool,
) -> Written:
    """Writes point clouds with other axes or units."""
    for name in ("frames", "fps"):
        if getattr(changes, name) is not None:
            raise InputError("is for sequences, not for point clouds", argument=name)
    outputs = [output]
    if path not in clouds:
        check_name_of_folder(output)
        outputs = [output / f"{file.stem}.ply" for file in clouds]
    for file in outputs:
        check_output(file, overwrite, ".ply", inputs=clouds)
    n_points, pairs = 0, zip(clouds, outputs, strict=True)
    with making(output) as hidden:
        for source, file in tracked(pairs, len(outputs), "converting", progress):
            with files.naming(source):
                scan, said = read_points(source)
                size, no_faces = len(scan.points), np.zeros((0, 3), np.int64)
                own = Header(no_faces, 1, size, scan.points.dtype, **said._asdict())
                conversion, _ = changes.of(own)
                points, normals = conversion.moved(scan.points), scan.normals
            if normals is not None:
                normals = np.asarray(normals @ conversion.turn.T, normals.dtype)
            made, header = PointScan(points, normals, None), conversion.header
            write_ply(hidden / file.name, made, header.metres_per_unit, header.up_axis)
            n_points += size
        for file in outputs:
            check_output(file, overwrite, ".ply")  # another process may have written it
            file.parent.mkdir(exist_ok=True)
            (hidden / file.name).replace(file)
    has_cameras = ((path if path.is_dir() else path.parent) / CAMERAS).exists()
    remark = f"{CAMERAS} is not written; that of the scans holds for their unit and axes only"
    return Written(
        output=output,
        frames=len(outputs),
        vertices=n_points // len(outputs),
        remarks=(remark,) if has_cameras else (),
    )


def _clouds_in(path: Path, gaps: Gaps) -> list[Path]:
    """Returns the files of a path, pattern or folder if they hold points alone, else none."""
    possible = [one for one in point_formats if files_in(path, one)] if path.is_dir() else []
    suffix = possible[0] if possible else path.suffix.lower()
    if suffix not in point_formats:
        return []
    with files.naming(path):
        found = [file for file in find_files(path, suffix, gaps).files if file is not None]
    with files.naming(found[0]):
        is_mesh = suffix == ".ply" and "face" in read_elements(found[0])[0]
    return [] if is_mesh else found


def convert(
    sequence: Sequence,
    *,
    frames: slice | range | None = None,
    up: Axis | None = None,
    unit: Unit | None = None,
    to_up: Axis | None = None,
    to_unit: Unit | None = None,
    scale: float | None = None,
    fps: float | None = None,
) -> Sequence:
    """Returns a sequence with other frames, axes, units or rates.

    The sequence stays as it is. The arguments and errors are those of :func:`convert_file`.
    """
    if not isinstance(sequence, Sequence):
        raise KindError(f"must be a Sequence, not {type(sequence).__name__}", argument="sequence")
    changes = Changes(frames, up, unit, to_up, to_unit, scale, fps)
    reader = SequenceReader(sequence)
    with files.naming(reader.path):
        conversion, indices = changes.of(reader.header)
    made = Collected(conversion.header)
    for frame in conversion.frames(reader.frames(indices.start, indices.stop, indices.step)):
        made.append(frame.points, **frame.attributes())
    return made.sequence()
