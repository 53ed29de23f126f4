"""Tables of jobs and tables of their results."""

import csv
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any, cast

from ..files.scans import UNITS
from ..settings import SETTINGS, Setting, Settings
from .batch import Job, Result
from .checkpoint import Source
from .start import Start
from .tracking_job import TrackingJob


def read_jobs(path: Path) -> list[Job | TrackingJob]:
    """Reads jobs from a table with one line per job.

    Args:
        path: comma-separated values. The first line names the columns: `input`, `output` and,
            optionally, `start`, `template`, `training`, `gaps`, `format`, `output_format`,
            `faces`, `prim`, `mask`, `missing`, `fps`, `provenance`, `overlay`, `drop_above` and the
            settings of :class:`dynmesh.Completer`, named like the options of ``dynmesh complete``.
            A line with a value in `scans` instead of `input` is tracked, see :func:`track_file`; it
            needs a `template`, and may have `cameras`, `scan_unit` and `template_unit`. An empty
            value stands for the default. Paths are relative to the table; several paths
            in `training` are separated by semicolons.

    Raises:
        OSError: the table cannot be read.
        ValueError: the table is invalid; the message names the line and the value.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            table = csv.DictReader(file, strict=True)
            columns = table.fieldnames or []
            _check_columns(path, columns)
            return [_job_of(path, table.line_num, row) for row in table]
    except (csv.Error, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: is not a table of comma-separated values: {error}") from error


_SEPARATORS = {";": "semicolons", "\t": "tabs"}


@contextmanager
def report_file(path: Path) -> Iterator[Callable[[Result], None]]:
    """Opens a table to which results are added as they arrive; an existing file is replaced.

    Args:
        path: comma-separated values. The columns are `input`, `output`, `status`, `reason`,
            `frames` and `seconds`, see :class:`dynmesh.batch.Result`.

    Yields:
        A function that adds a result.

    Raises:
        OSError: the file cannot be written.
    """
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["input", "output", "status", "reason", "frames", "seconds"])

        def add(result: Result) -> None:
            job = result.job
            outcome = (result.status, result.reason, result.frames, f"{result.seconds:.3f}")
            table.writerow([job.input, job.output, *outcome])
            file.flush()  # so that a killed process leaves its results

        yield add


def _check_columns(path: Path, columns: Iterable[str]) -> None:
    names = ("input", "scans", "output", *_columns)
    for needed in ("input", "output"):
        if needed not in columns and not (needed == "input" and "scans" in columns):
            used = [what for mark, what in _SEPARATORS.items() if mark in "".join(columns)]
            hint = f"; separate the values by commas instead of {used[0]}" if used else ""
            raise ValueError(f"{path}: has no column '{needed}'{hint}")
    for column in columns:
        if column not in names:
            raise ValueError(
                f"{path}: unknown column '{column}'; the columns are {', '.join(names)}"
            )


def _job_of(path: Path, line: int, row: Mapping[str, Any]) -> Job | TrackingJob:
    place = f"{path}: line {line}"
    if None in row or None in row.values():
        raise ValueError(f"{place}: has more or fewer values than there are columns")
    if row.get("scans") and row.get("input"):
        raise ValueError(f"{place}: has both input and scans")
    kind = "scans" if row.get("scans") else "input"
    for needed in (kind, "output"):
        if not row.get(needed):
            raise ValueError(f"{place}: {needed} is empty")
    values: dict[str, Any] = {}
    for column, parse in _columns.items():
        if text := row.get(column):
            if column in (_only_of_input if kind == "scans" else _only_of_scans):
                raise ValueError(f"{place}: {column}: cannot be combined with {kind}")
            try:
                values[column] = parse(text)
            except ValueError as error:
                raise ValueError(f"{place}: {column}: {error}") from error
    for column in ("faces", "mask", "template", "cameras"):
        if column in values:
            values[column] = path.parent / values[column]
    if "training" in values:
        values["training"] = tuple(path.parent / name for name in values["training"])
    files = path.parent / row[kind], path.parent / row["output"]
    if kind == "scans":
        if "template" not in values:
            raise ValueError(f"{place}: template is empty; scans need the mesh to track")
        if values.get("uncertainty") and not values.get("provenance"):
            raise ValueError(
                f"{place}: uncertainty: needs provenance, with which output has the standard errors"
            )
        return TrackingJob(*files, **values)
    if "mask" in values:
        values["known"] = values.pop("mask")
    source = {name: values.pop(name) for name in Source.__annotations__ if name in values}
    others = {name: values.pop(name) for name in _of_job if name in values}
    return Job(*files, cast(Source, source), settings=cast(Settings, values), **others)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"must be a number, not '{text}'") from None


def _whole_number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"must be a whole number, not '{text}'") from None


def start_of(text: str) -> Start:
    """Parses the frame at which completion starts: a number, or "whole".

    Raises:
        ValueError: it is neither.
    """
    if text == "whole":
        return "whole"
    if not text.isdecimal():
        raise ValueError(f"must be whole or the number of a frame, not '{text}'")
    return int(text)


def _paths(text: str) -> list[str]:
    paths = [part.strip() for part in text.split(";")]
    if not all(paths):
        raise ValueError(f"must be paths with semicolons between them, not '{text}'")
    return paths


def _unit(text: str) -> str | float:
    return text if text in UNITS else _number(text)


def _flag(text: str) -> bool:
    flags = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
    if text.lower() not in flags:
        raise ValueError(f"must be true or false, not '{text}'")
    return flags[text.lower()]


def _one_of(*names: str) -> Callable[[str], str]:
    def check(text: str) -> str:
        if text not in names:
            raise ValueError(f"must be {' or '.join(names)}, not '{text}'")
        return text

    return check


def _parser_of(setting: Setting) -> Callable[[str], Any]:
    """What reads a value of the setting from a table."""
    if setting.choices:
        return _one_of(*setting.choices)
    parsers: dict[type[Any], Callable[[str], Any]]
    parsers = {bool: _flag, int: _whole_number, float: _number}
    return parsers[setting.kind]


_of_job = (
    "start",
    "template",
    "training",
    "output_format",
    "fps",
    "provenance",
    "overlay",
    "drop_above",
)

_columns: dict[str, Callable[[str], Any]] = {
    "start": start_of,
    "template": str,
    "cameras": str,
    "scan_unit": _unit,
    "template_unit": _unit,
    "training": _paths,
    "gaps": _one_of("refuse", "lost"),
    "format": str,
    "output_format": str,
    "faces": str,
    "prim": str,
    "mask": str,
    "missing": _one_of("zero"),
    "fps": _number,
    "provenance": _flag,
    "overlay": _flag,
    "drop_above": _number,
    **{name: _parser_of(setting) for name, setting in SETTINGS.items()},
}

_of_tracking = {field.name for field in fields(TrackingJob)}
_only_of_scans = {"cameras", "scan_unit", "template_unit"}
_only_of_input = _columns.keys() - _of_tracking

optional_columns = tuple(_columns)
"""The columns that a table of jobs may have besides `input`, `scans` and `output`."""
