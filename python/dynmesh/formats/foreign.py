"""Formats of other packages: what they do wrong becomes an error that names the format."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from .._errors import InputError, of_library
from ..frames import FileFrames, Frame, Indices, Stored, check_frame
from ..header import Header
from .format import Format


def guarded(format: Format) -> Format:
    """The same format, of which every fault is an InputError that names it."""
    write = None if format.write is None else _writing(format)
    return replace(format, read=_reading(format), write=write)


def _reading(format: Format) -> Callable[..., Stored]:
    tried = f"format {format.name} cannot read it"

    def read(path: Path, **given: Any) -> Stored:
        with of_library(tried):
            frames = format.read(path, **given)
        if not isinstance(frames, Stored):
            what = type(frames).__name__
            raise InputError(f"{tried}: it returns {what}, not a Sequence or FileFrames")
        if isinstance(frames, FileFrames):
            vars(frames)["_frames"] = partial(_each, frames._frames, frames.header, tried)
        return frames

    return read


def _each(
    of_file: Callable[[Indices], Iterator[Frame]], header: Header, tried: str, numbers: Indices
) -> Iterator[Frame]:
    """Yields frames of a file, each of which is as their header says."""
    n_read = 0
    with of_library(tried):
        for frame in of_file(numbers):
            if not isinstance(frame, Frame):
                raise InputError(f"{tried}: it yields {type(frame).__name__}, not a Frame")
            check_frame(frame, header)
            n_read += 1
            if n_read > len(numbers):
                break
            yield frame
    if n_read != len(numbers):
        raise InputError(f"{tried}: it yields {n_read} frames instead of {len(numbers)}")


def _writing(format: Format) -> Callable[[Path, Header, Iterable[Frame]], Iterable[str] | None]:
    tried = f"format {format.name} cannot write it"

    def write(path: Path, header: Header, frames: Iterable[Frame]) -> Iterable[str] | None:
        assert format.write is not None
        with of_library(tried):
            remarks = format.write(path, header, frames)
            are_lines = isinstance(remarks, list | tuple) and all(
                isinstance(line, str) for line in remarks
            )
        if remarks is not None and not are_lines:
            raise InputError(f"{tried}: it returns {type(remarks).__name__}, not remarks or None")
        made = [file for file in path.parent.iterdir() if file.is_dir() or file.stat().st_size]
        if not (len(made) >= header.n_frames if format.is_per_frame else path in made):
            raise InputError(f"{tried}: it has written no file, or an empty one")
        return remarks

    return write
