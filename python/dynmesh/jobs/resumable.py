"""Writing an output that an interrupted run can continue, whatever makes its frames."""

import contextlib
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from .. import files
from .._errors import InputError
from ..diagnosis.finding import counted
from ..files import CannotResumeError, Header, Reader, Target, Writer
from ..files.conversion import Conversion, Output
from ..files.lock import lock_folder, unfinished_folder
from .checkpoint import BEGINNING, Checkpoint, OtherJobError, Progress, changed
from .interrupts import holding_interrupts
from .unfinished import clearing, frames_kept, remember, remembered, set_aside, settle

_FILES = "files/"  # where a writer works, in the unfinished folder


class Work(Protocol):
    """What makes the frames of an output, from where an earlier run ended."""

    def steps(self, writer: Output, folder: Path) -> Iterator[None]:
        """Writes the frames that are left, in steps between which the work may end.

        Args:
            writer: holds the frames that were written before.
            folder: for files that a later run needs.
        """

    def progress(self) -> Progress:
        """Returns what a later run needs to continue."""


@dataclass(frozen=True)
class Outcome:
    """What became of an output.

    Attributes:
        resumed_at: number of frames that an interrupted run had made.
        was_complete: whether there was nothing to do, as the output was complete.
        existed: whether it was complete before this run, and not finished by it.
        remarks: of the writer.
        judged: if it was complete, what :class:`Progress` knew of its quality; nothing if that was
            good.
    """

    resumed_at: int
    was_complete: bool = False
    existed: bool = False
    remarks: tuple[str, ...] = ()
    judged: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class ResumableOutput:
    """An output, and the job that makes it.

    Attributes:
        target: where it is written, and in which format.
        conversion: what becomes of the frames that the job makes. One that resamples them makes the
            output one that cannot be continued.
        job: returns everything on which the output depends, as JSON. It may take long, and is not
            called if the output turns out to be complete or may not be replaced.
        source: the input, whose name errors have.
        overwrite: whether to replace an existing output.
        resume: whether to continue an interrupted run of the same job.
        reader: of a sequence whose scene the output keeps and whose files it must not replace.
        others: further files that it must not replace.
        copies: how many copies of the frames are on the disk at a time.
    """

    target: Target
    conversion: Conversion
    job: Callable[[], str]
    source: Path
    overwrite: bool = False
    resume: bool = False
    reader: Reader | None = None
    others: Iterable[Path] = field(default=())
    copies: int = 1

    def write(self, begin: Callable[[Progress], Work]) -> Outcome:
        """Writes the frames, unless the output is complete and `resume` is set.

        Ctrl+C ends the work after a whole step, so that every frame made until then is kept.

        Args:
            begin: returns what makes the frames that are left.

        Raises:
            FileExistsError, BlockingIOError, OtherJobError, CannotResumeError: as
                :func:`complete_file` raises them.
            OSError, TypeError, ValueError: the errors of the work and of the writer.
        """
        output, header = self.target.path, self.conversion.header
        folder = unfinished_folder(output)
        saved = folder / "checkpoint.npz"
        settled = False
        remarks: list[str] = []
        damage: CannotResumeError | None = None
        if os.path.lexists(folder):
            try:
                settled = settle(
                    folder, self.target, header.n_frames, Checkpoint(saved, self.job())
                )
            except CannotResumeError as error:
                if self.resume:
                    raise
                damage = error
        complete = self.resume and not self.overwrite and not saved.exists()
        complete = complete and self._is_complete()
        self.target.check(
            overwrite=self.overwrite or complete,
            reader=self.reader,
            others=self.others,
            header=None if complete else header,
            copies=self.copies,
        )
        if not (self.resume or self.overwrite or damage) and (kept := frames_kept(output)):
            raise FileExistsError(
                f"{output}: {counted(kept, 'frame')} of an interrupted run are kept: --resume "
                "continues it, --overwrite starts again (in Python, resume=True or overwrite=True)"
            )
        if complete:
            judged = remembered(self.target)
            return Outcome(header.n_frames, was_complete=True, existed=not settled, judged=judged)
        checkpoint = Checkpoint(saved, self.job())
        with contextlib.ExitStack() as locked:
            if damage is not None:
                remarks.append(set_aside(folder, output, f"{damage.file}: {damage.reason}"))
            remarks += locked.enter_context(lock_folder(folder, output))
            progress = (checkpoint.load() if self.resume else None) or BEGINNING
            with clearing(folder):
                with files.naming(self.source):
                    work = _begun(begin, progress, checkpoint)
                writer = self._begin_writer(folder / "files", progress)
                resumable = writer.resumable and self.conversion.places is None
                made = self.conversion.output(writer)
                with writer, files.naming(self.source), holding_interrupts() as interrupted:
                    for _ in work.steps(made, folder):
                        if interrupted():
                            break
                        if resumable and checkpoint.is_due():
                            _save(checkpoint, work, writer)
                    if resumable:
                        _save(checkpoint, work, writer)
                remember(self.target, work.progress().judged)
        remarks += self.conversion.remarks()
        return Outcome(progress.done, remarks=(*remarks, *writer.remarks))

    def _is_complete(self) -> bool:
        """Whether the output exists and has the size of the job's result.

        Raises:
            OtherJobError: it shows that another job has made it. Nothing beside it remembers the
                job, so this compares what it holds itself.
        """
        if not self.target.existing():
            return False
        wanted = self.conversion.header
        try:
            with files.open(self.target.path, format=self.target.format) as made:
                found = made.header
        except (OSError, ValueError):
            return False
        if (found.n_frames, found.n_vertices) != (wanted.n_frames, wanted.n_vertices):
            return False
        differences = list(_differences(found, wanted, self.target.writer))
        if differences:
            raise OtherJobError(
                f"{self.target.path}: is complete, but of another job: {'; '.join(differences)}; "
                "run with --overwrite to make it anew, or write another output"
            )
        return True

    def _begin_writer(self, folder: Path, progress: Progress) -> Writer:
        if progress.done:
            kept = {
                name.removeprefix(_FILES): of_file
                for name, of_file in progress.kept.items()
                if name.startswith(_FILES)
            }
            try:
                return self.target.create(
                    self.conversion.header,
                    folder=folder,
                    resume_at=progress.written,
                    kept=kept,
                    overwrite=self.overwrite,
                )
            except ValueError as error:
                raise CannotResumeError(str(error), file=folder) from error
        (folder.parent / "checkpoint.npz").unlink(missing_ok=True)
        return self.target.create(self.conversion.header, folder=folder, overwrite=self.overwrite)


