"""The command that completes, tracks and registers many files."""

from collections import Counter
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Annotated

import typer

from .._extras import require
from ..jobs.batch import complete_files
from ..jobs.job_table import optional_columns, read_jobs, report_file
from .terminal import DOUBTFUL, say, say_remarks, work_bar


def batch(
    jobs: Annotated[
        Path,
        typer.Argument(
            metavar="JOBS.csv",
            help="A table with one line per file. Its columns are input, scans or scan, "
            f"output and, optionally, {', '.join(optional_columns)}: the options of `dynmesh "
            "complete`, or, on lines with scans, of `dynmesh track`, or, on lines with scan, of "
            "`dynmesh register`. An empty value stands for the default. Paths "
            "are relative to the table.",
        ),
    ],
    workers: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Run this many jobs at a time.",
            min=1,
            show_default="one per processor",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Use the Dask cluster with this scheduler instead."),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.csv",
            help="Also write a table of results: input, output, status, reason, frames, seconds. "
            "An existing file is replaced.",
        ),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace existing outputs instead of skipping them.")
    ] = False,
) -> None:
    """Complete, track or register many files; one that fails does not stop the others.

    Running the command again completes what is left. The exit code is 1 if a job failed, else 3
    if a result is doubtful. An example of a table:

    ```text
    input,output,missing,provenance
    scans/monday,completed/monday.h5,zero,yes
    scans/tuesday,completed/tuesday.h5,,
    ```
    """
    if workers is not None and scheduler is not None:
        raise typer.BadParameter("a cluster has its own workers", param_hint="'--workers'")
    require("distributed", extra="batch")  # before the report is replaced
    table = read_jobs(jobs)
    if report is not None and report.resolve() == jobs.resolve():
        raise ValueError(f"{report}: is the table of jobs, which the report would overwrite")
    counts: Counter[str] = Counter()
    with ExitStack() as stack:
        add = None if report is None else stack.enter_context(report_file(report))
        progress = stack.enter_context(work_bar("completing"))
        results = complete_files(table, scheduler, workers=workers, overwrite=overwrite)
        for done, result in enumerate(stack.enter_context(closing(results)), 1):
            progress("completing", done, len(table))
            counts[result.status] += 1
            if add is not None:
                add(result)
            if result.status == "failed":
                say(f"failed: {result.reason}")
            say_remarks(Path(result.job.output), result.remarks)
    doubtful = f"{counts['doubtful']} doubtful, " if counts["doubtful"] else ""
    say(
        f"{counts['done']} done, {doubtful}{counts['exists']} already complete, "
        f"{counts['failed']} failed of {len(table)} jobs"
    )
    if counts["failed"]:
        raise typer.Exit(1)
    if counts["doubtful"]:
        raise typer.Exit(DOUBTFUL)
