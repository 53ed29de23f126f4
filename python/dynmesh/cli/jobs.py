"""Completion, tracking and registration of many files, each by a command of its own."""

import csv
import json
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

from .._checks import check_integer, path_of
from .._errors import InputError
from .._options import Method, Output
from .._report import Quality, Report, aligned, counted, listed, tracked, write_csv
from ..formats import PathLike
from ..formats.names import FrameNames
from ..verbs.complete import complete
from ..verbs.register import registered
from ..verbs.track import track
from .command import SHARED, Command, bound

VERBS = {
    "input": ("complete", Command(complete)),
    "scans": ("track", Command(track)),
    "scan": ("register", Command(registered)),
}
"""By the column that says what a row is for."""

_OF_BATCH = {*SHARED, "overwrite"}


class Job(NamedTuple):
    """A row of a table: a command line, whose paths begin at the folder of the table.

    Attributes:
        line: of the table.
        input: the incomplete sequence, or the scans.
        output: what is written.
        words: of the command line, from the command on.
    """

    line: int
    input: Path
    output: Path
    words: tuple[str, ...]


def read_jobs(path: Path) -> list[Job]:
    """Reads the jobs of a table."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file, strict=True, skipinitialspace=True)
            rows = [(reader.line_num, [text.strip() for text in row]) for row in reader]
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(f"is not a table of comma-separated values: {error}", file=path) from error
    rows = [(line, row) for line, row in rows if any(row) and not row[0].startswith("#")]
    columns = rows[0][1] if rows else []
    for needed in ([*VERBS], ["output"]):
        if not {*needed} & {*columns}:
            words = listed(map(repr, needed), "or")
            raise InputError(f"has no column {words}; columns are separated by commas", file=path)
    for number, name in enumerate(columns):
        if name in _OF_BATCH:
            raise _wrong(path, 1, name, "is an option of the whole batch")
        if not name or name in columns[:number]:
            message = f"is the name of column {number + 1}; each needs its own"
            raise _wrong(path, 1, repr(name), message)
    jobs, lines = [_job(path, line, columns, row) for line, row in rows[1:]], dict[str, int]()
    if not jobs:
        raise InputError("has no jobs, only the names of the columns", file=path)
    for job in jobs:
        identity = os.path.realpath(job.output.with_name(FrameNames.of(job.output).pattern))
        if (first := lines.setdefault(identity, job.line)) != job.line:
            message = f"{str(job.output)!r} is the output of line {first} already"
            raise _wrong(path, job.line, "output", message)
    return jobs


def _wrong(path: Path, line: int, column: str | None, reason: str) -> InputError:
    place = f"line {line}" if column is None else f"line {line}: {column}"
    return InputError(reason, argument=place, file=path)


def _job(path: Path, line: int, columns: list[str], row: list[str]) -> Job:
    from cyclopts import UnknownOptionError

    if len(row) != len(columns):
        raise _wrong(path, line, None, "has more or fewer values than there are columns")
    given = {column: text for column, text in zip(columns, row, strict=True) if text}
    kinds = [kind for kind in VERBS if kind in given]
    if len(kinds) > 1:
        raise _wrong(path, line, kinds[1], f"cannot be combined with {kinds[0]}")
    kind = kinds[0] if kinds else "input"
    names = [*(["template"] if kind == "scan" else []), kind, "output"]
    for name in names:
        if name not in given:
            raise _wrong(path, line, name, "is empty")
    paths = [given.pop(name) for name in names]
    options = {f"--{column.replace('_', '-')}": column for column in given}
    words = [
        f"{option}={text.strip()}"
        for option, column in options.items()
        for text in given[column].split(";")
    ]
    try:
        _check_options(kind, len(paths), *words)
    except InputError as error:
        option = VERBS[kind][1].option_of(error.argument or "") or ""
        is_header = isinstance(error.__context__, UnknownOptionError)
        place = options.get(option, error.argument)
        raise _wrong(path, 1 if is_header else line, place, error.reason) from error
    source, output = (path_of("path", one, folder=path.parent) for one in paths[-2:])
    return Job(line, source, output, (VERBS[kind][0], *words, "--", *paths))


@cache
def _check_options(kind: str, n_paths: int, *words: str) -> None:
    """Refuses options behind so many paths; many rows have the same, and binding is slow."""
    bound(VERBS[kind][1], ["path"] * n_paths + [*words])


Status: TypeAlias = Literal["done", "doubtful", "exists", "failed"]

_WRONG: tuple[Status, ...] = ("failed", "doubtful")


@dataclass(frozen=True, kw_only=True)
class Row:
    """The row of a job in the table of results.

    Attributes:
        input: the incomplete sequence, or the scans.
        output: what was to be written.
        status: "done", "doubtful" if the output was written, now or earlier, but is probably wrong,
            "exists" if there was another one already, so that nothing was done, or "failed".
        quality: "good", "doubtful" or "ruined", of an output, as far as it is known; else "failed".
        frames: number of frames that were written.
        seconds: the time that the job took.
        reason: why it is doubtful or failed, in one line.
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
        """The output and why it is doubtful or failed; nothing of another one."""
        return [f"{self.output}: {self.reason}"] if self.status in _WRONG else []


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
        """Says what failed, what else to know of each output, and how good each is."""
        messages = []
        for result in self.results:
            messages += result.traceback.splitlines()
            messages += [f"{result.status}: {why}" for why in result.wrong]
            messages += [f"{result.output}: {remark}" for remark in result.remarks]
        counts = Counter(result.status for result in self.results)
        doubtful = f"{counts['doubtful']} doubtful, " if counts["doubtful"] else ""
        folder, rows = self.output.parent, [["output", "quality", "frames", "seconds"]]
        for one in self.results:
            name = one.output.relative_to(folder) if folder in one.output.parents else one.output
            made = [f"{one.frames}", f"{one.seconds:.1f}"] if one.frames else [one.status]
            rows.append([str(name), one.quality, *made])
        return [
            *messages,
            *aligned(rows),
            f"{counts['done']} done, {doubtful}{counts['exists']} already there, "
            f"{counts['failed']} failed of {len(self.results)} jobs",
        ]

    def write_csv(self, path: PathLike) -> None:
        """Writes the table of results, with a row for each job."""
        write_csv(path_of("path", path), Row, self.results)


