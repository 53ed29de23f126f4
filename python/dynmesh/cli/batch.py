"""The command that completes an archive of sequences."""

import logging
import os
import signal
import threading
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from multiprocessing import active_children, get_context, parent_process
from pathlib import Path
from typing import Annotated

import typer

from .._extras import require
from ..jobs.batch import Result, complete_files
from ..jobs.job_table import optional_columns, read_jobs, report_file
from .terminal import counter, say, say_remarks


def batch(
    jobs: Annotated[
        Path,
        typer.Argument(
            metavar="JOBS.csv",
            help="A table with a line for each file. Columns are input, output and, where wanted, "
            f"{', '.join(optional_columns)}: the options of `dynmesh complete`. An empty value is "
            "the default. Paths are relative to the table.",
        ),
    ],
    workers: Annotated[
        int, typer.Option(metavar="N", help="Processes on this machine.", min=1)
    ] = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="A Dask scheduler whose workers do it instead."),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.csv",
            help="Also write a table of what became of each: input, output, status, reason, "
            "frames, seconds. An existing one is replaced.",
        ),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace outputs that exist, not skip them.")
    ] = False,
) -> None:
    """Complete many files; one that fails does not stop the others.

    Run again, it does what is left to do. The exit code is 1 if a job failed. A table is, for
    example:

        input,output,missing,provenance
        scans/monday,completed/monday.h5,zero,yes
        scans/tuesday,completed/tuesday.h5,,
    """
    if scheduler is not None:
        require("distributed", extra="batch")
    table = read_jobs(jobs)
    if report is not None and report.resolve() == jobs.resolve():
        raise ValueError(f"{report}: is the table of jobs; writing over it would lose it")
    with ExitStack() as stack:
        add = None if report is None else stack.enter_context(report_file(report))
        executor = stack.enter_context(_executor(workers, scheduler))
        count = stack.enter_context(counter(len(table), "completing"))

        def watch(result: Result) -> None:
            count()
            if add is not None:
                add(result)
            if result.status == "failed":
                say(f"failed: {result.reason}")
            say_remarks(Path(result.job.output), result.remarks)

        try:
            results = complete_files(table, executor, overwrite=overwrite, watch=watch)
        except KeyboardInterrupt:
            say("interrupted; run it again to go on")
            raise
    counts = Counter(result.status for result in results)
    say(
        f"{counts['done']} done, {counts['exists']} there already, {counts['failed']} failed "
        f"of {len(results)} jobs"
    )
    if counts["failed"]:
        raise typer.Exit(1)


_patience = "10s"  # with a scheduler that does not answer


def _begin_worker() -> None:
    """Ends a worker with the command: killed, it would leave it waiting for its next job."""

    def wait() -> None:
        parent = parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where it does not inherit that
    threading.Thread(target=wait, daemon=True).start()


@contextmanager
def _executor(workers: int, scheduler: str | None) -> Iterator[Executor | None]:
    if scheduler is not None:
        distributed = require("distributed", extra="batch")
        # A worker that dies is no matter: its jobs go to others.
        logging.getLogger("distributed").setLevel(logging.ERROR)
        try:
            client = distributed.Client(scheduler, timeout=_patience)
        except (OSError, ValueError) as error:
            raise OSError(f"--scheduler: there is none at {scheduler}") from error
        with client, client.get_executor() as executor:
            try:
                yield executor
            except KeyboardInterrupt:
                executor.shutdown(wait=False)  # forgets what has not begun
                raise
    elif workers > 1:
        spawn = get_context("spawn")
        with ProcessPoolExecutor(workers, spawn, initializer=_begin_worker) as executor:
            _start_deaf(executor)
            try:
                yield executor
            except KeyboardInterrupt:
                for worker in active_children():
                    worker.terminate()
                raise
    else:
        yield None


def _start_deaf(executor: Executor) -> None:
    """Starts workers that do not hear an interruption, which a terminal sends to them as well."""
    heard = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        executor.submit(os.getpid)  # the first one starts all
    finally:
        signal.signal(signal.SIGINT, heard)
