"""The command that completes a sequence."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from .. import files
from .._errors import SettingError
from ..files import Source
from ..frames.frame import Frame
from ..frames.scenes import every_mesh
from ..jobs.completion_options import CompletionOptions
from ..jobs.file_completion import complete_into
from ..jobs.option import Start, grouped
from ..jobs.start import find_whole_frame
from ..jobs.zeros import ZeroCount
from .done import say_how_far, say_what_was_done, saying_what_is_kept, watching
from .options import InputPath, OutputPath, Overwrite, Resume, usage_error, with_options
from .scene_completion import complete_all
from .terminal import PATIENCE, say, say_remarks, track, watch_training


@with_options(CompletionOptions, lambda **values: CompletionOptions(**grouped(values)))
def complete(
    path: InputPath,
    output: OutputPath,
    *,
    options: CompletionOptions,
    resume: Resume = False,
    overwrite: Overwrite = False,
) -> None:
    """Fill in the missing vertices of every frame.

    Each frame is completed from itself and from those between it and a whole frame, by default
    frame 0. Examples:

    ```text
    dynmesh complete partial.npz completed.npz
    dynmesh complete 'scans/*.ply' completed.h5 --start whole --provenance
    dynmesh complete scans 'completed/frame_%04d.obj' --template body.obj --missing zero
    dynmesh complete shot.usd completed.usd --prim all --overlay
    dynmesh complete partial.npz completed.npz --training range_of_motion.npz
    ```
    """
    if options.source.get("prim") == every_mesh:
        complete_all(path, output, options, resume=resume, overwrite=overwrite)
        return
    options = replace(options, start=_found(options.start, path, options.source))
    zeros, watch = ZeroCount(), watching(output, "completing", resume)
    try:
        with saying_what_is_kept(output, "completed"):
            report = complete_into(
                path,
                output,
                options,
                overwrite,
                resume,
                watch=lambda frames, n, done: watch(zeros.watch(frames, done), n, done),
                watch_training=watch_training,
            )
    except SettingError as error:
        raise usage_error(error, options.settings) from error
    if not say_how_far(output, "completed", report):
        return
    say_what_was_done(output, report, options.settings["reject_outliers"])
    say_remarks(output, report.remarks)
    for hint in zeros.hint():
        say(hint)


def _found(start: Start, path: Path, source: Source) -> Start:
    """Returns the frame from which completion starts, and says which is the first whole one."""
    if start != "whole":
        return start

    def watch(frames: Iterable[Frame], total: int) -> Iterable[Frame]:
        return track(frames, total, "looking for a whole frame", patience=PATIENCE)

    with files.open(path, **source) as reader:
        found = find_whole_frame(reader, watch)
    say(f"{path}: frame {found} is the first whole one")
    return found
