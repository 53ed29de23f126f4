"""The command that completes a sequence."""

import typer

from .._errors import SettingError
from ..jobs.completion_options import CompletionOptions
from ..jobs.file_completion import complete_into
from ..jobs.option import grouped
from .done import say_what_was_done
from .options import InputPath, OutputPath, Overwrite, usage_error, with_options
from .terminal import DOUBTFUL, say_remarks, steps_bar, track, watch_training


@with_options(CompletionOptions, lambda **values: CompletionOptions(**grouped(values)))
def complete(
    path: InputPath,
    output: OutputPath,
    *,
    options: CompletionOptions,
    overwrite: Overwrite = False,
) -> None:
    """Fill in the missing vertices of every frame.

    Each frame is completed from itself and from those between it and the frame from which
    completion starts. No frame need be whole: what that frame lacks is put together from the
    others. The exit code is 3 if it is probably wrong. dynmesh convert chooses frames and changes
    axes, units and rates, before or afterwards. Examples:

    ```text
    dynmesh complete partial.npz completed.npz
    dynmesh complete 'scans/*.ply' completed.h5 --start best --provenance
    dynmesh complete scans 'completed/frame_%04d.obj' --template body.obj --missing zero
    dynmesh complete shot.usd completed.usd --prim /World/Body
    dynmesh complete partial.npz completed.npz --training range_of_motion.npz
    ```
    """
    try:
        with steps_bar() as watch_start:
            report = complete_into(
                path,
                output,
                options,
                overwrite,
                watch=lambda frames, n: track(frames, n, "completing"),
                watch_training=watch_training,
                watch_start=watch_start,
            )
    except SettingError as error:
        raise usage_error(error, options.settings) from error
    say_what_was_done(output, report, options.settings["reject_outliers"])
    say_remarks(output, report.remarks)
    if report.doubtful:
        raise typer.Exit(DOUBTFUL)
