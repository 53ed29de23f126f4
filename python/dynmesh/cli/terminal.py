"""Messages and progress in the terminal, all on standard error."""

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn, TypeVar

from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

T = TypeVar("T")

PATIENCE = 2.0
"""Seconds before a progress bar appears for what is often quick."""

DOUBTFUL = 3
"""The exit code if an output was written but is doubtful or ruined by its own measure."""

_console = Console(stderr=True, emoji=False)  # names may contain ":B:"


def be_quiet(quiet: bool) -> None:
    """Prints errors alone from now on, or everything."""
    _console.quiet = quiet


def say(message: str) -> None:
    """Prints a line without interpreting markup."""
    _console.print(escape(message), highlight=False, soft_wrap=True)


def show(table: Table, *, highlight: bool = True) -> None:
    """Prints a table on standard output, without spaces at the ends of its lines."""
    console = Console(emoji=False)
    with console.capture() as printed:
        console.print(table, highlight=highlight)
    for line in printed.get().splitlines():
        print(line.rstrip())


def say_remarks(output: Path, remarks: Iterable[str]) -> None:
    """Prints the remarks about a file that was written, one per line."""
    for remark in remarks:
        say(f"{output}: {remark}")


def fail(why: str) -> NoReturn:
    """Ends the program with a one-line error message."""
    be_quiet(False)
    _console.print(f"[red]dynmesh:[/red] {escape(why)}", highlight=False, soft_wrap=True)
    sys.exit(1)


def track(items: Iterable[T], total: int, what: str, patience: float = 0) -> Iterator[T]:
    """Passes items on and shows a progress bar with the number of items and the rate.

    Args:
        items: the items.
        total: their number.
        what: what is being done, as the label of the bar.
        patience: seconds before the bar appears.
    """
    columns = (
        TextColumn(what),
        BarColumn(),
        MofNCompleteColumn(),
        _FramesPerSecond(),
        TimeRemainingColumn(),
    )
    progress = _bar(*columns)
    task = progress.add_task(what, total=total)
    show_at = time.monotonic() + patience
    try:
        if patience == 0:
            progress.start()
        for item in items:
            if time.monotonic() >= show_at:
                progress.start()  # has no effect the second time
            yield item
            progress.advance(task)
    finally:
        progress.stop()


def watch_training(frames: Iterable[T], total: int) -> Iterator[T]:
    """Passes on training frames and shows a progress bar if reading takes long."""
    return track(frames, total, "reading training", patience=PATIENCE)


@contextmanager
def work_bar(what: str) -> Iterator[Callable[[str, int, int], None]]:
    """Shows a progress bar for work in steps, which begins with `what`.

    Yields:
        A function of what is being done, the number of steps done, and that of all steps.
    """
    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with _bar(TextColumn("{task.description}"), *columns) as progress:
        task = progress.add_task(what, total=None)
        yield lambda what, done, whole: progress.update(
            task, description=what, completed=done, total=whole
        )


@contextmanager
def steps_bar() -> Iterator[Callable[[str, int, int], None]]:
    """Shows a progress bar for each kind of work in steps, if it takes long.

    Yields:
        A function of what is being done, the number of steps done, and that of all steps. The bar
        goes when they are equal.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    begun: dict[str, tuple[Progress, TaskID, float]] = {}

    def show(what: str, done: int, whole: int) -> None:
        if what not in begun:
            bar = _bar(*columns, TimeRemainingColumn())
            begun[what] = bar, bar.add_task(what), time.monotonic() + PATIENCE
        bar, task, show_at = begun[what]
        bar.update(task, completed=done, total=whole)
        if done == whole:
            bar.stop()
        elif time.monotonic() >= show_at:
            bar.start()

    try:
        yield show
    finally:
        for bar, *_ in begun.values():
            bar.stop()


def _bar(*columns: ProgressColumn) -> Progress:
    return Progress(*columns, console=_console, disable=not _console.is_terminal)


class _FramesPerSecond(ProgressColumn):
    def render(self, task: Task) -> Text:
        rate = task.completed / task.elapsed if task.elapsed else 0
        return Text(f"{rate:.0f} frames/s", style="progress.data.speed")
