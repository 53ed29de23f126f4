"""Completion of many files, by any number of processes or machines."""

import csv
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor, Future, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, cast

from .file_completion import FileReport, OtherJobError, Source, complete_file
from .streaming import Settings


@dataclass(frozen=True)
class Job:
    """One file to complete.

    Attributes:
        input: the incomplete sequence, in any format.
        output: where the completed one goes; its folder must exist.
        source: how to read the input, as :func:`dynmesh.open` documents.
        output_format: None goes by the suffix of `output`.
        fps: frames per second of the output; None: what the input says.
        provenance: also write the generation and the age of every vertex.
        settings: those of :class:`dynmesh.Completer`.
    """

    input: Path
    output: Path
    source: Source = field(default_factory=Source)
    output_format: str | None = None
    fps: float | None = None
    provenance: bool = False
    settings: Settings = field(default_factory=Settings)


@dataclass(frozen=True)
class Result:
    """What became of a job.

    Attributes:
        job: the job.
        status: "done"; "exists", where the output was there already; "failed".
        reason: why it failed, in one line; empty otherwise.
        frames: in the output; 0 unless done.
        seconds: that it took.
    """

    job: Job
    status: Literal["done", "exists", "failed"]
    reason: str = ""
    frames: int = 0
    seconds: float = 0.0


def complete_files(
    jobs: Iterable[Job],
    executor: Executor | None = None,
    *,
    overwrite: bool = False,
    watch: Callable[[Result], None] | None = None,
) -> list[Result]:
    """Completes every job's file; one that fails does not stop the others.

    A job whose output exists is left alone, and an interrupted one goes on where it stopped, so
    the same call again does what is left to do. Outputs appear under their names when they are
    whole. Every process must see the files under the same paths.

    Args:
        jobs: with different outputs.
        executor: runs them, as :class:`concurrent.futures.ProcessPoolExecutor` or a Dask client's
            ``get_executor()``; None: one after another, here.
        overwrite: replace outputs that exist.
        watch: called with each result as it comes.

    Returns:
        The results, in the order of the jobs.

    Raises:
        ValueError: two jobs have the same output.
    """
    jobs = list(jobs)
    _check_outputs(jobs)
    results: dict[int, Result] = {}

    def take(number: int, result: Result) -> None:
        results[number] = result
        if watch is not None:
            watch(result)

    if executor is None:
        for number, job in enumerate(jobs):
            take(number, _run(job, overwrite))
    else:
        futures = {executor.submit(_run, job, overwrite): i for i, job in enumerate(jobs)}
        for future in as_completed(futures):
            number = futures[future]
            take(number, _result_of(future, jobs[number]))
    return [results[number] for number in range(len(jobs))]


def read_jobs(path: Path) -> list[Job]:
    """Reads jobs from a table with a line for each.

    Args:
        path: comma-separated values. The first line names the columns: `input`, `output` and, where
            wanted, `format`, `output_format`, `faces`, `prim`, `mask`, `missing`, `fps`,
            `provenance`, `revisit`, `extra_iterations`, `unseen`, as the options of ``dynmesh
            complete`` are called. An empty value is the default. Paths are relative to the table.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no such table; the message names the line and the value.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            table = csv.DictReader(file, strict=True)
            columns = table.fieldnames or []
            _check_columns(path, columns)
            return [_job_of(path, table.line_num, row) for row in table]
    except (csv.Error, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: is no table of comma-separated values: {error}") from error


def _run(job: Job, overwrite: bool) -> Result:
    """What a worker does."""
    began = time.monotonic()
    try:
        try:
            report = _complete(job, overwrite, resume=True)
        except OtherJobError:  # the table has changed since
            report = _complete(job, overwrite, resume=False)
    except FileExistsError:
        return Result(job, "exists")
    except Exception as error:  # whatever it is, the other jobs go on
        return Result(job, "failed", _in_one_line(error), seconds=time.monotonic() - began)
    return Result(job, "done", "", report.frames, time.monotonic() - began)


def _complete(job: Job, overwrite: bool, *, resume: bool) -> FileReport:
    return complete_file(
        job.input,
        job.output,
        source=job.source,
        output_format=job.output_format,
        fps=job.fps,
        provenance=job.provenance,
        overwrite=overwrite,
        resume=resume,
        **job.settings,
    )


def _result_of(future: "Future[Result]", job: Job) -> Result:
    try:
        return future.result()
    except Exception as error:  # the worker, not the job
        return Result(job, "failed", f"the worker was lost: {_in_one_line(error)}")


def _in_one_line(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename:
        return f"{error.filename}: {error.strerror}"
    lines = str(error).splitlines()
    return lines[0] if lines else type(error).__name__


def _check_outputs(jobs: list[Job]) -> None:
    seen: set[Path] = set()
    for job in jobs:
        if (output := Path(job.output).absolute()) in seen:
            raise ValueError(f"{job.output}: is the output of two jobs")
        seen.add(output)


def _check_columns(path: Path, columns: Iterable[str]) -> None:
    for needed in ("input", "output"):
        if needed not in columns:
            raise ValueError(f"{path}: has no column '{needed}'")
    for column in columns:
        if column not in ("input", "output", *_columns):
            raise ValueError(
                f"{path}: the column '{column}' is not known, but {', '.join(_columns)}"
            )


def _job_of(path: Path, line: int, row: Mapping[str, Any]) -> Job:
    place = f"{path}: line {line}"
    if None in row or None in row.values():
        raise ValueError(f"{place}: has more or fewer values than there are columns")
    for needed in ("input", "output"):
        if not row[needed]:
            raise ValueError(f"{place}: {needed} is empty")
    values: dict[str, Any] = {}
    for column, parse in _columns.items():
        if text := row.get(column):
            try:
                values[column] = parse(text)
            except ValueError as error:
                raise ValueError(f"{place}: {column}: {error}") from error
    for column in ("faces", "mask"):
        if column in values:
            values[column] = path.parent / values[column]
    if "mask" in values:
        values["known"] = values.pop("mask")
    source = {name: values.pop(name) for name in Source.__annotations__ if name in values}
    return Job(
        path.parent / row["input"],
        path.parent / row["output"],
        cast(Source, source),
        values.pop("output_format", None),
        values.pop("fps", None),
        values.pop("provenance", False),
        cast(Settings, values),
    )


def _flag(text: str) -> bool:
    flags = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
    if text.lower() not in flags:
        raise ValueError(f"must be true or false, not '{text}'")
    return flags[text.lower()]


_columns: dict[str, Callable[[str], Any]] = {
    "format": str,
    "output_format": str,
    "faces": str,
    "prim": str,
    "mask": str,
    "missing": str,
    "fps": float,
    "provenance": _flag,
    "revisit": _flag,
    "extra_iterations": int,
    "unseen": str,
}
