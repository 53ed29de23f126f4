"""Completion from file to file: out of core, and able to go on after an interruption."""

import contextlib
import json
import os
import shutil
import time
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from . import files
from ._core import Completer, __version__
from ._lock import lock_folder
from .files import Header, PathLike, Reader, Writer
from .sequence import Positions
from .streaming import Settings, begin, complete_pairs, default_settings, push_all

Watch = Callable[[Iterator[Any], int, int], Iterator[Any]]


class Source(TypedDict, total=False):
    """How to read the input; :func:`dynmesh.open` documents the keywords."""

    format: str | None
    faces: NDArray[np.integer[Any]] | PathLike | None
    prim: str | None
    known: NDArray[np.bool_] | PathLike | None
    missing: Literal["zero"] | None


@dataclass(frozen=True)
class FileReport:
    """What :func:`complete_file` did.

    Attributes:
        frames: in the output, frame 0 among them.
        resumed_at: the first frame that this call completed, 0 unless it went on.
        seconds_per_frame: median time in :meth:`dynmesh.Completer.push`, without reading and
            writing; None where there was nothing to complete.
    """

    frames: int
    resumed_at: int
    seconds_per_frame: float | None


def complete_file(
    path: PathLike,
    output: PathLike,
    *,
    source: Source | None = None,
    output_format: str | None = None,
    fps: float | None = None,
    provenance: bool = False,
    overwrite: bool = False,
    resume: bool = False,
    watch: Watch | None = None,
    **settings: Unpack[Settings],
) -> FileReport:
    """Completes a sequence into a file, in constant memory.

    The output appears under its name when it is whole. Until then it grows in a hidden folder
    beside it, where the completer's state is saved every few seconds if the format can be
    continued. After an interruption, a full disk or a killed process that folder is still there,
    for `resume`; the next run without `resume` clears it.

    Args:
        path: the incomplete sequence, in any format; frame 0 must be whole.
        output: the completed sequence.
        source: how to read the input.
        output_format: one of :data:`dynmesh.files.formats`; None goes by the suffix.
        fps: frames per second of the output; None: what the input says.
        provenance: also write the generation and the age of every vertex.
        overwrite: replace an existing output.
        resume: go on where an interrupted run of the same job stopped; the result equals that of
            an uninterrupted one. Begins anew where there is nothing to go on with.
        watch: passes the frames on while they go by; it takes them, how many there are in all, and
            how many are done already.
        settings: those of :class:`dynmesh.Completer`.

    Raises:
        FileExistsError: the output exists.
        BlockingIOError: another process is writing it.
        OtherJobError: `resume` finds what another job left; it stays.
        OSError, ImportError, TypeError, ValueError: what :func:`dynmesh.open`,
            :func:`dynmesh.create` and :func:`dynmesh.complete` raise.
    """
    path, output = Path(path), Path(output)
    source = source or {}
    with files.open(path, **source) as reader:
        check_output(output, output_format, overwrite=overwrite, reader=reader)
        header = replace(
            reader.header, fps=fps or reader.fps, has_known=False, has_provenance=provenance
        )
        folder = unfinished_folder(output)
        with _folder_for(output, output_format), lock_folder(folder, output):
            job = _describe(reader, header, source, output_format, settings)
            checkpoint = _Checkpoint(folder / "checkpoint.npz", job)
            saved = checkpoint.load() if resume else None
            with _clearing(folder):
                files_folder = folder / "files"
                writer, saved = _begin_writer(output, header, output_format, files_folder, saved)
                start = 0 if saved is None else saved.frames
                seconds = []
                with (
                    writer,
                    files.naming(path),
                    contextlib.closing(reader.frames(start)) as frames,
                ):
                    watched = frames if watch is None else watch(frames, reader.n_frames, start)
                    for points, completer in _complete(reader, watched, saved, settings):
                        _append(writer, points, completer)
                        seconds.append(completer.report.seconds)
                        if writer.resumable and checkpoint.is_due():
                            writer.flush()
                            checkpoint.save(start + len(seconds), completer.state())
    pushed = seconds if start else seconds[1:]  # frame 0 is not pushed
    return FileReport(header.n_frames, start, float(np.median(pushed)) if pushed else None)


def unfinished_folder(output: Path) -> Path:
    """Where an output is until it is whole."""
    return output.with_name(f".{output.name}.unfinished")


def check_output(
    output: Path, format: str | None = None, *, overwrite: bool, reader: Reader | None = None
) -> None:
    """Refuses an output that would replace its own input or, unless asked to, anything else.

    Raises:
        FileExistsError, ValueError: it would.
        FileNotFoundError: there is no folder for it.
    """
    folder = (files.new_folder(output, format) or output).parent
    if not folder.is_dir():
        raise FileNotFoundError(f"{output}: there is no folder {folder}")
    existing = files.existing(output, format)
    inputs = [] if reader is None else reader.files
    for file in existing:
        if any(file.samefile(one) for one in inputs):
            raise ValueError(f"{file}: is the input; writing over it would lose it")
    if existing and not overwrite:
        raise FileExistsError(f"{existing[0]}: exists already; --overwrite replaces it")


