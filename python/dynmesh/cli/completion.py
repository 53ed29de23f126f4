"""The command that completes a sequence."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import files
from .._errors import SettingError
from ..files import Frame
from ..files.scenes import every_mesh
from ..jobs.checkpoint import Source
from ..jobs.file_completion import complete_file
from ..jobs.job_table import start_of
from ..jobs.start import Start, find_whole_frame
from ..jobs.unfinished import is_unfinished
from ..settings import Settings
from .done import say_how_far, say_what_was_done, saying_what_is_kept
from .options import (
    OUTPUT,
    WHAT,
    DropAbove,
    FramesPerSecond,
    InputPath,
    OutputFormat,
    OutputPath,
    Overlay,
    Overwrite,
    PrimOrAll,
    Resume,
    Training,
    usage_error,
    with_settings,
    with_source,
)
from .scene_completion import complete_all
from .terminal import PATIENCE, say, say_remarks, track, watch_training
from .zeros import Zeros


@with_settings
@with_source(prim=PrimOrAll)
def complete(
    path: InputPath,
    output: OutputPath,
    *,
    settings: Settings,
    source: Source,
    start: Annotated[
        str,
        typer.Option(
            metavar="N|whole",
            help="The frame without missing vertices from which completion starts, counted from 0, "
            "or whole for the first one. Frames before it are completed backwards.",
            rich_help_panel=WHAT,
        ),
    ] = "0",
    template: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A file with the whole mesh, which stands before frame 0.",
            rich_help_panel=WHAT,
        ),
    ] = None,
    training: Training = None,
    provenance: Annotated[
        bool,
        typer.Option(
            "--provenance",
            help="Also write how far each vertex is from an observed one (generation) and the "
            "frames since it was last observed (age); with --uncertainty, its standard error.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    drop_above: DropAbove = None,
    resume: Resume = False,
    output_format: OutputFormat = None,
    overlay: Overlay = False,
    fps: FramesPerSecond = None,
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
    if source.get("prim") == every_mesh:
        complete_all(
            path,
            output,
            settings,
            source,
            start=_parsed(start),
            training=training or None,
            output_format=output_format,
            overlay=overlay,
            provenance=provenance,
            drop_above=drop_above,
            overwrite=overwrite,
            for_one_mesh={
                "--resume": resume,
                "--fps": fps,
                "--template": template,
                "--gaps": source.get("gaps") == "lost",
            },
        )
        return
    begin_at = _start_of(start, path, source)
    was_unfinished = is_unfinished(output)
    zeros = Zeros()

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
                start=begin_at,
                template=template,
                training=training or None,
                source=source,
                output_format=output_format,
                fps=fps,
                provenance=provenance,
                drop_above=drop_above,
                overwrite=overwrite,
                resume=resume,
                overlay=overlay,
                watch=watch,
                watch_training=watch_training,
                **settings,
            )
    except SettingError as error:
        raise usage_error(error, settings) from error
    if not say_how_far(output, "completed", report):
        return
    say_what_was_done(output, report, settings["reject_outliers"])
    say_remarks(output, report.remarks)
    zeros.say_if_many()


def _parsed(start: str) -> Start:
    try:
        return start_of(start)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="'--start'") from error


def _start_of(text: str, path: Path, source: Source) -> Start:
    """Returns the frame from which completion starts, and says which is the first whole one."""
    start = _parsed(text)
    if start != "whole":
        return start

    def watch(frames: Iterable[Frame], total: int) -> Iterable[Frame]:
        return track(frames, total, "looking for a whole frame", patience=PATIENCE)

    with files.open(path, **source) as reader:
        found = find_whole_frame(reader, watch)
    say(f"{path}: frame {found} is the first whole one")
    return found
