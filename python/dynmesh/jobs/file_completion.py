"""Completion from file to file, in constant memory."""

from dataclasses import replace
from pathlib import Path
from typing import Unpack

from .. import files
from .._checks import check_callable, check_path
from ..files import PathLike
from ..frames.header import MeshFile
from .completion_options import CompletionKeywords, CompletionOptions, completion_options
from .directions import Watch, complete_frames
from .option import paths_of, takes
from .report import FileReport
from .start import WatchStart, open_with_template, start_in
from .training import Training, WatchTraining


@takes(CompletionOptions)
def complete_file(
    path: PathLike,
    output: PathLike,
    *,
    overwrite: bool = False,
    watch: Watch | None = None,
    watch_training: WatchTraining | None = None,
    **options: Unpack[CompletionKeywords],
) -> FileReport:
    """Completes a sequence and writes the result to a file, in constant memory.

    :func:`convert_file` chooses frames, turns, scales and resamples, before or afterwards.

    Completion starts from one whole frame, in which no vertex is missing. The frames after it are
    completed in their order; those before it, if any, are completed first, from the last to the
    first, and wait on disk. The output has all frames in order. With `bidirectional`, all frames
    wait on disk.

    The output appears under its name when it is complete. Until then it is in a hidden folder
    beside it. After an interruption, a full disk or a killed process, run it again; that removes
    the folder.

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
        overlay: whether to write a USD layer that holds the completed points, with the input, a USD
            stage, as its sublayer, by a relative path: transforms, materials and all else are those
            of the input, and normals, velocities and extents, which no longer fit, are blocked.
            Without it, USD holds the mesh alone. None means yes if both files are USD.
        watch: called with the frames in the order in which they are completed and their number; it
            must pass the frames on.
        watch_training: called with the training frames and their number; it must pass the frames
            on.
        **options: those above, and `method`, `noise` and the other settings of
            :class:`dynmesh.Completer`, which explains them. The method is detail unless another one
            is given.

    Raises:
        FileExistsError: the output exists.
        BlockingIOError: another process is writing it.
        ValueError: there is no frame `start`, or it is not whole; the template or a training frame
            is not whole or has another mesh.
        OSError, ImportError, TypeError, ValueError: the errors of :func:`dynmesh.open`,
            :func:`dynmesh.create` and :func:`dynmesh.complete`, with the name of the file unless a
            setting is refused.
    """
    wanted = completion_options(options)
    return complete_into(
        path, output, wanted, overwrite, watch=watch, watch_training=watch_training
    )


def complete_into(
    path: PathLike,
    output: PathLike,
    options: CompletionOptions,
    overwrite: bool,
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
    target = options.target(path, output)
    source = Path(path)
    with open_with_template(source, options) as (reader, template):
        header = options.header(reader.header)
        if target.is_overlay:  # which keeps all that its input holds
            header = replace(header, mesh_file=MeshFile(source, ()))
        training = Training(paths_of(options.training), reader, watch_training)
        others = [*(template.files if template else ()), *training.files]
        target.check(overwrite=overwrite, reader=reader, others=others)
        with (
            target.create(header, overwrite=overwrite) as writer,
            files.naming(source),
        ):
            start = template or start_in(reader, options, watch_start)
            tally = complete_frames(
                reader,
                start,
                options,
                training.completer(start.points, options.settings),
                writer,
                folder=writer.folder,
                watch=watch,
            )
        remarks = (
            *writer.remarks,
            *start.remarks(reader.header, options.settings["noise"]),
            *tally.remarks(reader.header.metres_per_unit),
        )
        return tally.report(
            reader.n_frames, remarks, start.number_in(reader.header), start.doubtful
        )
