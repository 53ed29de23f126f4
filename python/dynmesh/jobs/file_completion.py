"""Completion from file to file, in constant memory, with support for interruptions."""

import contextlib
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, Unpack

import numpy as np

from .. import files
from .._checks import check_path
from .._core import Completer, FrameReport
from .._errors import InputError, KindError
from ..files import Frame, Header, PathLike, Reader, Target, Writer
from ..sequence import Positions
from ..settings import Settings, all_settings, takes_settings
from ..streaming import begin, complete_pairs, push_all
from .checkpoint import Checkpoint, Saved, Source, describe_job
from .lock import lock_folder

Watch = Callable[[Iterator[Any], int, int], Iterator[Any]]


@dataclass(frozen=True)
class FileReport:
    """What :func:`complete_file` has done.

    Attributes:
        frames: number of frames in the output, including frame 0.
        resumed_at: the first frame that this call completed: 0 unless a run was continued, and
            `frames` if no frame was left to complete.
        seconds_per_frame: median time of :meth:`dynmesh.Completer.push`, without reading and
            writing; None if there was nothing to complete.
        known: number of known vertices, summed over the frames that this call completed, without
            frame 0.
        filled: number of vertices that were filled in.
        unseen: number of vertices that no edges connected to a known one.
        rejected: number of vertices that were observed but treated as missing: see
            `reject_outliers`.
        remarks: remarks about the output for the user, one line each.
        existed: whether `resume` found a complete output, so that nothing was done.
    """

    frames: int
    resumed_at: int
    seconds_per_frame: float | None
    known: int
    filled: int
    unseen: int
    rejected: int
    remarks: tuple[str, ...] = ()
    existed: bool = False


@takes_settings
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
    overlay: bool = False,
    watch: Watch | None = None,
    **settings: Unpack[Settings],
) -> FileReport:
    """Completes a sequence and writes the result to a file, in constant memory.

    The output appears under its name when it is complete. Until then it is in a hidden folder
    beside it, where the completer's state is saved every few seconds if the format can be resumed.
    The folder remains after an interruption, a full disk or a killed process, and `resume`
    continues from it; a run without `resume` deletes it. If a process was killed while it moved
    several finished files to their destinations, the next run first moves the remaining ones.

    Args:
        path: the incomplete sequence, in any format; frame 0 must be complete.
        output: path of the completed sequence.
        source: how to read the input.
        output_format: one of :data:`dynmesh.files.formats`; None means the format of the suffix.
        fps: frames per second of the output; None means those of the input.
        provenance: whether to write the generation and the age of every vertex.
        overwrite: whether to replace an existing output.
        resume: whether to continue an interrupted run of the same job; the result equals that of an
            uninterrupted run. Starts from frame 0 if there is nothing to continue. Does nothing if
            the output exists with as many frames and vertices as the input, no unfinished output is
            beside it and `overwrite` is not set. These formats can be resumed: npz, hdf5, npy, pc2,
            mdd, ply, obj and pvd.
        overlay: whether to write a USD layer that holds the completed points and what follows from
            them, with the input, a USD stage, as its sublayer.
        watch: called with the frames, their number and the number of frames already completed; it
            must pass the frames on.
        **settings: `method`, `noise` and the other settings of :class:`dynmesh.Completer`, which
            explains them.

    Raises:
        FileExistsError: the output exists, and `resume` does not find it complete.
        BlockingIOError: another process is writing it.
        OtherJobError: `resume` finds unfinished files of another job, which are kept.
        ValueError: `resume` is set, but the format cannot be resumed.
        OSError, ImportError, TypeError, ValueError: the errors of :func:`dynmesh.open`,
            :func:`dynmesh.create` and :func:`dynmesh.complete`, with the name of the file unless a
            setting is refused.
    """
    check_path("path", path)
    check_path("output", output)
    if watch is not None and not callable(watch):
        raise KindError(f"must be callable, not {watch!r}", argument="watch")
    target = files.target_of(output, output_format, overlay=overlay)
    if resume and not target.writer.resumable:
        able = [f.name for f in files.formats.values() if f.writer and f.writer.resumable]
        raise InputError(
            f"this format cannot be resumed; {files.listed(able)} can", file=target.path
        )
    how = How(fps, provenance, overwrite, resume, watch)
    return complete_into(Path(path), target, source or {}, how, all_settings(settings))


class How(NamedTuple):
    """The arguments of :func:`complete_file` that are neither files nor settings."""

    fps: float | None = None
    provenance: bool = False
    overwrite: bool = False
    resume: bool = False
    watch: Watch | None = None


