"""Completion from file to file: out of core, and able to go on after an interruption."""

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
    """What :func:`complete_file` did.

    Attributes:
        frames: in the output, frame 0 among them.
        resumed_at: the first frame that this call completed, 0 unless it went on, `frames` where
            none was left to complete.
        seconds_per_frame: median time in :meth:`dynmesh.Completer.push`, without reading and
            writing; None where there was nothing to complete.
        known: how many vertices were known in the frames that this call completed, all of them
            together and frame 0 not among them.
        filled: how many were filled in.
        unseen: how many no chain of edges tied to a known one.
        rejected: how many were observed, but taken as missing: see `reject_outliers`.
        remarks: what else a user should know of the output, a line each.
        existed: whether `resume` found the output complete, so that nothing was done.
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
    watch: Watch | None = None,
    **settings: Unpack[Settings],
) -> FileReport:
    """Completes a sequence into a file, in constant memory.

    The output appears under its name when it is whole. Until then it grows in a hidden folder
    beside it, where the completer's state is saved every few seconds if the format can be
    continued. After an interruption, a full disk or a killed process that folder is still there,
    for `resume`; the next run without `resume` clears it. A process that was killed while it moved
    the several files of an output to their places is finished first of all by the next one.

    Args:
        path: the incomplete sequence, in any format; frame 0 must be whole.
        output: the completed sequence.
        source: how to read the input.
        output_format: one of :data:`dynmesh.files.formats`; None goes by the suffix.
        fps: frames per second of the output; None: what the input says.
        provenance: also write the generation and the age of every vertex.
        overwrite: replace an existing output.
        resume: go on where an interrupted run of the same job stopped; the result equals that of
            an uninterrupted one. Begins anew where there is nothing to go on with. Does nothing
            where the output exists, with as many frames and vertices as the input, and no
            unfinished one is beside it, unless it is to be overwritten. Only some formats can be
            resumed: npz, hdf5, npy, pc2, mdd, ply, obj and pvd.
        watch: passes the frames on while they go by; it takes them, how many there are in all, and
            how many are done already.
        **settings: `method`, `noise` and the other settings of :class:`dynmesh.Completer`, which
            explains them.

    Raises:
        FileExistsError: the output exists, and `resume` does not find it complete.
        BlockingIOError: another process is writing it.
        OtherJobError: `resume` finds what another job left; it stays.
        ValueError: `resume` is asked of a format that cannot.
        OSError, ImportError, TypeError, ValueError: what :func:`dynmesh.open`,
            :func:`dynmesh.create` and :func:`dynmesh.complete` raise; with the file's name, unless
            a setting is refused.
    """
    check_path("path", path)
    check_path("output", output)
    if watch is not None and not callable(watch):
        raise KindError(f"must be callable, not {watch!r}", argument="watch")
    target = files.target_of(output, output_format)
    if resume and not target.writer.resumable:
        able = [f.name for f in files.formats.values() if f.writer and f.writer.resumable]
        raise InputError(
            f"files of this format cannot be resumed; {files.listed(able)} can", file=target.path
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
                writer, saved = _begin_writer(target, header, folder / "files", saved)
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
    """Ends what an earlier run was killed at the very end of; whether it was the same job."""
    if not folder.exists():
        return False
    with lock_folder(folder, output):
        placed = files.finish_placing(folder / "files")
        same = placed and checkpoint.is_of_this_job()  # saved when the writer had begun
        if placed or not checkpoint.exists():
            _clear(folder)
    return same


def _clear(folder: Path) -> None:
    """Removes an unfinished folder: first of all what makes another run go on with it."""
    (folder / "checkpoint.npz").unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)


def unfinished_folder(output: Path) -> Path:
    """Where an output is until it is whole."""
    return output.with_name(f".{output.name}.unfinished")


def is_unfinished(output: Path) -> bool:
    """Whether an interrupted run left what `resume` can go on with."""
    return (unfinished_folder(output) / "checkpoint.npz").exists()


def _is_complete(target: Target, header: Header) -> bool:
    """Whether the output exists, and can be what the job makes."""
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
    """Makes the folder of an output that may have a new one, and removes it if it stays empty."""
    new = target.new_folder()
    if new is not None:
        new.mkdir()
    try:
        yield
    finally:
        if new is not None:
            with contextlib.suppress(OSError):  # it is in use
                new.rmdir()


@contextlib.contextmanager
def _clearing(folder: Path) -> Iterator[None]:
    """Removes the unfinished folder, unless an interruption left there what `resume` can use."""
    try:
        yield
    except (ValueError, TypeError):  # of the input, or of the job itself: no use to go on
        _clear(folder)
        raise
    except BaseException:
        if not (folder / "checkpoint.npz").exists():
            _clear(folder)
        raise
    _clear(folder)


def _begin_writer(
    target: Target, header: Header, folder: Path, saved: Saved | None
) -> tuple[Writer, Saved | None]:
    if saved is not None:
        # A process that was killed while it finished its file may have left less than it had.
        with contextlib.suppress(OSError, ValueError):
            return target.create(header, folder=folder, resume_at=saved.frames), saved
    (folder.parent / "checkpoint.npz").unlink(missing_ok=True)
    return target.create(header, folder=folder), None


def _complete(
    reader: Reader, frames: Iterator[Any], saved: Saved | None, settings: Settings
) -> Iterator[tuple[Positions, Completer]]:
    if saved is None:
        return complete_pairs(reader.faces, _beginning_whole(frames), **settings)
    points, known = next(reader.frames(stop=1))
    completer = begin(reader.faces, points, known, **settings)
    completer.restore(saved.state)
    return push_all(completer, frames, saved.frames)


def _beginning_whole(frames: Iterator[Frame]) -> Iterator[Frame]:
    """Refuses a frame 0 with holes, and says how large they are."""
    for number, frame in enumerate(frames):
        if number == 0:
            points, known = frame.points, frame.known
            there = np.isfinite(points).all(axis=1) if known is None else known
            missing = np.flatnonzero(~there)
            if len(missing):
                raise InputError(
                    f"{len(missing)} of {len(points)} vertices "
                    f"{'is' if len(missing) == 1 else 'are'} missing, vertex {missing[0]} first; "
                    "all motion begins there: begin at a whole frame, which `dynmesh info` names, "
                    "or fill frame 0 from a template",
                    frame=0,
                )
        yield frame


def _append(writer: Writer, points: Positions, completer: Completer) -> None:
    if writer.header.has_provenance:
        writer.append(points, generation=completer.generation, age=completer.age)
    else:
        writer.append(points)
