"""Completion, tracking and registration of many files by Dask, on one machine or on many."""

import logging
import sys
import time
import traceback
from collections import Counter
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, TypeAlias

from .._checks import check_integer, path_of
from .._core import __version__
from .._errors import InputError, in_one_line, require
from .._options import Method, Output
from .._report import Quality, Report, aligned, counted, listed, tracked, write_csv
from ..formats import PathLike
from .failure import EXPECTED
from .job_table import VERBS, Job, exists, in_order, read_jobs

INTERVAL = 10.0
"""Seconds between two looks at the workers while a job is waited for."""


class Workers:
    """Those of a client of Dask, watched while jobs are waited for."""

    def __init__(self, client: Any, scheduler: str | None) -> None:
        """Checks the workers that a cluster has already.

        Args:
            client: of the scheduler.
            scheduler: its address; None for processes of this machine.
        """
        self.client, self._scheduler = client, scheduler
        self._known, self._none_told = frozenset[str](), False
        self._look()

    def result(self, future: Any) -> Any:
        """Waits for a result; says on standard error if no worker is there to compute it."""
        wait = require("distributed", extra="batch").wait
        while not future.done():
            try:
                wait(future, timeout=INTERVAL)
            except TimeoutError:
                self._look(is_waiting=True)
        return future.result()

    def _look(self, *, is_waiting: bool = False) -> None:
        present = frozenset(self.client.nthreads())
        if new := present - self._known:
            self._check(sorted(new))
        self._known = present
        if present or not is_waiting:
            self._none_told = self._none_told and not present
        elif not self._none_told:
            self._none_told = True
            where = self._scheduler or "on this machine"
            print(
                f"dynmesh: no worker is left {where}, so the jobs wait"
                if self._scheduler is None
                else f"dynmesh: the cluster at {where} has no worker, so the jobs wait: start "
                f"`dask worker {where}` with dynmesh {__version__} installed",
                file=sys.stderr,
                flush=True,
            )

    def _check(self, new: list[str]) -> None:
        """Refuses workers that cannot import dynmesh, or another version."""
        if self._scheduler is None:
            return
        # Text, which needs nothing there to be read; what a job needs is imported with it.
        version = "__import__('dynmesh.cli.job_table').__version__"
        found = self.client.run(eval, version, workers=new, on_error="return")
        for worker, answer in found.items():
            if answer != __version__:
                what = f"has dynmesh {answer}" if isinstance(answer, str) else "has no dynmesh"
                why = "" if isinstance(answer, str) else f" ({type(answer).__name__}: {answer})"
                others = counted(sum(a != __version__ for a in found.values()), "worker")
                raise OSError(
                    f"worker {worker} {what}{why}, but needs {__version__}, as here; "
                    f"{others} of {len(found)} must be started again with it"
                )


@contextmanager
def workers_of(scheduler: str | None, count: int) -> Iterator[Workers]:
    """The workers of a scheduler, or of a cluster on this machine, which ends with the block."""
    dask, distributed = (require(name, extra="batch") for name in ("dask", "distributed"))
    with ExitStack() as stack:
        address: Any = scheduler
        if scheduler is None:
            scratch = stack.enter_context(TemporaryDirectory())
            stack.enter_context(dask.config.set(temporary_directory=scratch))
            cluster = distributed.LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                memory_limit=0,  # or else Dask would kill a job that needs more than its share
                dashboard_address="127.0.0.1:0",  # any port: two clusters may run at once
                silence_logs=logging.ERROR,  # of workers that end in the middle of a job
            )
            address = stack.enter_context(cluster)
        try:
            client = distributed.Client(address)
        except (OSError, ValueError) as error:
            raise OSError(f"no Dask scheduler answers at {scheduler}") from error
        yield Workers(stack.enter_context(client), scheduler)


Status: TypeAlias = Literal["done", "doubtful", "exists", "failed", "not run"]

_WRONG: tuple[Status, ...] = ("failed", "not run", "doubtful")


