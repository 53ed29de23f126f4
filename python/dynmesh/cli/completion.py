"""The command that completes a sequence."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from .. import files
from .._errors import SettingError
from ..files import Source
from ..frames.frame import Frame
from ..frames.scenes import every_mesh
from ..jobs.completion_options import CompletionOptions, keywords_of
from ..jobs.file_completion import complete_file
from ..jobs.option import Start, grouped
from ..jobs.start import find_whole_frame
from ..jobs.unfinished import is_unfinished
from ..jobs.zeros import ZeroCount
from .done import say_how_far, say_what_was_done, saying_what_is_kept
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
    was_unfinished = is_unfinished(output)
    zeros = ZeroCount()

    def watch(frames: Iterator[Any], whole: int, done: int) -> Iterator[Any]:
        if was_unfinished and not done:
            hint = "" if resume else "; --resume continues an interrupted run"
            say(f"{output}: starting again{hint}")
        return track(zeros.watch(frames, done), whole, "completing", done)

    try:
        with saying_what_is_kept(output, "completed"):
            report = complete_file(
                path,
                output,
                overwrite=overwrite,
                resume=resume,
                watch=watch,
                watch_training=watch_training,
                **keywords_of(options),
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
