"""What all verbs tell: reports, tables and words, and how far a long piece of work is."""

import csv
import dataclasses
import math
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby, zip_longest
from pathlib import Path
from typing import Any, Literal, TypeVar

Quality = Literal["good", "doubtful", "ruined", "failed"]

_FEW = 5
"""So many things are named, of many."""


class DoubtfulWarning(UserWarning):
    """A result is doubtful or probably ruined, by its own measure."""


def warn(message: str, kind: type[Warning] = UserWarning) -> None:
    """Warns at the line outside of this package that asked for what was done."""
    package, level, frame = str(Path(__file__).parent), 1, sys._getframe()
    while frame.f_back is not None and frame.f_code.co_filename.startswith(package):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, kind, stacklevel=level)


@dataclass(frozen=True, kw_only=True)
class Report:
    """What was done. Printed, it is :meth:`lines`.

    Attributes:
        quality: "good"; "doubtful" or "ruined", of a result that was written but is probably wrong,
            by its own measure; "failed" if something was not done.
        reason: why the quality is not good, in a sentence; empty if it is.
        remarks: remarks for the user, one line each.
    """

    quality: Quality = "good"
    reason: str = ""
    remarks: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """Says what was done, and how well, in sentences."""
        return [*([self.reason] if self.reason else []), *self.remarks]

    def to_dict(self) -> dict[str, Any]:
        """Returns the attributes as values that JSON has; None where a number is not finite."""
        return {
            one.name: as_json(getattr(self, one.name))
            for one in dataclasses.fields(self)
            if one.repr
        }

    def __str__(self) -> str:
        return "\n".join(self.lines())


@dataclass(frozen=True, kw_only=True)
class OutputReport(Report):
    """What was done to make frames in a file or folder.

    Attributes:
        output: the file or folder that was written.
        frames: number of frames in it.
    """

    output: Path
    frames: int


def write_csv(path: Path, kind: type, rows: Iterable[Any]) -> None:
    """Writes a table with a row for each object, and a column for each field that it prints."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = [field.name for field in dataclasses.fields(kind) if field.repr]
        writer.writerow(names)
        writer.writerows([getattr(one, name) for name in names] for one in rows)


def as_json(value: Any) -> Any:
    """Returns a value as JSON has it."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {one.name: as_json(getattr(value, one.name)) for one in dataclasses.fields(value)}
    if hasattr(value, "tolist"):  # an array or number of numpy, which takes long to load
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(name): as_json(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [as_json(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def listed(names: Iterable[object], last: str = "and") -> str:
    """Joins names to a list such as "a, b and c"."""
    *most, end = map(str, names)
    return f"{', '.join(most)} {last} {end}" if most else end


def some_of(names: list[str], most: int = 10) -> str:
    """Joins names to a list, which is cut off if it is long."""
    rest = [f"and {len(names) - most} more"] if len(names) > most else []
    return ", ".join(names[:most] + rest)


def counted(count: int, what: str) -> str:
    """Returns a number with its noun, such as "1 vertex" or "2 vertices"."""
    plural = "vertices" if what == "vertex" else f"{what}s"
    return f"{count} {what if count == 1 else plural}"


def percent(share: float) -> str:
    """Formats a share; never shows 0 % or 100 % for a share that is not exactly that."""
    if 0 < share < 0.0005:
        return "less than 0.1 %"
    if 0.9995 < share < 1:
        return "more than 99.9 %"
    return f"{100 * share:.3g} %"


def runs_of(numbers: Iterable[Any]) -> list[list[Any]]:
    """Splits ascending numbers into runs of consecutive ones."""
    along = groupby(enumerate(numbers), lambda item: item[1] - item[0])
    return [[number for _, number in run] for _, run in along]


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Returns the lines of a table, whose columns begin below one another."""
    widths = [max(map(len, column)) for column in zip_longest(*rows, fillvalue="")]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


def few(what: str, places: Iterable[Any]) -> str:
    """Names the first of some things, such as "vertices 3, 7 and 12 others"."""
    names = [str(place) for place in places]
    return _few(what, names[:_FEW], len(names), _FEW)


def few_frames(frames: Iterable[int], header: Any) -> str:
    """Names the first of some frames, counted from 0, such as "frames 3, 7 to 9 and 12 others"."""
    named, shown, counts = runs_of(map(int, frames)), list[str](), 0
    for run in named[:_FEW]:
        ends = run if len(run) < 3 else [run[0], run[-1]]
        numbers = [str(header.number(frame)) for frame in ends]
        shown += numbers if len(run) < 3 else [" to ".join(numbers)]
        counts += len(run)
    return _few("frame", shown, sum(map(len, named)), counts)


def _few(what: str, shown: list[str], count: int, n_shown: int) -> str:
    noun = counted(count, what).partition(" ")[2]
    if count > n_shown:
        return f"{noun} {', '.join(shown)} and {counted(count - n_shown, 'other')}"
    return f"{noun} {listed(shown)}"


T = TypeVar("T")

LONG = 2.0
"""Seconds after which work is shown that nobody asked to show."""


@contextmanager
def steps(what: str, progress: bool | None) -> Iterator[Callable[[int, int], None]]:
    """Shows work in steps, labelled with what is being done, if `progress` is set.

    With None, work in a terminal that takes long is shown.

    Yields:
        A function of the number of steps that are done and of all steps.
    """
    is_terminal = sys.stderr is not None and sys.stderr.isatty()  # which a service may lack
    if sys.stderr is None or not (is_terminal if progress is None else progress):
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeRemainingColumn as Remaining

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Remaining())
    bar, began = Progress(*columns, console=Console(stderr=True), transient=True), time.monotonic()
    task = bar.add_task(what, total=None)

    def advance(done: int, total: int) -> None:
        if progress is None and time.monotonic() - began < LONG:
            return
        bar.start()
        bar.update(task, completed=done, total=total)

    try:
        if progress:
            bar.start()
        yield advance
    finally:
        bar.stop()


def tracked(items: Iterable[T], total: int, what: str, progress: bool | None) -> Iterator[T]:
    """Passes items on, of which there are so many, and shows how far that is, as `steps` does."""
    with steps(what, progress) as show:
        for done, item in enumerate(items):
            show(done, total)
            yield item