@dataclass(frozen=True, kw_only=True)
class Row:
    """The row of a job in the table of results.

    Attributes:
        input: the incomplete sequence, or the scans.
        output: what was to be written.
        status: "done", "doubtful" if the output was written, now or earlier, but is probably wrong,
            "exists" if there was another one already, so that nothing was done, "failed", or "not
            run", as a job whose output is needed failed.
        quality: "good", "doubtful" or "ruined", of an output, as far as it is known; else "failed".
        frames: number of frames that were written.
        seconds: the time that the job took.
        reason: why it is doubtful, failed or was not run, in one line.
    """

    input: Path
    output: Path
    status: Status
    quality: Quality = "failed"
    frames: int = 0
    seconds: float = 0.0
    reason: str = ""


@dataclass(frozen=True, kw_only=True)
class Result(Row):
    """The result of a job.

    Attributes:
        remarks: remarks about the output for the user, one line each.
        traceback: where a fault of dynmesh itself arose; else empty.
    """

    remarks: tuple[str, ...] = ()
    traceback: str = ""

    @property
    def wrong(self) -> list[str]:
        """The output and why it is doubtful, failed or was not run; nothing of another one."""
        return [f"{self.output}: {self.reason}"] if self.status in _WRONG else []


@dataclass(frozen=True, kw_only=True)
class BatchReport(Report):
    """What :func:`batch` has done.

    Attributes:
        quality: "failed" if a job failed or was not run, else "doubtful" if a result is.
        output: the table of the jobs.
        results: of the jobs, in their order.
    """

    output: Path
    results: tuple[Result, ...]

    def lines(self) -> list[str]:
        """Says what failed, what else to know of each output, and how good each is."""
        messages = []
        for result in self.results:
            messages += result.traceback.splitlines()
            messages += [f"{result.status}: {why}" for why in result.wrong]
            messages += [f"{result.output}: {remark}" for remark in result.remarks]
        counts = Counter(result.status for result in self.results)
        doubtful = f"{counts['doubtful']} doubtful, " if counts["doubtful"] else ""
        not_run = f"{counts['not run']} not run, " if counts["not run"] else ""
        folder, rows = self.output.parent, [["output", "quality", "frames", "seconds"]]
        for one in self.results:
            name = one.output.relative_to(folder) if folder in one.output.parents else one.output
            quality = one.status if one.status == "not run" else one.quality
            made = [f"{one.frames}", f"{one.seconds:.1f}"] if one.frames else [one.status]
            rows.append([str(name), quality, *made])
        return [
            *messages,
            *aligned(rows),
            f"{counts['done']} done, {doubtful}{counts['exists']} already there, "
            f"{not_run}{counts['failed']} failed of {len(self.results)} jobs",
        ]

    def write_csv(self, path: PathLike) -> None:
        """Writes the table of results, with a row for each job."""
        write_csv(path_of("path", path), Row, self.results)


def batch(
    jobs: PathLike,
    *,
    workers: Method[int | None] = None,
    scheduler: Method[str | None] = None,
    overwrite: Output[bool] = False,
    progress: bool | None = None,
) -> BatchReport:
    """Completes, tracks or registers many files; one that fails does not stop the others.

    A row of the table is a command line, and its columns are options: `input` and `output` of a
    completion, `scans` and `output` of tracking, or `scan` and `output` of a registration, and any
    others of the same command. An empty value stands for the default, several paths are separated
    by semicolons, and all are relative to the table. Jobs whose output exists are skipped, so that
    running the command again does what is left. Why an output is doubtful is kept in a file beside
    it, `OUTPUT.doubtful.txt`, and told again until that is removed or the output is made anew.

    A job that reads the output of another runs after it, or not at all if that fails. Spaces around
    values, empty lines and lines that begin with # do not count.

    Args:
        jobs: comma-separated values, with the names of the columns in the first line.
        workers: run so many jobs at a time; else, one per processor.
        scheduler: use the Dask cluster with this address instead; it must see the files under the
            same paths.
        overwrite: whether to replace existing outputs instead of skipping them.
        progress: whether to show on standard error how far it is.
    """
    table = path_of("jobs", jobs)
    if workers is not None:
        check_integer("workers", workers, 1)
        if scheduler is not None:
            raise InputError("are those of the cluster", argument="workers", value=workers)
    if scheduler is not None:  # whose workers run in other folders
        table = table.absolute()
    rows = read_jobs(table, overwrite=overwrite)
    made = {i: there for i, job in enumerate(rows) if (there := _already(job)) is not None}
    left = [i for i in in_order(rows) if i not in made]
    if left:
        processors: int = require("dask.system", extra="batch").CPU_COUNT
        with (
            workers_of(scheduler, workers or min(processors, len(left))) as cluster,
            closing(_run(cluster, rows, left)) as running,
        ):
            made.update(tracked(running, len(left), "completing", progress))
    results = tuple(made[i] for i in range(len(rows)))
    number = Counter(result.status for result in results)
    counts = [f"{number[status]} {status}" for status in _WRONG if number[status]]
    why = "; ".join(message for result in results for message in result.wrong)
    is_failed = number["failed"] or number["not run"]
    return BatchReport(
        quality="failed" if is_failed else "doubtful" if number["doubtful"] else "good",
        reason=f"{listed(counts)} of {counted(len(results), 'job')}: {why}" if why else "",
        output=table,
        results=results,
    )