@contextlib.contextmanager
def _folder_for(output: Path, format: str | None) -> Iterator[None]:
    """Makes the folder of an output that may have a new one, and removes it if it stays empty."""
    new = files.new_folder(output, format)
    if new is not None:
        new.mkdir()
    try:
        yield
    finally:
        if new is not None:
            with contextlib.suppress(OSError):  # it is in use
                new.rmdir()


class OtherJobError(ValueError):
    """What an interrupted run left is of another job than the one that should go on."""


class _Saved(NamedTuple):
    frames: int
    state: bytes


class _Checkpoint:
    """What is needed, beside the unfinished files, to go on."""

    least_seconds_between = 2.0
    most_of_the_time = 0.05

    def __init__(self, path: Path, job: str) -> None:
        self._path = path
        self._job = job
        self._next = time.monotonic() + self.least_seconds_between

    def load(self) -> _Saved | None:
        try:
            with np.load(self._path, allow_pickle=False) as saved:
                job, frames, state = str(saved["job"]), int(saved["frames"]), saved["state"]
        except FileNotFoundError:
            return None
        except (ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
            raise ValueError(
                f"{self._path}: is damaged; without --resume the job begins anew"
            ) from error
        if job != self._job:
            changed = ", ".join(_differences(json.loads(job), json.loads(self._job)))
            raise OtherJobError(
                f"{self._path}: is of another job, as these changed: {changed}; "
                "without --resume the job begins anew"
            )
        return _Saved(frames, state.tobytes())

    def is_due(self) -> bool:
        return time.monotonic() >= self._next

    def save(self, frames: int, state: bytes) -> None:
        began = time.monotonic()
        partial = self._path.with_suffix(".part")
        with partial.open("wb") as file:
            bytes_of_state = np.frombuffer(state, np.uint8)
            np.savez(file, job=self._job, frames=frames, state=bytes_of_state)
        partial.replace(self._path)
        now = time.monotonic()
        pause = (now - began) / self.most_of_the_time
        self._next = now + max(self.least_seconds_between, pause)


@contextlib.contextmanager
def _clearing(folder: Path) -> Iterator[None]:
    """Removes the unfinished folder, unless an interruption left there what `resume` can use."""
    try:
        yield
    except (ValueError, TypeError):  # of the input, or of the job itself: no use to go on
        shutil.rmtree(folder, ignore_errors=True)
        raise
    except BaseException:
        if not (folder / "checkpoint.npz").exists():
            shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder, ignore_errors=True)


def _begin_writer(
    output: Path, header: Header, format: str | None, folder: Path, saved: _Saved | None
) -> tuple[Writer, _Saved | None]:
    if saved is not None:
        # A process that was killed while it finished its file may have left less than it had.
        with contextlib.suppress(OSError, ValueError):
            writer = files.begin(
                output, header, format=format, folder=folder, resume_at=saved.frames
            )
            return writer, saved
    (folder.parent / "checkpoint.npz").unlink(missing_ok=True)
    return files.begin(output, header, format=format, folder=folder), None


def _complete(
    reader: Reader, frames: Iterator[Any], saved: _Saved | None, settings: Settings
) -> Iterator[tuple[Positions, Completer]]:
    if saved is None:
        return complete_pairs(reader.faces, frames, **settings)
    points, known = next(reader.frames(stop=1))
    completer = begin(reader.faces, points, known, **settings)
    completer.restore(saved.state)
    return push_all(completer, frames, saved.frames)


def _append(writer: Writer, points: Positions, completer: Completer) -> None:
    if writer.header.has_provenance:
        writer.append(points, generation=completer.generation, age=completer.age)
    else:
        writer.append(points)


def _describe(
    reader: Reader, header: Header, source: Source, format: str | None, settings: Settings
) -> str:
    """Everything on which the output depends, as JSON."""
    inputs = [*reader.files]
    masks = source.get("known")
    if isinstance(masks, str | os.PathLike):
        inputs.append(Path(masks))
    description: dict[str, Any] = {
        "version": __version__,
        "input": [[str(p), p.stat().st_size, p.stat().st_mtime_ns] for p in inputs],
        "known": zlib.crc32(masks.tobytes()) if isinstance(masks, np.ndarray) else None,
        "faces": zlib.crc32(header.faces.tobytes()),
        "missing": source.get("missing"),
        "prim": header.name,
        "fps": header.fps,
        "provenance": header.has_provenance,
        "format": format,
        **{**default_settings, **settings},
    }
    return json.dumps(description)


def _differences(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    return sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))
