"""Completion from file to file, in constant memory, with support for interruptions."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, Unpack

from .. import files
from .._checks import check_callable, check_path, check_positive
from .._errors import InputError, SettingError
from ..files import Header, PathLike, Reader, Target, Writer
from ..settings import Settings, all_settings, takes_settings
from .checkpoint import Progress, Source, describe_job
from .directions import Directions
from .report import FileReport, Tally
from .resumable import ResumableOutput, check_resumable
from .start import Start, StartFrame, check_start, open_at_start
from .training import Training, TrainingFiles, WatchTraining, check_training

Watch = Callable[[Iterator[Any], int, int], Iterator[Any]]


@takes_settings
def complete_file(
    path: PathLike,
    output: PathLike,
    *,
    start: Start = 0,
    template: PathLike | None = None,
    training: TrainingFiles | None = None,
    source: Source | None = None,
    output_format: str | None = None,
    fps: float | None = None,
    provenance: bool = False,
    drop_above: float | None = None,
    overwrite: bool = False,
    resume: bool = False,
    overlay: bool = False,
    watch: Watch | None = None,
    watch_training: WatchTraining | None = None,
    **settings: Unpack[Settings],
) -> FileReport:
    """Completes a sequence and writes the result to a file, in constant memory.

    Completion starts from one whole frame, in which no vertex is missing. The frames after it are
    completed in their order; those before it, if any, are completed first, from the last to the
    first, and wait on disk. The output has all frames in order.

    The output appears under its name when it is complete. Until then it is in a hidden folder
    beside it, where the completer's state is saved every few seconds if the format can be resumed.
    The folder remains after an interruption, a full disk or a killed process, and `resume`
    continues from it; a run without `resume` deletes it. What is in it has checksums: `resume`
    refuses what is damaged and leaves it as it is, and a run without `resume` moves it to
    `.NAME.set-aside`, which the remarks of the report say. If a process was killed while it moved
    several finished files to their destinations, the next run first moves the remaining ones.

    Args:
        path: the incomplete sequence, in any format.
        output: path of the completed sequence.
        start: the number of a whole frame, counted from 0, or "whole" for the first one.
        template: a mesh file of any format, whose first frame stands before frame 0, which may then
            be incomplete. It has the vertices and faces of the sequence, or provides its faces.
        training: one or several files, of any format, with complete frames of the same mesh, for
            example a range-of-motion recording, from which method detail learns; see
            :class:`dynmesh.Completer`. Of several meshes in a file, it is the one at the path of
            the sequence's mesh.
        source: how to read the input.
        output_format: one of :data:`dynmesh.files.formats`; None means the format of the suffix.
        fps: frames per second of the output; None means those of the input.
        provenance: whether to write the generation and the age of every vertex, and with
            `uncertainty` its standard error. Before the frame `start`, the age counts the frames
            until the vertex is next observed.
        drop_above: a distance in the unit of the positions. Vertices whose standard error exceeds
            it are left missing, NaN and in the known mask, instead of being filled in. Implies
            `uncertainty`.
        overwrite: whether to replace an existing output.
        resume: whether to continue an interrupted run of the same job; the result equals that of an
            uninterrupted run. Starts anew if there is nothing to continue. Does nothing if
            the output exists with as many frames and vertices as the input, no unfinished output is
            beside it and `overwrite` is not set. Nothing remembers the job of a complete output, so
            only its faces, its `fps` if both state it, and whether it has provenance, standard
            errors and dropped vertices are compared with this job, as far as its format has them.
            These formats can be resumed: npz, hdf5, npy, pc2, mdd, ply, obj and pvd.
        overlay: whether to write a USD layer that holds the completed points and what follows from
            them, with the input, a USD stage, as its sublayer.
        watch: called with the frames in the order in which they are completed, their number and the
            number of frames already completed; it must pass the frames on.
        watch_training: called with the training frames and their number; it must pass the frames
            on.
        **settings: `method`, `noise` and the other settings of :class:`dynmesh.Completer`, which
            explains them. The method is detail unless another one is given.

    Raises:
        FileExistsError: the output exists, and `resume` does not find it complete.
        BlockingIOError: another process is writing it.
        OtherJobError: `resume` finds files of another job, which are kept; it says what differs.
        CannotResumeError: `resume` finds files that are damaged or of another version, which are
            kept; the message names one.
        ValueError: `resume` is set, but the format cannot be resumed; there is no frame `start`, or
            it is not whole; the template or a training frame is not whole or has another mesh.
        OSError, ImportError, TypeError, ValueError: the errors of :func:`dynmesh.open`,
            :func:`dynmesh.create` and :func:`dynmesh.complete`, with the name of the file unless a
            setting is refused.
    """
    check_path("path", path)
    check_path("output", output)
    check_start(start, template)
    wanted = with_uncertainty(all_settings(settings), drop_above)
    training_files = check_training(training, wanted)
    check_callable("watch", watch)
    check_callable("watch_training", watch_training)
    target = files.target_of(output, output_format, overlay=overlay)
    if resume:
        check_resumable(target)
    options = CompletionOptions(
        start,
        template,
        training_files,
        fps,
        provenance,
        overwrite,
        resume,
        watch,
        watch_training,
        drop_above,
    )
    return complete_into(Path(path), target, source or {}, options, wanted)


class CompletionOptions(NamedTuple):
    """The arguments of :func:`complete_file` that are neither files nor settings."""

    start: Start = 0
    template: PathLike | None = None
    training_files: tuple[Path, ...] = ()
    fps: float | None = None
    provenance: bool = False
    overwrite: bool = False
    resume: bool = False
    watch: Watch | None = None
    watch_training: WatchTraining | None = None
    drop_above: float | None = None


def with_uncertainty(settings: Settings, drop_above: float | None) -> Settings:
    """The settings with which vertices can be dropped.

    Raises:
        TypeError, ValueError: `drop_above` is not a positive number, or the method is not detail.
    """
    if drop_above is None:
        return settings
    try:
        check_positive("drop_above", drop_above)
    except InputError as error:
        raise SettingError(error.reason, argument=error.argument) from None
    if settings["method"] != "detail":
        raise SettingError("requires method='detail'", argument="drop_above")
    return {**settings, "uncertainty": True}


def output_header(
    header: Header, settings: Settings, *, provenance: bool, drop_above: float | None
) -> Header:
    """The header of a completed sequence."""
    return replace(
        header,
        has_known=drop_above is not None,
        has_provenance=provenance,
        has_standard_error=provenance and settings["uncertainty"],
        standard_error_of="position",
    )


def complete_into(
    path: Path, target: Target, source: Source, options: CompletionOptions, settings: Settings
) -> FileReport:
    """As :func:`complete_file`, with the output's format chosen and all settings given."""
    with open_at_start(path, source, options.start, options.template) as (reader, start_frame):
        header = replace(
            output_header(
                reader.header,
                settings,
                provenance=options.provenance,
                drop_above=options.drop_above,
            ),
            fps=reader.fps if options.fps is None else options.fps,
        )
        training = Training(options.training_files, reader, options.watch_training)
        start = {**start_frame.described(), **training.described()}
        start["drop_above"] = options.drop_above
        job = describe_job(reader.files, header, source, start, target.format, settings)
        completion = _Completion(
            reader, start_frame, settings, training, options.watch, options.drop_above
        )
        outcome = ResumableOutput(
            target,
            header,
            job,
            path,
            overwrite=options.overwrite,
            resume=options.resume,
            reader=reader,
            others=[*start_frame.files, *training.files],
        ).write(completion.begin)
    remarks: tuple[str, ...] = ()
    if not outcome.was_complete:
        told = completion.tally.remarks(header.metres_per_unit)
        remarks = (*outcome.remarks, *start_frame.remarks(settings["noise"]), *told)
    n_frames, done = header.n_frames, outcome.resumed_at
    report = completion.tally.report(n_frames, done, remarks, start_frame.number)
    return replace(report, existed=outcome.existed)


class _Completion:
    """The passes over a sequence, as the work that writes an output."""

    def __init__(
        self,
        reader: Reader,
        start_frame: StartFrame,
        settings: Settings,
        training: Training,
        watch: Watch | None,
        drop_above: float | None,
    ) -> None:
        self._arguments = reader, start_frame, settings, training
        self._drop_above = drop_above
        self._watch = watch
        self._n_frames = reader.n_frames
        self.tally = Tally(settings["method"])

    def begin(self, progress: Progress) -> "_Completion":
        self._passes = Directions(*self._arguments, progress, self._drop_above)
        self._done = progress.done
        self.tally = self._passes.tally
        return self

    def steps(self, writer: Writer, folder: Path) -> Iterator[None]:
        with contextlib.closing(self._passes.frames()) as frames:
            watched: Iterator[Any] = frames
            if self._watch is not None:
                watched = self._watch(frames, self._n_frames, self._done)
            yield from self._passes.steps(watched, writer, folder / "before")

    def progress(self) -> Progress:
        return self._passes.progress()
