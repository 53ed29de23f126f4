"""Completion from file to file: out of core, and able to go on after an interruption."""

import contextlib
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from .. import files
from .._checks import check_path
from .._core import Completer, FrameReport
from ..files import Frame, Header, PathLike, Reader, Writer
from ..sequence import Positions
from ..streaming import Settings, begin, complete_pairs, push_all
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
    method: Literal["motion", "detail"] = "motion",
    revisit: bool = True,
    extra_iterations: int = 0,
    unseen: Literal["follow", "hold"] = "follow",
    noise: float | None = None,
    reject_outliers: bool = False,
    threads: int = 1,
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
        method: "motion" or "detail". This and what follows are the settings of
            :class:`dynmesh.Completer`, which explains them.
        revisit: of "motion", whether every iteration estimates all satellites again.
        extra_iterations: of "motion", how many follow the one that reaches the last satellite.
        unseen: "follow" or "hold", what vertices do that no chain of edges ties to a known one.
        noise: of "detail", the standard deviation of known positions; None: they are exact.
        reject_outliers: of "detail", whether known vertices that move unlike those around them are
            taken as missing.
        threads: how many a frame may use.

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
        raise TypeError(f"watch: must be callable, not {watch!r}")
    settings: Settings = {
        "method": method,
        "revisit": revisit,
        "extra_iterations": extra_iterations,
        "unseen": unseen,
        "noise": noise,
        "reject_outliers": reject_outliers,
        "threads": threads,
    }
    path, output = Path(path), Path(output)
    source = source or {}
    if resume:
        _check_resumable(output, output_format)
    with files.open(path, **source) as reader:
        header = replace(
            reader.header,
            fps=reader.fps if fps is None else fps,
            has_known=False,
            has_provenance=provenance,
        )
        folder = unfinished_folder(output)
        job = describe_job(reader, header, source, output_format, settings)
        checkpoint = Checkpoint(folder / "checkpoint.npz", job)
        settled = _settle(folder, output, checkpoint)
        complete = resume and not overwrite and not checkpoint.exists()
        complete = complete and _is_complete(output, output_format, header)
        check_output(output, output_format, overwrite=overwrite or complete, reader=reader)
        if complete:
            n = header.n_frames
            return FileReport(n, n, None, 0, 0, 0, 0, existed=not settled)
        with _folder_for(output, output_format), lock_folder(folder, output):
            saved = checkpoint.load() if resume else None
            with _clearing(folder):
                files_folder = folder / "files"
                writer, saved = _begin_writer(output, header, output_format, files_folder, saved)
                start = 0 if saved is None else saved.frames
                reports: list[FrameReport] = []
                with (
                    writer,
                    files.naming(path),
                    contextlib.closing(reader.frames(start)) as frames,
                ):
                    watched = frames if watch is None else watch(frames, reader.n_frames, start)
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


def _is_complete(output: Path, format: str | None, header: Header) -> bool:
    """Whether the output exists, and can be what the job makes."""
    if not files.existing(output, format):
        return False
    with contextlib.suppress(OSError, ValueError), files.open(output, format=format) as made:
        return (made.n_frames, made.n_vertices) == (header.n_frames, header.n_vertices)
    return False


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
    if existing and reader is not None:
        inputs = set(map(_identity, reader.files))
        for file in existing:
            if _identity(file) in inputs:
                raise ValueError(f"{file}: is the input; writing over it would lose it")
    if existing and not overwrite:
        raise FileExistsError(
            f"{existing[0]}: exists already; --overwrite replaces it, in Python overwrite=True"
        )


def _identity(file: Path) -> tuple[int, int]:
    """What two paths have in common if they name the same file."""
    found = file.stat()
    return found.st_dev, found.st_ino


def _check_resumable(output: Path, format: str | None) -> None:
    if not files.resumable(output, format):
        able = [f.name for f in files.formats.values() if f.writer and f.writer.resumable]
        raise ValueError(
            f"{output}: files of this format cannot be resumed; {files.listed(able)} can"
        )


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
    output: Path, header: Header, format: str | None, folder: Path, saved: Saved | None
) -> tuple[Writer, Saved | None]:
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
                raise ValueError(
                    f"frame 0: {len(missing)} of {len(points)} vertices "
                    f"{'is' if len(missing) == 1 else 'are'} missing, vertex {missing[0]} first; "
                    "all motion begins there: begin at a whole frame, which `dynmesh info` names, "
                    "or fill frame 0 from a template"
                )
        yield frame


def _append(writer: Writer, points: Positions, completer: Completer) -> None:
    if writer.header.has_provenance:
        writer.append(points, generation=completer.generation, age=completer.age)
    else:
        writer.append(points)
