"""Completion, tracking and registration of many files by Dask, on one machine or on many."""

import csv
import logging
import os
import time
from collections import Counter
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, TypeAlias

from .._checks import check_integer, path_of
from .._errors import InputError, in_one_line
from .._extras import require
from .._options import Method, Output
from .._progress import tracked
from .._report import Report, counted
from ..formats import PathLike
from ..verbs.complete import complete
from ..verbs.register import registered
from ..verbs.track import track
from .command import Command, arguments_of, bound

Status: TypeAlias = Literal["done", "doubtful", "exists", "failed"]

_VERBS = {"input": Command(complete), "scans": Command(track), "scan": Command(registered)}
"""By the column that says what a row is for."""


@dataclass(frozen=True)
class Job:
    """A row of a table: a command line.

    Attributes:
        kind: the column that says what it is for: "input", "scans" or "scan".
        input: the incomplete sequence, or the scans.
        output: what is written.
        arguments: those of the function.
        options: its keywords.
    """

    kind: str
    input: Path
    output: Path
    arguments: tuple[Any, ...]
    options: Mapping[str, Any]


@dataclass(frozen=True)
class Result:
    """The result of a job.

    Attributes:
        input: the incomplete sequence, or the scans.
        output: what was to be written.
        status: "done", "doubtful" if the output was written, now or earlier, but is probably wrong,
            "exists" if there was another one already, so that nothing was done, or "failed".
        reason: why it is doubtful or failed, or which file exists, in one line.
        frames: number of frames that were written.
        seconds: the time that the job took.
        remarks: remarks about the output for the user, one line each.
    """

    input: Path
    output: Path
    status: Status
    reason: str = ""
    frames: int = 0
    seconds: float = 0.0
    remarks: tuple[str, ...] = ()

    @property
    def wrong(self) -> list[str]:
        """The output and why it is doubtful or failed; nothing of another one."""
        return [f"{self.output}: {self.reason}"] if self.status in ("failed", "doubtful") else []


@dataclass(frozen=True, kw_only=True)
class BatchReport(Report):
    """What :func:`batch` has done.

    Attributes:
        quality: "failed" if a job failed, else "doubtful" if a result is.
        output: the table of the jobs.
        results: of the jobs, in their order.
    """

    output: Path
    results: tuple[Result, ...]

    def lines(self) -> list[str]:
        """Says what failed, what else to know of each output, and how many jobs were done."""
        messages = []
        for result in self.results:
            messages += [f"{result.status}: {why}" for why in result.wrong]
            messages += [f"{result.output}: {remark}" for remark in result.remarks]
        counts = Counter(result.status for result in self.results)
        doubtful = f"{counts['doubtful']} doubtful, " if counts["doubtful"] else ""
        return [
            *messages,
            f"{counts['done']} done, {doubtful}{counts['exists']} already there, "
            f"{counts['failed']} failed of {len(self.results)} jobs",
        ]


