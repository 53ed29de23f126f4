"""Tables of jobs and tables of their results."""

import csv
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..settings import SETTINGS
from .batch import AnyJob, Job, Result
from .option import Option, grouped, options_of
from .register_job import RegisterJob
from .tracking_job import TrackingJob


def read_jobs(path: Path) -> list[AnyJob]:
    """Reads jobs from a table with one line per job.

    Args:
        path: comma-separated values. The first line names the columns: `input`, `output` and,
            optionally, `start`, `template`, `training`, `gaps`, `format`, `output_format`,
            `faces`, `prim`, `mask`, `missing`, `bidirectional`, `provenance`, `overlay`,
            `drop_above` and the settings of :class:`dynmesh.Completer`, named like the options of
            ``dynmesh complete``. A line with a value in `scans` instead of `input` is tracked, see
            :func:`track_file`; it needs a `template`, and may have `cameras`, `scan_unit` and
            `template_unit`. One with a value in `scan` is registered, see :func:`register_file`,
            with its options. An empty value stands for the default. Paths are relative to the
            table; several paths in `training` are separated by semicolons.

    Raises:
        OSError: the table cannot be read.
        ValueError: the table is invalid; the message names the line and the value.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            table = csv.DictReader(file, strict=True)
            columns = table.fieldnames or []
            _check_columns(path, columns)
            jobs: list[AnyJob] = []
            lines: dict[str, int] = {}
            for row in table:
                jobs.append(_job_of(path, table.line_num, row))
                first = lines.setdefault(os.path.realpath(jobs[-1].output), table.line_num)
                if first != table.line_num:
                    raise ValueError(
                        f"{path}: line {table.line_num}: output: '{row['output']}' is the output "
                        f"of line {first} already"
                    )
            return jobs
    except (csv.Error, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: is not a table of comma-separated values: {error}") from error


_SEPARATORS = {";": "semicolons", "\t": "tabs"}


@contextmanager
def report_file(path: Path) -> Iterator[Callable[[Result], None]]:
    """Opens a table to which results are added as they arrive; an existing file is replaced.

    Yields:
        A function that adds a result.

    Raises:
        OSError: the file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["input", "output", "status", "reason", "frames", "seconds"])

        def add(result: Result) -> None:
            job, status = result.job, result.status
            reason = "; ".join(result.remarks) if status == "doubtful" else result.reason
            seconds = f"{result.seconds:.3f}"
            table.writerow([job.input, job.output, status, reason, result.frames, seconds])
            file.flush()  # so that a killed process leaves its results

        yield add


def _check_columns(path: Path, columns: Iterable[str]) -> None:
    names = (*_kinds, "output", *optional_columns)
    for needed in ([*_kinds], ["output"]):
        if not set(needed) & set(columns):
            used = [what for mark, what in _SEPARATORS.items() if mark in "".join(columns)]
            hint = f"; separate the values by commas instead of {used[0]}" if used else ""
            listed = " or ".join(f"'{name}'" for name in needed)
            raise ValueError(f"{path}: has no column {listed}{hint}")
    for column in columns:
        if column not in names:
            raise ValueError(
                f"{path}: unknown column '{column}'; the columns are {', '.join(names)}"
            )


def _job_of(path: Path, line: int, row: Mapping[str, Any]) -> AnyJob:
    place = f"{path}: line {line}"
    if None in row or None in row.values():
        raise ValueError(f"{place}: has more or fewer values than there are columns")
    given = [kind for kind in _kinds if row.get(kind)]
    if len(given) > 1:
        raise ValueError(f"{place}: has both {given[0]} and {given[1]}")
    kind = given[0] if given else "input"
    for needed in (kind, "output"):
        if not row.get(needed):
            raise ValueError(f"{place}: {needed} is empty")
    values: dict[str, Any] = {}
    for column in optional_columns:
        if text := row.get(column):
            if column not in _kinds[kind]:
                raise ValueError(f"{place}: {column}: cannot be combined with {kind}")
            name, option = _kinds[kind][column]
            try:
                values[name] = _read(option, text, path.parent)
            except ValueError as error:
                raise ValueError(f"{place}: {column}: {error}") from error
    files = path.parent / row[kind], path.parent / row["output"]
    if kind == "scan":
        if "template" not in values:
            raise ValueError(f"{place}: template is empty; a scan needs the mesh to register")
        return RegisterJob(*files, **values)
    if kind == "scans":
        if "template" not in values:
            raise ValueError(f"{place}: template is empty; scans need the mesh to track")
        if values.get("uncertainty") and not values.get("provenance"):
            raise ValueError(
                f"{place}: uncertainty: needs provenance, with which output has the standard errors"
            )
        return TrackingJob(*files, **values)
    return Job(*files, **grouped(values))


def _number(kind: type[int] | type[float], text: str) -> float:
    try:
        return kind(text)
    except ValueError:
        what = "a whole number" if kind is int else "a number"
        raise ValueError(f"must be {what}, not '{text}'") from None


def _paths(text: str) -> list[str]:
    paths = [part.strip() for part in text.split(";")]
    if not all(paths):
        raise ValueError(f"must be paths with semicolons between them, not '{text}'")
    return paths


def _flag(text: str) -> bool:
    flags = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
    if text.lower() not in flags:
        raise ValueError(f"must be true or false, not '{text}'")
    return flags[text.lower()]


def _read(option: Option, text: str, folder: Path) -> Any:
    """Reads a value from a table in a folder."""
    if option.parse is not None:
        return option.parse(text)
    if option.choices and text not in option.choices:
        raise ValueError(f"must be {' or '.join(option.choices)}, not '{text}'")
    if option.several:
        return tuple(folder / name for name in _paths(text))
    if option.kind is Path:
        return folder / text
    if option.kind is bool:
        return _flag(text)
    return text if option.kind is str else _number(option.kind, text)


def _columns_of(kind: type[Any]) -> dict[str, tuple[str, Option]]:
    """The columns of a kind of job, and which option each one holds."""
    return {option.name or name: (name, option) for name, option in options_of(kind).items()}


_kinds = {
    "input": _columns_of(Job),
    "scans": _columns_of(TrackingJob),
    "scan": _columns_of(RegisterJob),
}
"""By the column that says what kind of job a line is."""

optional_columns = tuple(
    sorted({name: None for kind in _kinds.values() for name in kind}, key=SETTINGS.__contains__)
)
"""The columns that a table of jobs may have besides `input`, `scans`, `scan` and `output`."""
