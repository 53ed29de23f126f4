"""The commands that complete: one sequence, or an archive of them."""

from collections import Counter
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import typer

from .._extras import require
from .._terminal import counter, say, track
from ..batch import Result, complete_files, read_jobs
from ..file_completion import FileReport, check_output, complete_file, unfinished_folder
from ..streaming import Settings
from .options import (
    Faces,
    Format,
    FramesPerSecond,
    InputPath,
    MaskFile,
    MissingValue,
    OutputFormat,
    OutputPath,
    Overwrite,
    Prim,
    Unseen,
    source_of,
)


def complete(
    path: InputPath,
    output: OutputPath,
    revisit: Annotated[
        bool, typer.Option(help="Estimate a satellite again at every iteration, or only once.")
    ] = True,
    extra_iterations: Annotated[
        int, typer.Option(help="Iterations after the last satellite is reached.", min=0)
    ] = 0,
    unseen: Annotated[
        Unseen, typer.Option(help="What parts of the mesh without any known vertex do.")
    ] = Unseen.follow,
    provenance: Annotated[
        bool,
        typer.Option(
            "--provenance",
            help="Also write each vertex's generation (0: observed) and age (frames since then).",
        ),
    ] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on where an interrupted run of this job stopped.")
    ] = False,
    format: Format = None,
    output_format: OutputFormat = None,
    faces: Faces = None,
    prim: Prim = None,
    mask: MaskFile = None,
    missing: MissingValue = None,
    fps: FramesPerSecond = None,
    overwrite: Overwrite = False,
) -> None:
    """Fill in the missing vertices of every frame, from that frame and the past alone."""
    settings: Settings = {
        "revisit": revisit,
        "extra_iterations": extra_iterations,
        "unseen": unseen.value,
    }
    check_output(output, output_format, overwrite=overwrite)
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
            watch=lambda frames, whole, done: track(frames, whole, "completing", done),
            **settings,
        )
    except (OSError, KeyboardInterrupt):
        if unfinished_folder(output).exists():
            say(f"{output}: what is done so far is kept; --resume goes on from there")
        raise
    if report.resumed_at:
        say(f"{output}: went on at frame {report.resumed_at}")
    _say_how_fast(output, report)


def batch(
    jobs: Annotated[
        Path,
        typer.Argument(
            metavar="JOBS.csv",
            help="A table with a line for each file: columns input, output and, where wanted, "
            "the options of `dynmesh complete`, as extra_iterations. Paths are relative to it.",
        ),
    ],
    workers: Annotated[
        int, typer.Option(metavar="N", help="Processes on this machine.", min=1)
    ] = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="A Dask scheduler whose workers do it instead."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace outputs that exist, not skip them.")
    ] = False,
) -> None:
    """Complete many files; one that fails does not stop the others.

    Run again, it does what is left to do. The exit code is 1 if a job failed.
    """
    table = read_jobs(jobs)
    with counter(len(table), "completing") as count, _executor(workers, scheduler) as executor:

        def watch(result: Result) -> None:
            count()
            if result.status == "failed":
                say(f"failed: {result.reason}")

        results = complete_files(table, executor, overwrite=overwrite, watch=watch)
    counts = Counter(result.status for result in results)
    say(
        f"{counts['done']} done, {counts['exists']} there already, {counts['failed']} failed "
        f"of {len(results)} jobs"
    )
    if counts["failed"]:
        raise typer.Exit(1)


@contextmanager
def _executor(workers: int, scheduler: str | None) -> Iterator[Executor | None]:
    if scheduler is not None:
        distributed = require("distributed", extra="batch")
        try:
            client = distributed.Client(scheduler, timeout="10s")
        except (OSError, ValueError) as error:
            raise OSError(f"--scheduler: there is none at {scheduler}") from error
        with client, client.get_executor() as executor:
            yield executor
    elif workers > 1:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as executor:
            yield executor
    else:
        yield None


def _say_how_fast(output: Path, report: FileReport) -> None:
    seconds = report.seconds_per_frame
    if seconds is None:
        say(f"{output}: frame 0 alone; there was nothing to complete")
        return
    done = report.frames - max(1, report.resumed_at)
    say(
        f"{output}: {done} frames completed in {1e3 * seconds:.3g} ms each (median), "
        f"{1 / seconds:.0f} frames per second beside reading and writing"
    )
