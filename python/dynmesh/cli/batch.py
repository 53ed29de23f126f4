"""The command that completes, tracks and registers many files."""

import logging
import os
import signal
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from itertools import count
from multiprocessing import active_children, get_context, parent_process
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from .._extras import require
from ..jobs.batch import Result, complete_files
from ..jobs.job_table import naming_columns, optional_columns, read_jobs, report_file
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
        int, typer.Option(metavar="N", help="Complete this many files at a time.", min=1)
    ] = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Use a Dask cluster with this scheduler instead."),
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
    if scheduler is not None:
        require("distributed", extra="batch")
    table = read_jobs(jobs)
    if report is not None and report.resolve() == jobs.resolve():
        raise ValueError(f"{report}: is the table of jobs, which the report would overwrite")
    with ExitStack() as stack:
        add = None if report is None else stack.enter_context(report_file(report))
        was_terminated = stack.enter_context(_heard_termination())
        executor = stack.enter_context(_executor(workers, scheduler))
        progress = stack.enter_context(work_bar("completing"))
        done = count(1)

        def watch(result: Result) -> None:
            progress("completing", next(done), len(table))
            result = naming_columns(result)
            if add is not None:
                add(result)
            if result.status == "failed":
                say(f"failed: {result.reason}")
            say_remarks(Path(result.job.output), result.remarks)

        try:
            results = complete_files(table, executor, overwrite=overwrite, watch=watch)
        except KeyboardInterrupt:
            how = "terminated" if was_terminated() else "interrupted"
            say(f"{how}; run the command again to continue")
            raise
    counts = Counter(result.status for result in results)
    doubtful = f"{counts['doubtful']} doubtful, " if counts["doubtful"] else ""
    say(
        f"{counts['done']} done, {doubtful}{counts['exists']} already complete, "
        f"{counts['failed']} failed of {len(results)} jobs"
    )
    if counts["failed"]:
        raise typer.Exit(1)
    if counts["doubtful"]:
        raise typer.Exit(DOUBTFUL)


_patience = "10s"  # how long to wait for a scheduler


def _begin_worker() -> None:
    """Lets a worker exit when the command is killed; it would otherwise wait for jobs forever."""

    def wait() -> None:
        parent = parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # not inherited on every platform
    threading.Thread(target=wait, daemon=True).start()


@contextmanager
def _heard_termination() -> Iterator[Callable[[], bool]]:
    """Treats SIGTERM as Ctrl+C in the block, so that workers end and nothing of them is left.

    Yields:
        A function that tells whether it came.

    Raises:
        typer.Exit: at the end of the block, with the exit code of SIGTERM, if it came.
    """
    came = False

    def interrupt(_: int, frame: FrameType | None) -> None:
        nonlocal came
        came = True
        heard = signal.getsignal(signal.SIGINT)
        if not callable(heard):  # ignored, as in the background of a script
            raise KeyboardInterrupt
        heard(signal.SIGINT, frame)

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield lambda: came
    except KeyboardInterrupt:
        if came:
            raise typer.Exit(128 + signal.SIGTERM) from None
        raise
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def _executor(workers: int, scheduler: str | None) -> Iterator[Executor | None]:
    if scheduler is not None:
        distributed = require("distributed", extra="batch")
        # Lost workers need no message: their jobs are moved to other workers.
        logging.getLogger("distributed").setLevel(logging.ERROR)
        try:
            client = distributed.Client(scheduler, timeout=_patience)
        except (OSError, ValueError) as error:
            raise OSError(f"--scheduler: no Dask scheduler answers at {scheduler}") from error
        with client, client.get_executor() as executor:
            try:
                yield executor
            except KeyboardInterrupt:
                executor.shutdown(wait=False)  # cancels the jobs that have not started
                raise
    elif workers > 1:
        spawn = get_context("spawn")
        with ProcessPoolExecutor(workers, spawn, initializer=_begin_worker) as executor:
            try:
                _start_deaf(executor)
                yield executor
            except KeyboardInterrupt:
                for worker in active_children():
                    worker.terminate()
                raise
    else:
        yield None


def _start_deaf(executor: Executor) -> None:
    """Starts workers that ignore SIGINT, which a terminal sends to all processes of a group."""
    heard = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        executor.submit(os.getpid)  # the first job starts all workers
    finally:
        signal.signal(signal.SIGINT, heard)
