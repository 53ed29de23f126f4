"""Formats of other packages: what they do wrong becomes an error that names the format."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from .._errors import InputError, locating, of_library
from ..frame import FileFrames, Frame, Frames, Indices, Stored, check_frame
from ..header import Header
from .format import Format, Write
from .names import FrameNames


def guarded(format: Format) -> Format:
    """The same format, of which every fault is an InputError that names it."""
    reads, writes = (f"format {format.name} cannot {verb} it" for verb in ("read", "write"))
    meshes, existing = format.meshes, format.existing
    return replace(
        format,
        read=partial(_read, format, reads),
        write=_writing(format, format.write, writes),
        overlay=_writing(format, format.overlay, writes),
        meshes=meshes and of_library(reads)(lambda path: dict(meshes(path))),
        existing=existing and of_library(writes)(lambda *given: [*map(Path, existing(*given))]),
    )


def _read(format: Format, tried: str, path: Path, **given: Any) -> Stored:
    with of_library(tried):
        frames = format.read(path, **given)
    if not isinstance(frames, Stored):
        what = type(frames).__name__
        raise InputError(f"{tried}: it returns {what}, not a Sequence or FileFrames")
    if isinstance(frames, FileFrames):
        of_file = partial(_each, frames._frames, frames.header, tried)
        vars(frames).update(_frames=of_file, _close=of_library(tried)(frames._close))
    return frames


def _each(of_file: Any, header: Header, tried: str, numbers: Indices) -> Iterator[Frame]:
    """Yields frames of a file, each of which is as their header says."""
    n_read = 0
    with of_library(tried):
        for frame in of_file(numbers):
            if not isinstance(frame, Frame):
                raise InputError(f"{tried}: it yields {type(frame).__name__}, not a Frame")
            if n_read == len(numbers):
                n_read += 1
                break
            with locating(frame=header.number(numbers[n_read])):
                check_frame(frame, header)
            n_read += 1
            yield frame
    if n_read != len(numbers):
        raise InputError(f"{tried}: it yields {n_read} frames instead of {len(numbers)}")


def _writing(format: Format, function: Write | None, tried: str) -> Write | None:
    if function is None:
        return None

    def write(path: Path, header: Header, frames: Frames) -> Iterable[str] | None:
        with of_library(tried):
            remarks = function(path, header, frames)
            are_lines = isinstance(remarks, list | tuple) and all(
                isinstance(line, str) for line in remarks
            )
        if remarks is not None and not are_lines:
            raise InputError(f"{tried}: it returns {type(remarks).__name__}, not remarks or None")
        names = FrameNames.of(path)
        is_own = names.number if format.is_per_frame else {path.name: 0}.get
        made = [one for one in path.parent.iterdir() if is_own(one.name) is not None]
        if sum(one.is_dir() or one.stat().st_size > 0 for one in made) < (
            header.n_frames if format.is_per_frame else 1
        ):
            raise InputError(f"{tried}: it has written no file, or an empty one")
        return remarks

    return write
