"""The command that completes a sequence."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import files
from .._errors import SettingError
from ..files import Frame
from ..jobs.beginning import Start, find_whole_frame
from ..jobs.checkpoint import Source
from ..jobs.file_completion import complete_file
from ..jobs.job_table import start_of
from ..jobs.report import LONG, FileReport
from ..jobs.unfinished import is_unfinished
from ..settings import SETTINGS, Settings
from .options import (
    OUTPUT,
    WHAT,
    FramesPerSecond,
    InputPath,
    OutputFormat,
    OutputPath,
    Overwrite,
    with_settings,
    with_source,
)
from .terminal import say, say_remarks, track
from .zeros import Zeros

_MANY = 0.01  # of the vertices
_PATIENCE = 2.0  # seconds before a progress bar appears


@with_settings
@with_source
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
    provenance: Annotated[
        bool,
        typer.Option(
            "--provenance",
            help="Also write how far each vertex is from an observed one (generation) and the "
            "frames since it was last observed (age).",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Continue an interrupted run. If OUT is already complete, do nothing.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    output_format: OutputFormat = None,
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
    ```
    """
    begin_at = _start_of(start, path, source)
    was_unfinished = is_unfinished(output)
    zeros = Zeros()

    def watch(frames: Iterator[Any], whole: int, done: int) -> Iterator[Any]:
        if was_unfinished and not done:
            hint = "" if resume else "; --resume continues an interrupted run"
            say(f"{output}: starting again{hint}")
        return track(zeros.watch(frames, done), whole, "completing", done)

    try:
        report = complete_file(
            path,
            output,
            start=begin_at,
            template=template,
            source=source,
            output_format=output_format,
            fps=fps,
            provenance=provenance,
            overwrite=overwrite,
            resume=resume,
            watch=watch,
            **settings,
        )
    except SettingError as error:
        name = str(error.argument)
        method = SETTINGS[name].method if name in SETTINGS else None
        other = method is not None and method != settings["method"]
        reason = f"requires --method {method}" if other else error.reason
        negation = "no-" if settings.get(name) is False else ""
        option = f"'--{negation}{name.replace('_', '-')}'"
        raise typer.BadParameter(reason, param_hint=option) from error
    except BlockingIOError:  # another process is writing the output
        raise
    except (OSError, KeyboardInterrupt) as error:
        if is_unfinished(output):
            say(f"{output}: completed frames are kept; --resume continues from there")
        elif isinstance(error, KeyboardInterrupt):
            say(f"{output}: interrupted; nothing was kept")
        raise
    if report.existed:
        say(f"{output}: already complete; --overwrite makes it anew")
        return
    if report.resumed_at == report.frames:
        say(f"{output}: the interrupted run had already completed every frame")
        return
    if report.resumed_at:
        say(f"{output}: continued after {report.resumed_at} frames")
    _say_what_was_done(output, report, settings["reject_outliers"])
    say_remarks(output, report.remarks)
    zeros.say_if_many()


def _say_what_was_done(output: Path, report: FileReport, reject_outliers: bool) -> None:
    seconds = report.seconds_per_frame
    if seconds is None:
        say(f"{output}: there is only frame 0, so there was nothing to complete")
        return
    say(
        f"{output}: {report.completed} frames completed in {1e3 * seconds:.3g} ms each (median), "
        f"{1 / seconds:.0f} frames per second without reading and writing"
    )
    whole = report.known + report.filled + report.unseen
    if reject_outliers:
        share = 100 * report.rejected / whole
        say(f"{output}: {report.rejected} outliers rejected, {share:.3g} % of the vertices")
    if report.filled + report.unseen == 0:
        say(f"{output}: nothing was missing")
        return
    counts = {"known": report.known, "filled in": report.filled, "unseen": report.unseen}
    shares = ", ".join(f"{what} {100 * n / whole:.3g} %" for what, n in counts.items())
    where = {-1: "", 0: " after frame 0"}.get(report.start, f" beside frame {report.start}")
    say(f"{output}: {shares} of the vertices{where}")
    if report.empty:
        say(f"{output}: nothing was observed in {report.empty} of the frames")
    long = report.hidden_long / (whole // report.completed)
    if long >= _MANY:
        say(
            f"{output}: {100 * long:.0f} % of the vertices were hidden for {LONG} frames or more; "
            "--method detail keeps their shape"
        )


def _start_of(text: str, path: Path, source: Source) -> Start:
    """Returns the frame from which completion starts, and says which is the first whole one."""
    try:
        start = start_of(text)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="'--start'") from error
    if start != "whole":
        return start

    def watch(frames: Iterable[Frame], total: int) -> Iterable[Frame]:
        return track(frames, total, "looking for a whole frame", patience=_PATIENCE)

    with files.open(path, **source) as reader:
        found = find_whole_frame(reader, watch)
    say(f"{path}: frame {found} is the first whole one")
    return found
