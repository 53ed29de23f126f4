"""Completion, tracking and registration of many files, each by a command of its own."""

import json
import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import closing
from dataclasses import dataclass, field, replace
from graphlib import TopologicalSorter
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen
from typing import Literal, TypeAlias

from .._checks import check_integer, path_of
from .._options import Method, Output
from .._report import Quality, Report, aligned, counted, listed, tracked, write_csv
from ..formats import PathLike
from .job_table import Job, exists, read_jobs

Status: TypeAlias = Literal["done", "doubtful", "exists", "failed", "not run"]

_WRONG: tuple[Status, ...] = ("failed", "not run", "doubtful")


@dataclass(frozen=True, kw_only=True)
class Result:
    """The result of a job, and its row in the table of results.

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
        remarks: remarks about the output for the user, one line each.
        traceback: the lines that its command printed before the error.
    """

    input: Path
    output: Path
    status: Status
    quality: Quality = "failed"
    frames: int = 0
    seconds: float = 0.0
    reason: str = ""
    remarks: tuple[str, ...] = field(default=(), repr=False)
    traceback: tuple[str, ...] = field(default=(), repr=False)

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
        messages = list[str]()
        for result in self.results:
            messages += result.traceback
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
        write_csv(path_of("path", path), Result, self.results)


def batch(
    jobs: PathLike,
    *,
    workers: Method[int | None] = None,
    overwrite: Output[bool] = False,
    progress: bool | None = None,
) -> BatchReport:
    """Completes, tracks or registers many files; one that fails does not stop the others.

    A row of the table is a command line, and its columns are options: "input" and "output" of a
    completion, "scans" and "output" of tracking, or "scan" and "output" of a registration, and any
    others of the same command. An empty value stands for the default, several paths are separated
    by semicolons, and all are relative to the table. Jobs whose output exists are skipped, so that
    running the command again does what is left. Why an output is doubtful is kept in a file beside
    it, `OUTPUT.doubtful.txt`, and told again until that is removed or the output is made anew.

    A job that reads the output of another runs after it, or not at all if that fails. Spaces around
    values, empty lines and lines that begin with # do not count.

    Args:
        jobs: comma-separated values, with the names of the columns in the first line.
        workers: run so many jobs at a time; else, one per processor.
        overwrite: whether to replace existing outputs instead of skipping them.
        progress: whether to show on standard error how far it is.
    """
    table = path_of("jobs", jobs)
    if workers is not None:
        check_integer("workers", workers, 1)
    rows = read_jobs(table, overwrite=overwrite)
    made = {i: there for i, job in enumerate(rows) if (there := _already(job)) is not None}
    left = [i for i in range(len(rows)) if i not in made]
    with closing(_run(rows, left, workers or os.cpu_count() or 1)) as running:
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
    if "--overwrite" in job.words or not exists(job.output):
        return None
    doubt = _doubt_of(job.output)
    if doubt:
        return _result(job, "doubtful", "doubtful", doubt)
    return _result(job, "exists", "good", f"{job.output}: exists already")


def _result(job: Job, status: Status, quality: Quality = "failed", reason: str = "") -> Result:
    return Result(input=job.input, output=job.output, status=status, quality=quality, reason=reason)


def _run(
    jobs: Sequence[Job], left: Sequence[int], workers: int
) -> Generator[tuple[int, Result], None, None]:
    """Yields the results of the jobs with these indices, each after those that it needs.

    Each is a process of its own, so that no error, not even of the memory, ends another one.
    """
    order = TopologicalSorter({i: {*jobs[i].needs} & {*left} for i in left})
    order.prepare()
    ready, failed = list[int](), set[int]()
    running = dict[Future[tuple[str, str]], tuple[int, Popen[str], float]]()
    with ThreadPoolExecutor(workers) as listening:
        try:
            while order.is_active():
                ready += order.get_ready()
                while ready and len(running) < workers:
                    job = jobs[i := ready.pop(0)]
                    if lost := failed & {*job.needs}:
                        why = f"needs {jobs[min(lost)].output}, which could not be made"
                        failed.add(i)
                        order.done(i)
                        yield i, _result(job, "not run", reason=why)
                    else:
                        process = _started(job)
                        running[listening.submit(process.communicate)] = (
                            i, process, time.monotonic()
                        )  # fmt: skip
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    i, process, began = running.pop(future)
                    seconds = time.monotonic() - began
                    result = _ended(jobs[i], process.returncode, *future.result(), seconds)
                    failed |= {i} if result.status == "failed" else set()
                    order.done(i)
                    yield i, result
        finally:
            for _, process, _ in running.values():
                if os.name == "posix":  # elsewhere, the console interrupts all
                    process.send_signal(signal.SIGINT)


def _started(job: Job) -> Popen[str]:
    """Starts the command of a job; only :func:`_run` interrupts it, so that this happens once."""
    return Popen(
        [sys.executable, "-P", "-m", "dynmesh", *job.words],
        cwd=job.folder,
        env=os.environ | {"PYTHONUTF8": "1"},
        stdin=DEVNULL,
        stdout=PIPE,
        stderr=PIPE,
        encoding="utf-8",
        errors="replace",
        process_group=0,
    )


def _ended(job: Job, code: int, told: str, error: str, seconds: float) -> Result:
    """The result of a job whose command has ended."""
    if code not in (0, 3):
        if (there := _already(job)) is not None:
            return there  # of another process
        *before, message = error.splitlines() or [""]
        message = message.removeprefix("dynmesh: ")
        if code < 0 or not message:
            message = f"its process ended with {code}"
        reason = message if job.input.name in message else f"{job.input}: {message}"
        return replace(
            _result(job, "failed", reason=reason), seconds=seconds, traceback=tuple(before)
        )
    report = json.loads(told)
    note = _note_of(job.output)
    if report["quality"] == "good":
        note.unlink(missing_ok=True)
    else:
        note.write_text(report["reason"], encoding="utf-8")
    return replace(
        _result(job, "doubtful" if code else "done", report["quality"], report["reason"]),
        remarks=(*report["remarks"], *error.splitlines()),
        frames=report.get("frames", 1),  # a registration has one
        seconds=seconds,
    )


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
