"""Completion from file to file, in constant memory, with support for interruptions."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Unpack

from .. import files
from .._checks import check_callable, check_path
from ..files import PathLike
from ..frames.header import MeshFile
from .checkpoint import Progress, describe_job
from .completion_options import CompletionKeywords, CompletionOptions, completion_options
from .directions import Directions, Watch
from .option import paths_of, takes
from .report import FileReport, Tally
from .resumable import ResumableOutput, check_resumable
from .start import StartFrame, WatchStart, open_with_template, start_in
from .training import Training, WatchTraining


@takes(CompletionOptions)
def complete_file(
    path: PathLike,
    output: PathLike,
    *,
    overwrite: bool = False,
    resume: bool = False,
    watch: Watch | None = None,
    watch_training: WatchTraining | None = None,
    **options: Unpack[CompletionKeywords],
) -> FileReport:
    """Completes a sequence and writes the result to a file, in constant memory.

    Completion starts from one whole frame, in which no vertex is missing. The frames after it are
    completed in their order; those before it, if any, are completed first, from the last to the
    first, and wait on disk. The output has all frames in order. With `bidirectional`, all frames
    wait on disk, at most three times.

    The output appears under its name when it is complete. Until then it is in a hidden folder
    beside it, where the completer's state is saved every few seconds if the format can be resumed.
    The folder remains after an interruption, a full disk or a killed process. `resume` continues
    from it, `overwrite` starts again, and without either the run is refused. What is in it has
    checksums: `resume` refuses what is damaged and leaves it as it is, and a run without `resume`
    moves it to `.NAME.set-aside`, which the remarks of the report say. If a process was killed
    while it moved several finished files to their destinations, the next run first moves the
    remaining ones.

    Args:
        path: the incomplete sequence, in any format.
        output: path of the completed sequence.
        start: the frame from which completion starts; frames before it are completed backwards.
            "auto" is frame 0 if no vertex is missing there, else the first such frame, else as
            "best"; "whole" is the first frame without missing vertices, which must exist; "best" is
            the frame that knows most vertices; a number is that of the frame
            in its file, counted from 0 where the file has none. What the
            frame lacks is put together from all others by :func:`dynmesh.whole_frame`, and the
            remarks of the report say so. "clean" is as "auto", but known positions that contradict
            other frames are left out and estimated, and with `noise` the frame is smoothed.
        template: a mesh file of any format, whose first frame stands before frame 0, which may then
            be incomplete. It has the vertices and faces of the sequence, or provides its faces. The
            output keeps its polygons and what else it holds, as far as their format is the same.
        training: one or several files, of any format, with complete frames of the same mesh, for
            example a range-of-motion recording, from which method detail learns; see
            :class:`dynmesh.Completer`. Of several meshes in a file, it is the one at the path of
            the sequence's mesh.
        source: how to read the input.
        output_format: one of :data:`dynmesh.files.formats`; None means the format of the suffix.
        fps: frames per second of the output; None means those of the input.
        frames: the numbers of the frames to complete; for this and the next, see
            :func:`dynmesh.convert_file`. Lengths in other options are in the unit of the input.
        up, unit: what the input does not state of itself.
        to_up, to_unit, scale, retime: how completed frames are turned, scaled and resampled. A run
            with `retime` cannot be resumed.
        bidirectional: whether to complete each frame from both sides. Completion goes from the
            frame `start` to the nearer end of the sequence, from there to the other end, and back;
            a vertex is the mean of the last two estimates, weighed by their standard errors.
            Implies `uncertainty` and, without `training`, `learn`. The age of a vertex is then the
            number of frames to the nearest one in which it was observed.
        provenance: whether to write the generation and the age of every vertex, and with
            `uncertainty` its standard error. Before the frame `start`, the age counts the frames
            until the vertex is next observed. In that frame, the generation is -2 where it was put
            together from other frames.
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
            These formats can be resumed: npz, hdf5, npy, pc2, ply and obj.
        overlay: whether to write a USD layer that holds the completed points, with the input, a USD
            stage, as its sublayer, by a relative path: transforms, materials and all else are those
            of the input, and normals, velocities and extents, which no longer fit, are blocked.
            Without it, USD holds the mesh alone. None means yes if both files are USD.
        watch: called with the frames in the order in which they are completed, their number and the
            number of frames already completed; it must pass the frames on.
        watch_training: called with the training frames and their number; it must pass the frames
            on.
        **options: those above, and `method`, `noise` and the other settings of
            :class:`dynmesh.Completer`, which explains them. The method is detail unless another one
            is given.

    Raises:
        FileExistsError: the output exists, and `resume` does not find it complete; or frames of an
            interrupted run are kept, and neither `resume` nor `overwrite` is set.
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
    wanted = completion_options(options)
    return complete_into(
        path, output, wanted, overwrite, resume, watch=watch, watch_training=watch_training
    )


def complete_into(
    path: PathLike,
    output: PathLike,
    options: CompletionOptions,
    overwrite: bool,
    resume: bool,
    *,
    watch: Watch | None = None,
    watch_training: WatchTraining | None = None,
    watch_start: WatchStart | None = None,
) -> FileReport:
    """As :func:`complete_file`, with an object for the options.

    `watch_start` is called while the frame is sought or put together from which completion starts.
    """
    check_path("path", path)
    check_path("output", output)
    options = options.checked()
    check_callable("watch", watch)
    check_callable("watch_training", watch_training)
    overlay = options.is_overlay(Path(path), output)
    target = files.target_of(output, options.output_format, overlay=overlay)
    if resume:
        check_resumable(target, options.retime)
    source = Path(path)
    with open_with_template(source, options) as (reader, template):
        wanted = options.header(reader.header)
        if overlay:  # which keeps all that its input holds
            wanted = replace(wanted, mesh_file=MeshFile(source, ()))
        conversion = options.conversion(wanted, reader.path)
        header = conversion.header
        training = Training(paths_of(options.training), reader, watch_training)
        passes: list[Directions] = []

        @cache
        def start() -> StartFrame:
            return template or start_in(reader, options, watch_start)

        def job() -> str:
            said = start().described() | training.described() | options.described()
            return describe_job(reader.files, header, target.format, said)

        def begin(progress: Progress) -> Directions:
            passes.append(Directions(reader, start(), options, training, progress, watch))
            return passes[0]

        outcome = ResumableOutput(
            target,
            conversion,
            job,
            source,
            overwrite=overwrite,
            resume=resume,
            reader=reader,
            copies=3 if options.bidirectional else 1,
            others=[*(template.files if template else ()), *training.files],
        ).write(begin)
        start_frame = None if outcome.existed else start()
    # Nothing is begun if the output is complete.
    tally = passes[0].tally if passes else Tally(options.settings["method"])
    doubt = outcome.judged.get("doubtful", "")
    remarks: tuple[str, ...] = (doubt,) if doubt else ()
    if start_frame is not None and not outcome.was_complete:
        told = tally.remarks(reader.header.metres_per_unit)
        remarks = (
            *outcome.remarks,
            *start_frame.remarks(reader.header, options.settings["noise"]),
            *told,
        )
    report = tally.report(
        reader.n_frames,
        outcome.resumed_at,
        remarks,
        start_frame.number_in(reader.header) if start_frame else None,
        bool(doubt) or (start_frame is not None and start_frame.doubtful),
    )
    return replace(report, existed=outcome.existed)