def batch(
    jobs: PathLike,
    *,
    workers: Method[int | None] = None,
    scheduler: Method[str | None] = None,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> BatchReport:
    """Completes, tracks or registers many files; one that fails does not stop the others.

    A row of the table is a command line, and its columns are options: `input` and `output` of a
    completion, `scans` and `output` of tracking, or `scan` and `output` of a registration, and any
    others of the same command. An empty value stands for the default, several paths are separated
    by semicolons, and all are relative to the table. Jobs whose output exists are skipped, so that
    running the command again does what is left. Why an output is doubtful is kept in a file beside
    it, `OUTPUT.doubtful.txt`, and told again until that is removed or the output is made anew.

    Args:
        jobs: comma-separated values, with the names of the columns in the first line.
        workers: run so many jobs at a time; else, one per processor.
        scheduler: use the Dask cluster with this address instead; it must see the files under the
            same paths.
        overwrite: whether to replace existing outputs instead of skipping them.
        progress: whether to show on standard error how far it is.

    Raises:
        ImportError: Dask distributed is not installed.
        OSError: the table cannot be read, or no scheduler answers.
        ValueError: the table is invalid; the error names the line and the column.
    """
    table = path_of("jobs", jobs)
    if workers is not None:
        check_integer("workers", workers, 1)
        if scheduler is not None:
            raise InputError("are those of the cluster", argument="workers", value=workers)
    require("distributed", extra="batch")
    processors: int = require("dask.system", extra="batch").CPU_COUNT
    rows = read_jobs(table, overwrite=overwrite)
    with (
        _client(scheduler, workers or min(processors, len(rows))) as client,
        closing(_run(client, rows)) as made,
    ):
        results = tuple(tracked(made, len(rows), "completing", progress))
    number = Counter(result.status for result in results)
    counts = [f"{number[status]} {status}" for status in ("failed", "doubtful") if number[status]]
    why = "; ".join(message for result in results for message in result.wrong)
    return BatchReport(
        quality="failed" if number["failed"] else "doubtful" if number["doubtful"] else "good",
        reason=f"{' and '.join(counts)} of {counted(len(results), 'job')}: {why}" if why else "",
        output=table,
        results=results,
    )


def read_jobs(path: Path, *, overwrite: bool = False) -> list[Job]:
    """Reads the jobs of a table.

    Raises:
        OSError: it cannot be read.
        ValueError: it is invalid; the error names the line and the column.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            table = csv.DictReader(file, strict=True)
            for needed in ([*_VERBS], ["output"]):
                if not set(needed) & set(table.fieldnames or []):
                    listed = " or ".join(map(repr, needed))
                    message = f"has no column {listed}; columns are separated by commas"
                    raise InputError(message, file=path)
            jobs: list[Job] = []
            lines: dict[str, int] = {}
            for row in table:
                jobs.append(_job(path, table.line_num, row, overwrite))
                first = lines.setdefault(os.path.realpath(jobs[-1].output), table.line_num)
                if first != table.line_num:
                    message = f"{row['output']!r} is the output of line {first} already"
                    raise _wrong(path, table.line_num, "output", message)
            if not jobs:
                raise InputError("has no jobs, only the names of the columns", file=path)
            return jobs
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(f"is not a table of comma-separated values: {error}", file=path) from error


def _wrong(path: Path, line: int, column: str | None, reason: str) -> InputError:
    place = f"line {line}" if column is None else f"line {line}: {column}"
    return InputError(reason, argument=place, file=path)


def _job(path: Path, line: int, row: Mapping[str, Any], overwrite: bool) -> Job:
    from cyclopts import UnknownOptionError

    if None in row or None in row.values():
        raise _wrong(path, line, None, "has more or fewer values than there are columns")
    given = {column: text for column, text in row.items() if text}
    kinds = [kind for kind in _VERBS if kind in given]
    if len(kinds) > 1:
        raise _wrong(path, line, kinds[1], f"cannot be combined with {kinds[0]}")
    kind = kinds[0] if kinds else "input"
    verb = _VERBS[kind]
    names = [*(["template"] if kind == "scan" else []), kind, "output"]
    for name in names:
        if name not in given:
            raise _wrong(path, line, name, "is empty")
    if "overwrite" in given:
        raise _wrong(path, 1, "overwrite", "is an option of the whole batch")
    words = [given.pop(name) for name in names]
    columns = {f"--{column.replace('_', '-')}": column for column in given}
    for option, column in columns.items():
        words += [f"{option}={text.strip()}" for text in given[column].split(";")]
    try:
        arguments = bound(verb, words)
    except InputError as error:
        option = verb.option_of(error.argument or "") or ""
        is_header = isinstance(error.__context__, UnknownOptionError)
        place = columns.get(option, error.argument)
        raise _wrong(path, 1 if is_header else line, place, error.reason) from error
    arguments.arguments["overwrite"] = overwrite
    here = path.parent / row[kind], path.parent / row["output"]
    return Job(kind, *here, *arguments_of(arguments, path.parent))


def _run(client: Any, jobs: Sequence[Job]) -> Generator[Result, None, None]:
    """Yields the results in the order of the jobs; a job whose worker dies goes to another one."""
    futures = client.map(run_job, jobs, pure=False)
    for job, future in zip(jobs, futures, strict=True):
        try:
            yield future.result()
        except Exception as error:  # an error of the worker, not of the job
            why = f"{job.input}: the worker was lost: {in_one_line(error)}"
            yield Result(job.input, job.output, "failed", why)


def run_job(job: Job) -> Result:
    """Runs a job in this process; whatever goes wrong is in the result."""
    began = time.monotonic()

    def result(status: Status, reason: str, **more: Any) -> Result:
        seconds = time.monotonic() - began
        return Result(job.input, job.output, status, reason, seconds=seconds, **more)

    try:
        report = _VERBS[job.kind](*job.arguments, **job.options)
    except Exception as error:  # no error may stop the other jobs
        message = in_one_line(error)
        is_page = str(job.options.get("page")) in message
        if isinstance(error, FileExistsError) and not is_page:
            doubt = _doubt_of(job.output)
            return result("doubtful", doubt) if doubt else result("exists", message)
        return result("failed", message if str(job.input) in message else f"{job.input}: {message}")
    frames = getattr(report, "frames", 1)  # a registration has one
    status: Status = "done" if report.quality == "good" else "doubtful"
    note = _note_of(job.output)
    try:
        if status == "doubtful":
            note.write_text(report.reason, encoding="utf-8")
        else:
            note.unlink(missing_ok=True)
    except OSError as error:
        return result("failed", in_one_line(error))
    return result(status, report.reason, frames=frames, remarks=report.remarks)


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


@contextmanager
def _client(scheduler: str | None, workers: int) -> Iterator[Any]:
    """A client of a scheduler, or of a cluster on this machine, which ends with the block."""
    dask, distributed = (require(name, extra="batch") for name in ("dask", "distributed"))
    with ExitStack() as stack:
        address: Any = scheduler
        if scheduler is None:
            scratch = stack.enter_context(TemporaryDirectory())
            stack.enter_context(dask.config.set(temporary_directory=scratch))
            cluster = distributed.LocalCluster(
                n_workers=workers,
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
        yield stack.enter_context(client)