def batch(
    jobs: PathLike,
    *,
    workers: Method[int | None] = None,
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

    Jobs run in any order, so what reads the output of another belongs in a second table. Spaces
    around values, empty lines and lines that begin with # do not count.

    Args:
        jobs: comma-separated values, with the names of the columns in the first line.
        workers: run so many jobs at a time; else, one per processor.
        overwrite: whether to replace existing outputs instead of skipping them.
        progress: whether to show on standard error how far it is.
    """
    table = path_of("jobs", jobs)
    if workers is not None:
        check_integer("workers", workers, 1)
    rows = read_jobs(table)
    there = [None if overwrite else _already(job) for job in rows]
    left = [job for job, result in zip(rows, there, strict=True) if result is None]
    with closing(_run(left, table.parent, workers or os.cpu_count() or 1, overwrite)) as running:
        made = iter([*tracked(running, len(left), "completing", progress)])
    results = tuple(next(made) if result is None else result for result in there)
    number = Counter(result.status for result in results)
    counts = [f"{number[status]} {status}" for status in _WRONG if number[status]]
    why = "; ".join(message for result in results for message in result.wrong)
    return BatchReport(
        quality="failed" if number["failed"] else "doubtful" if number["doubtful"] else "good",
        reason=f"{listed(counts)} of {counted(len(results), 'job')}: {why}" if why else "",
        output=table,
        results=results,
    )


def _run(
    jobs: list[Job], folder: Path, workers: int, overwrite: bool
) -> Generator[Result, None, None]:
    pool = ThreadPoolExecutor(workers)
    try:
        yield from pool.map(lambda job: _made(job, folder, overwrite), jobs)
    finally:  # an interrupt ends the commands, too
        pool.shutdown(cancel_futures=True)


def _already(job: Job) -> Result | None:
    """The result of a job whose output is there, without opening it."""
    names, output = FrameNames.of(job.output), job.output
    is_there = os.path.lexists(output) and not output.is_dir()
    if names.numbered:
        is_there = any(names.number(file.name) is not None for file in names.folder.glob("*"))
    if not is_there:
        return None
    result = Result(input=job.input, output=output, status="exists", quality="good")
    note = _note_of(output)
    is_newer = output.exists() and note.is_file()
    is_newer = is_newer and output.stat().st_mtime_ns > note.stat().st_mtime_ns
    if is_newer or not note.is_file():
        return replace(result, reason=f"{output}: exists already")
    reason = note.read_text(encoding="utf-8")
    return replace(result, status="doubtful", quality="doubtful", reason=reason)


def _made(job: Job, folder: Path, overwrite: bool) -> Result:
    """Runs a job by a command of its own; its errors are in the result."""
    result, began = Result(input=job.input, output=job.output, status="failed"), time.monotonic()
    verb, *words = job.words
    command = [sys.executable, "-m", "dynmesh", verb, "--json", "--quiet"]
    command += ["--overwrite"] * overwrite + words
    ended = subprocess.run(command, cwd=folder, capture_output=True, encoding="utf-8", check=False)
    result = replace(result, seconds=time.monotonic() - began)
    if ended.returncode not in (0, 3):
        *before, message = ended.stderr.strip().splitlines() or [f"ended by {-ended.returncode}"]
        message = message.removeprefix("dynmesh: ")
        message = message if str(job.input.name) in message else f"{job.input.name}: {message}"
        return replace(result, reason=message, traceback="\n".join(before))
    report, note = json.loads(ended.stdout), _note_of(job.output)
    if report["quality"] == "good":
        note.unlink(missing_ok=True)
    else:
        note.write_text(report["reason"], encoding="utf-8")
    return replace(
        result,
        status="done" if report["quality"] == "good" else "doubtful",
        quality=report["quality"],
        reason=report["reason"],
        remarks=tuple(report["remarks"]),
        frames=report.get("frames", 1),  # a registration has one
    )


def _note_of(output: Path) -> Path:
    """The file that keeps why an output is doubtful, for the next time that its job is met."""
    return output.with_name(f"{output.name}.doubtful.txt")