def _begun(begin: Callable[[Progress], Work], progress: Progress, checkpoint: Checkpoint) -> Work:
    """Begins the work; what is wrong with the progress is wrong with the checkpoint."""
    try:
        return begin(progress)
    except CannotResumeError as error:
        error.file = checkpoint.path
        raise


def _save(checkpoint: Checkpoint, work: Work, writer: Writer) -> None:
    """Saves how far the work is, with checksums of everything that a later run will need."""
    writer.flush()
    progress = work.progress()
    written = {f"{_FILES}{name}": of_file for name, of_file in writer.pieces().items()}
    checkpoint.save(progress._replace(kept={**progress.kept, **written}))


def _differences(made: Header, wanted: Header, writer: type[Writer]) -> Iterator[str]:
    """Names what differs between an output and the result of a job, as far as the format has it."""
    if not np.array_equal(made.faces, wanted.faces):
        yield "faces changed"
    # Not every format has fps, and some have it rounded.
    if made.fps and wanted.fps and not math.isclose(made.fps, wanted.fps, rel_tol=1e-3):
        yield changed("fps", made.fps, wanted.fps)
    compared: list[tuple[str, object, object]] = []
    if writer.keeps_provenance:
        compared += [("provenance", made.has_provenance, wanted.has_provenance)]
    if made.has_provenance and wanted.has_provenance:
        compared += [("uncertainty", made.has_standard_error, wanted.has_standard_error)]
    if made.has_standard_error and wanted.has_standard_error:
        compared += [("standard errors", made.standard_error_of, wanted.standard_error_of)]
    if writer.keeps_known:
        given = {True: "given", False: None}
        compared += [("drop_above", given[made.has_known], given[wanted.has_known])]
    for name, before, now in compared:
        if before != now:
            yield changed(name, before, now)


def check_resumable(target: Target, retime: float | None) -> None:
    """Refuses to resume an output that cannot be continued."""
    if retime is not None:
        raise InputError("an output with resampled frames cannot be resumed", argument="retime")
    if not target.writer.resumable:
        able = [f.name for f in files.formats.values() if f.writer and f.writer.resumable]
        raise InputError(
            f"this format cannot be resumed; {files.listed(able)} can", file=target.path
        )