def complete_into(
    path: Path, target: Target, source: Source, how: How, settings: Settings
) -> FileReport:
    """As :func:`complete_file`, with the output's format chosen and all settings given."""
    output = target.path
    with files.open(path, **source) as reader:
        header = replace(
            reader.header,
            fps=reader.fps if how.fps is None else how.fps,
            has_known=False,
            has_provenance=how.provenance,
        )
        folder = unfinished_folder(output)
        job = describe_job(reader, header, source, target.format, settings)
        checkpoint = Checkpoint(folder / "checkpoint.npz", job)
        settled = _settle(folder, output, checkpoint)
        complete = how.resume and not how.overwrite and not checkpoint.exists()
        complete = complete and _is_complete(target, header)
        target.check(overwrite=how.overwrite or complete, reader=reader)
        if complete:
            n = header.n_frames
            return FileReport(n, n, None, 0, 0, 0, 0, existed=not settled)
        with _folder_for(target), lock_folder(folder, output):
            saved = checkpoint.load() if how.resume else None
            with _clearing(folder):
                writer, saved = _begin_writer(target, reader, header, folder / "files", saved)
                start = 0 if saved is None else saved.frames
                reports: list[FrameReport] = []
                with (
                    writer,
                    files.naming(path),
                    contextlib.closing(reader.frames(start)) as frames,
                ):
                    watched: Iterator[Any] = frames
                    if how.watch is not None:
                        watched = how.watch(frames, reader.n_frames, start)
                    for points, completer in _complete(reader, watched, saved, settings):
                        _append(writer, points, completer)
                        reports.append(completer.report)
                        if writer.resumable and checkpoint.is_due():
                            writer.flush()
                            checkpoint.save(start + len(reports), completer.state())
                    if writer.resumable and reports:
                        writer.flush()
                        checkpoint.save(start + len(reports), completer.state())
    pushed = reports if start else reports[1:]  # frame 0 is not pushed
    return FileReport(
        frames=header.n_frames,
        resumed_at=start,
        seconds_per_frame=float(np.median([r.seconds for r in pushed])) if pushed else None,
        known=sum(report.known for report in pushed),
        filled=sum(report.filled for report in pushed),
        unseen=sum(report.unseen for report in pushed),
        rejected=sum(report.rejected for report in pushed),
        remarks=tuple(writer.remarks),
    )


def _settle(folder: Path, output: Path, checkpoint: Checkpoint) -> bool:
    """Finishes a run that was killed while it moved its files; returns whether it was this job."""
    if not folder.exists():
        return False
    with lock_folder(folder, output):
        placed = files.finish_placing(folder / "files")
        same = placed and checkpoint.is_of_this_job()  # saved before the files were moved
        if placed or not checkpoint.exists():
            _clear(folder)
    return same


def _clear(folder: Path) -> None:
    """Removes an unfinished folder, the checkpoint first, so that no run can resume from it."""
    (folder / "checkpoint.npz").unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)


def unfinished_folder(output: Path) -> Path:
    """Returns the folder that holds an output until it is complete."""
    return output.with_name(f".{output.name}.unfinished")


def is_unfinished(output: Path) -> bool:
    """Whether an interrupted run left a checkpoint that `resume` can use."""
    return (unfinished_folder(output) / "checkpoint.npz").exists()


def _is_complete(target: Target, header: Header) -> bool:
    """Whether the output exists and has the size of the job's result."""
    if not target.existing():
        return False
    with (
        contextlib.suppress(OSError, ValueError),
        files.open(target.path, format=target.format) as made,
    ):
        return (made.n_frames, made.n_vertices) == (header.n_frames, header.n_vertices)
    return False


@contextlib.contextmanager
def _folder_for(target: Target) -> Iterator[None]:
    """Creates the folder of an output if it needs one, and removes it if it stays empty."""
    new = target.new_folder()
    if new is not None:
        new.mkdir()
    try:
        yield
    finally:
        if new is not None:
            with contextlib.suppress(OSError):  # the folder is not empty
                new.rmdir()


@contextlib.contextmanager
def _clearing(folder: Path) -> Iterator[None]:
    """Removes the unfinished folder, unless an interruption left a checkpoint in it."""
    try:
        yield
    except (ValueError, TypeError):  # resuming would fail again
        _clear(folder)
        raise
    except BaseException:
        if not (folder / "checkpoint.npz").exists():
            _clear(folder)
        raise
    _clear(folder)


def _begin_writer(
    target: Target, reader: Reader, header: Header, folder: Path, saved: Saved | None
) -> tuple[Writer, Saved | None]:
    if saved is not None:
        # A process that was killed while it finished its file may have left an incomplete one.
        with contextlib.suppress(OSError, ValueError):
            return target.create(header, folder=folder, resume_at=saved.frames), saved
    (folder.parent / "checkpoint.npz").unlink(missing_ok=True)
    return target.create(header, folder=folder, origin=target.kept_of(reader)), None


def _complete(
    reader: Reader, frames: Iterator[Any], saved: Saved | None, settings: Settings
) -> Iterator[tuple[Positions, Completer]]:
    if saved is None:
        return complete_pairs(reader.faces, beginning_whole(frames), **settings)
    points, known = next(reader.frames(stop=1))
    completer = begin(reader.faces, points, known, **settings)
    completer.restore(saved.state)
    return push_all(completer, frames, saved.frames)


def beginning_whole(frames: Iterator[Frame]) -> Iterator[Frame]:
    """Refuses a frame 0 with missing vertices and reports how many there are."""
    for number, frame in enumerate(frames):
        if number == 0:
            points, known = frame.points, frame.known
            there = np.isfinite(points).all(axis=1) if known is None else known
            missing = np.flatnonzero(~there)
            if len(missing):
                raise InputError(
                    f"{len(missing)} of {len(points)} vertices "
                    f"{'is' if len(missing) == 1 else 'are'} missing, the first is vertex "
                    f"{missing[0]}; completion starts from frame 0: start at a complete frame, "
                    "which `dynmesh info` names, or take frame 0 from a template",
                    frame=0,
                )
        yield frame


def _append(writer: Writer, points: Positions, completer: Completer) -> None:
    if writer.header.has_provenance:
        writer.append(points, generation=completer.generation, age=completer.age)
    else:
        writer.append(points)
