"""The table of a batch: its rows as jobs, some of which need the outputs of others."""

import csv
import os
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from .._checks import path_of
from .._errors import InputError
from .._report import listed
from ..formats.names import FrameNames
from .command import SHARED

VERBS = {"input": "complete", "scans": "track", "scan": "register"}
"""The commands, by the column that says what a row is for."""

_OF_BATCH = {*SHARED, "overwrite"}


@dataclass(frozen=True)
class Job:
    """A row of a table: a command line, whose paths begin at the folder of the table.

    Attributes:
        line: of the table.
        folder: of the table.
        words: the command line.
        input: the incomplete sequence, or the scans.
        output: what is written.
        reads: what may be read: all other values, as paths.
        needs: the indices of the jobs whose outputs it reads.
    """

    line: int
    folder: Path
    words: tuple[str, ...]
    input: Path
    output: Path
    reads: tuple[Path, ...]
    needs: tuple[int, ...] = ()


def read_jobs(path: Path, *, overwrite: bool = False) -> list[Job]:
    """Reads the jobs of a table.

    Spaces around values and names of columns are left out, and so are empty lines and those that
    begin with #.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file, strict=True, skipinitialspace=True)
            rows = [(reader.line_num, [text.strip() for text in row]) for row in reader]
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(f"is not a table of comma-separated values: {error}", file=path) from error
    rows = [(line, row) for line, row in rows if any(row) and not row[0].startswith("#")]
    columns = _columns(path, rows[0][1] if rows else [])
    jobs = [_job(path, line, columns, row, overwrite) for line, row in rows[1:]]
    if not jobs:
        raise InputError("has no jobs, only the names of the columns", file=path)
    _refuse_common_outputs(path, jobs)
    return _with_needs(path, jobs)


def exists(output: Path) -> bool:
    """Whether there is an output, or a frame of it, without opening it."""
    names = FrameNames.of(output)
    if not names.numbered:
        return os.path.lexists(output) and not output.is_dir()
    return any(names.number(file.name) is not None for file in names.folder.glob("*"))


def _columns(path: Path, names: list[str]) -> list[str]:
    for needed in ([*VERBS], ["output"]):
        if not set(needed) & set(names):
            words = listed(map(repr, needed), "or")
            raise InputError(f"has no column {words}; columns are separated by commas", file=path)
    for number, name in enumerate(names):
        if name in _OF_BATCH:
            raise _wrong(path, 1, name, "is an option of the whole batch")
        if not name or name in names[:number]:
            message = f"is the name of column {number + 1}; each needs its own"
            raise _wrong(path, 1, repr(name), message)
    return names


def _wrong(path: Path, line: int, column: str | None, reason: str) -> InputError:
    place = f"line {line}" if column is None else f"line {line}: {column}"
    return InputError(reason, argument=place, file=path)


def _job(path: Path, line: int, columns: list[str], row: list[str], overwrite: bool) -> Job:
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
    *inputs, output = (path_of(name, given.pop(name), folder=path.parent) for name in names)
    words, reads = [VERBS[kind], *map(str, inputs), str(output)], [*inputs]
    for name, text in given.items():
        for value in map(str.strip, text.split(";")):
            words.append(f"--{name.replace('_', '-')}={value}")
            reads.append(path_of(name, value or ".", folder=path.parent))
    words += ["--json", *(["--overwrite"] if overwrite else [])]
    return Job(line, path.parent, tuple(words), inputs[-1], output, tuple(reads))


def _identity(output: Path) -> str:
    """Names an output however its path is written."""
    return os.path.realpath(output.with_name(FrameNames.of(output).pattern))


def _refuse_common_outputs(path: Path, jobs: list[Job]) -> None:
    lines: dict[str, int] = {}
    for job in jobs:
        first = lines.setdefault(_identity(job.output), job.line)
        if first != job.line:
            message = f"{str(job.output)!r} is the output of line {first} already"
            raise _wrong(path, job.line, "output", message)


def _with_needs(path: Path, jobs: list[Job]) -> list[Job]:
    """Finds which outputs the jobs read, as a file, a folder or a pattern."""
    by_output, by_folder = dict[str, int](), defaultdict[str, list[tuple[str, int]]](list)
    for index, job in enumerate(jobs):
        by_output[_identity(job.output)] = index
        names = FrameNames.of(job.output)
        if names.numbered:
            by_folder[os.path.realpath(names.folder)].append((names.name(1), index))
        elif not job.output.suffix:  # a folder, whose names of frames are not known
            by_folder[os.path.realpath(job.output)].append(("", index))

    def made_for(read: Path) -> Iterator[int]:
        if (whole := by_output.get(_identity(read))) is not None:
            yield whole
        yield from (index for _, index in by_folder[os.path.realpath(read)])
        names = FrameNames.of(read)
        for example, index in by_folder[os.path.realpath(read.parent)]:
            is_own = names.number(example) is not None if names.numbered else False
            if is_own or not example or fnmatchcase(example, read.name):
                yield index

    results = []
    for index, job in enumerate(jobs):
        if _identity(job.output) in map(_identity, job.reads):
            raise _wrong(path, job.line, "output", "is a file that the same job reads")
        needed = sorted({i for read in job.reads for i in made_for(read)} - {index})
        results.append(replace(job, needs=tuple(needed)))
    try:
        TopologicalSorter({i: job.needs for i, job in enumerate(results)}).prepare()
    except CycleError as error:
        lines = listed(sorted({jobs[i].line for i in error.args[1]}))
        message = "each needs the output of another, so that none can be the first"
        raise InputError(message, argument=f"lines {lines}", file=path) from None
    return results
