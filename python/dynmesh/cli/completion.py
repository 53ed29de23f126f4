"""The command that completes a sequence."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from .._errors import SettingError
from ..files.scenes import every_mesh
from ..jobs.file_completion import FileReport, complete_file, is_unfinished
from ..settings import Settings
from .options import (
    Faces,
    Format,
    FramesPerSecond,
    InputPath,
    MaskFile,
    MissingValue,
    OutputFormat,
    OutputPath,
    Overlay,
    Overwrite,
    PrimOrAll,
    source_of,
    usage_error,
    with_settings,
)
from .scene_completion import complete_all
from .terminal import say, say_remarks, track
from .zeros import Zeros


@with_settings
def complete(
    path: InputPath,
    output: OutputPath,
    settings: Settings,
    provenance: Annotated[
        bool,
        typer.Option(
            "--provenance",
            help="Also write the generation of each vertex (0 if it was observed) and its age "
            "(frames since it was last observed).",
        ),
    ] = False,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Continue an interrupted run of this job. If the output is already complete, do "
            "nothing and exit with code 0.",
        ),
    ] = False,
    format: Format = None,
    output_format: OutputFormat = None,
    faces: Faces = None,
    prim: PrimOrAll = None,
    overlay: Overlay = False,
    mask: MaskFile = None,
    missing: MissingValue = None,
    fps: FramesPerSecond = None,
    overwrite: Overwrite = False,
) -> None:
    """Fill in the missing vertices of every frame, using only that frame and earlier ones."""
    if prim == every_mesh:
        complete_all(
            path,
            output,
            settings,
            source_of(format, faces, prim, mask, missing),
            output_format=output_format,
            overlay=overlay,
            provenance=provenance,
            overwrite=overwrite,
            for_one_mesh={"--resume": resume, "--fps": fps},
        )
        return
    was_unfinished = is_unfinished(output)
    zeros = Zeros()

    def watch(frames: Iterator[Any], whole: int, done: int) -> Iterator[Any]:
        if was_unfinished and not done:
            hint = "" if resume else "; --resume continues an interrupted run"
            say(f"{output}: starting again from frame 0{hint}")
        return track(zeros.watch(frames, done), whole, "completing", done)

    try:
        report = complete_file(
            path,
            output,
            source=source_of(format, faces, prim, mask, missing),
            output_format=output_format,
            fps=fps,
            provenance=provenance,
            overwrite=overwrite,
            resume=resume,
            overlay=overlay,
            watch=watch,
            **settings,
        )
    except SettingError as error:
        raise usage_error(error) from error
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
        say(f"{output}: continued at frame {report.resumed_at}")
    _say_what_was_done(output, report, settings["reject_outliers"])
    say_remarks(output, report.remarks)
    zeros.say_if_many()


def _say_what_was_done(output: Path, report: FileReport, reject_outliers: bool) -> None:
    seconds = report.seconds_per_frame
    if seconds is None:
        say(f"{output}: there is only frame 0, so there was nothing to complete")
        return
    done = report.frames - max(1, report.resumed_at)
    say(
        f"{output}: {done} frames completed in {1e3 * seconds:.3g} ms each (median), "
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
    say(f"{output}: {shares} of the vertices after frame 0")
