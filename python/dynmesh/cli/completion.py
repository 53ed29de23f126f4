"""The command that completes a sequence."""

import typer

from .._errors import SettingError
from ..jobs.completion_options import CompletionOptions
from ..jobs.file_completion import complete_into
from ..jobs.option import grouped
from ..jobs.zeros import ZeroCount
from .done import say_how_far, say_what_was_done, saying_what_is_kept, watching
from .options import InputPath, OutputPath, Overwrite, Resume, usage_error, with_options
from .terminal import DOUBTFUL, say, say_remarks, steps_bar, watch_training


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

    Each frame is completed from itself and from those between it and the frame from which
    completion starts. No frame need be whole: what that frame lacks is put together from the
    others. The exit code is 3 if it is probably wrong. Examples:

    ```text
    dynmesh complete partial.npz completed.npz
    dynmesh complete 'scans/*.ply' completed.h5 --start best --provenance
    dynmesh complete scans 'completed/frame_%04d.obj' --template body.obj --missing zero
    dynmesh complete shot.usd completed.usd --prim /World/Body
    dynmesh complete partial.npz completed.npz --training range_of_motion.npz
    ```
    """
    zeros, watch = ZeroCount(), watching(output, "completing")
    try:
        with saying_what_is_kept(output, "completed"), steps_bar() as watch_start:
            report = complete_into(
                path,
                output,
                options,
                overwrite,
                resume,
                watch=lambda frames, n, done: watch(zeros.watch(frames, done), n, done),
                watch_training=watch_training,
                watch_start=watch_start,
            )
    except SettingError as error:
        raise usage_error(error, options.settings) from error
    if say_how_far(output, "completed", report):
        say_what_was_done(output, report, options.settings["reject_outliers"])
    say_remarks(output, report.remarks)
    for hint in zeros.hint():
        say(hint)
    if report.doubtful:
        raise typer.Exit(DOUBTFUL)