def _already(job: Job) -> Result | None:
    """The result of a job whose output is not to be made anew."""
    if job.options["overwrite"] or not exists(job.output):
        return None
    doubt = _doubt_of(job.output)
    if doubt:
        return _result(job, "doubtful", "doubtful", doubt)
    return _result(job, "exists", "good", f"{job.output}: exists already")


def _result(job: Job, status: Status, quality: Quality = "failed", reason: str = "") -> Result:
    return Result(input=job.input, output=job.output, status=status, quality=quality, reason=reason)


def _run(
    workers: Workers, jobs: Sequence[Job], left: Sequence[int]
) -> Generator[tuple[int, Result], None, None]:
    """Yields the results of the jobs with these indices, each after those that it needs.

    A job whose worker dies goes to another one.
    """
    futures = dict[int, Any]()
    for i in left:
        needed = [futures[need] for need in jobs[i].needs if need in futures]
        futures[i] = workers.client.submit(run_job, jobs[i], *needed, pure=False)
    lost = dict[int, Result]()
    for i in left:
        job = jobs[i]
        try:
            result = workers.result(futures[i])
        except Exception as error:  # an error of the worker, not of the job
            if isinstance(error, OSError) and not futures[i].done():
                raise
            why = f"{job.input}: the worker was lost: {in_one_line(error)}"
            failed = [lost[need] for need in job.needs if need in lost]
            result = _not_run(job, failed) or _result(job, "failed", reason=why)
            lost[i] = result
        yield i, result


def _not_run(job: Job, needed: Sequence[Result]) -> Result | None:
    """The result of a job that needs the outputs of others, of which one failed."""
    for other in needed:
        if other.status in ("failed", "not run"):
            why = f"needs {other.output}, which could not be made"
            return _result(job, "not run", reason=why)
    return None


def run_job(job: Job, *needed: Result) -> Result:
    """Runs a job in this process, after those that it needs; its errors are in the result."""
    if (not_run := _not_run(job, needed)) is not None:
        return not_run
    began = time.monotonic()
    result = _result(job, "failed")
    try:
        report = VERBS[job.kind](*job.arguments, **job.options)
        result = replace(
            result,
            status="done" if report.quality == "good" else "doubtful",
            quality=report.quality,
            reason=report.reason,
            remarks=report.remarks,
            frames=getattr(report, "frames", 1),  # a registration has one
        )
        note = _note_of(job.output)
        if report.quality == "good":
            note.unlink(missing_ok=True)
        else:
            note.write_text(report.reason, encoding="utf-8")
    except EXPECTED as error:  # no error may stop the other jobs
        message = in_one_line(error)
        if isinstance(error, FileExistsError) and (there := _already(job)) is not None:
            return there  # of another process
        reason = message if str(job.input) in message else f"{job.input}: {message}"
        result = replace(result, status="failed", reason=reason)
    except Exception as error:
        reason = f"{job.input}: a fault of dynmesh: {type(error).__name__}: {in_one_line(error)}"
        result = replace(result, reason=reason, traceback=traceback.format_exc())
    return replace(result, seconds=time.monotonic() - began)


def _note_of(output: Path) -> Path:
    """The file that keeps why an output is doubtful, for the next time that its job is met."""
    return output.with_name(f"{output.name}.doubtful.txt")


def _doubt_of(output: Path) -> str:
    """Why an existing output is doubtful; empty if it is not, or was made anew since."""
    note = _note_of(output)
    if not note.is_file():
        return ""
    if output.exists() and output.stat().st_mtime_ns > note.stat().st_mtime_ns:
        return ""
    return note.read_text(encoding="utf-8")
