"""Conversion of sequences: other formats, frames, axes, units and rates."""

from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass, replace
from typing import TypeAlias, Unpack

from .. import files
from .._checks import check_callable, check_path
from .._errors import KindError
from ..files import Frame, PathLike, Source
from ..files.memory import Collected, SequenceReader
from ..sequence import Sequence
from .conversion_options import ConversionKeywords, ConversionOptions
from .option import made_of, takes

Watch: TypeAlias = Callable[[Iterable[Frame], int], Iterable[Frame]]


@dataclass(frozen=True)
class ConversionReport:
    """What :func:`convert_file` has done.

    Attributes:
        frames: number of frames in the output.
        vertices: number of vertices of each.
        remarks: remarks about the output for the user, one line each.
    """

    frames: int
    vertices: int
    remarks: tuple[str, ...] = ()


@takes(ConversionOptions)
def convert_file(
    path: PathLike,
    output: PathLike,
    *,
    source: Source | None = None,
    output_format: str | None = None,
    overwrite: bool = False,
    watch: Watch = lambda frames, _: frames,
    **options: Unpack[ConversionKeywords],
) -> ConversionReport:
    """Writes a sequence in another format, with other frames, axes, units or rates, if asked for.

    Points are turned and scaled by `to_up`, `to_unit` and `scale` alone.

    Args:
        path: the sequence, in any format.
        output: path of the result.
        source: how to read the input, the keywords of :func:`dynmesh.open`.
        output_format: one of :data:`dynmesh.files.formats`; None means the format of the suffix.
        frames: a slice or range: the numbers of the first frame and of the one after the last;
            the frames keep their numbers.
        up: "x", "y" or "z", the up axis of a file that states none.
        unit: "m", "cm", "mm", "km", "inch", "foot", "yard" or metres: the unit of length of a file
            that states none.
        to_up: the points are turned by a quarter, such that this axis is up.
        to_unit: the points are scaled to this unit.
        scale: a further factor of the points.
        fps: frames per second; None means those of the input. The frames stay as they are.
        retime: frames per second to which the sequence is resampled, by linear interpolation
            between frames; the first one keeps its number. Between two frames, a vertex is known if
            it is in both.
        overwrite: whether to replace an existing output.
        watch: called with the frames and their number; it must pass the frames on.
        **options: those above.

    Raises:
        FileExistsError: the output exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written; the input
            states another axis or unit; or one is needed that nothing states.
    """
    check_path("path", path)
    check_path("output", output)
    check_callable("watch", watch)
    asked = made_of(ConversionOptions, options)
    asked.check()
    target = files.target_of(output, output_format)
    with files.open(path, **(source or {})) as reader:
        target.check(overwrite=overwrite, reader=reader)
        dropped = reader.has_provenance and not target.writer.keeps_provenance
        with files.naming(reader.path):
            conversion, indices = asked.conversion(reader.header)
        header = replace(
            conversion.header,
            has_provenance=reader.has_provenance and not dropped,
            has_standard_error=reader.header.has_standard_error and not dropped,
        )
        with (
            target.create(header, overwrite=overwrite) as writer,
            closing(reader.frames(indices.start, indices.stop, indices.step)) as frames,
        ):
            for frame in conversion.frames(watch(frames, len(indices))):
                values = frame.attributes()
                writer.append(frame.points, **{name: values[name] for name in header.attributes})
        remarks = [*writer.remarks, *conversion.remarks()]
    if dropped:
        remarks.append("generation and age are not written; this format cannot hold them")
    return ConversionReport(header.n_frames, header.n_vertices, tuple(remarks))


@takes(ConversionOptions)
def convert(sequence: Sequence, **options: Unpack[ConversionKeywords]) -> Sequence:
    """Returns a sequence with other frames, axes, units or rates.

    Args:
        sequence: the sequence, which stays as it is.
        **options: `frames`, `up`, `unit`, `to_up`, `to_unit`, `scale`, `fps` and `retime`, as
            :func:`convert_file` explains them.

    Raises:
        TypeError, ValueError: those of :func:`convert_file`.
    """
    if not isinstance(sequence, Sequence):
        raise KindError(f"must be a Sequence, not {type(sequence).__name__}", argument="sequence")
    asked = made_of(ConversionOptions, options)
    asked.check()
    reader = SequenceReader(sequence)
    with files.naming(reader.path):
        conversion, indices = asked.conversion(reader.header)
    made = Collected(conversion.header)
    for frame in conversion.frames(reader.frames(indices.start, indices.stop, indices.step)):
        made.append(frame.points, **frame.attributes())
    return made.sequence()
