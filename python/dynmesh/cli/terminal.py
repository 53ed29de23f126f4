"""What people see in a terminal: messages and progress, all on standard error."""

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
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

T = TypeVar("T")

_console = Console(stderr=True)


def say(message: str) -> None:
    """Prints a line as it is."""
    _console.print(escape(message), highlight=False, soft_wrap=True)


def say_remarks(output: Path, remarks: Iterable[str]) -> None:
    """Prints what a user should know of a file that was written, a line each."""
    for remark in remarks:
        say(f"{output}: {remark}")


def fail(why: str) -> NoReturn:
    """Ends the program with one line that says what went wrong."""
    _console.print(f"[red]dynmesh:[/red] {escape(why)}", highlight=False, soft_wrap=True)
    sys.exit(1)


def track(
    items: Iterable[T], total: int, what: str, done: int = 0, patience: float = 0
) -> Iterator[T]:
    """Passes items on while a bar shows how many have gone by, and how fast.

    Args:
        items: the last `total - done` of `total` items.
        total: how many there are in all.
        what: is done with them.
        done: how many were done before.
        patience: seconds before there is a bar.
    """
    columns = (
        TextColumn(what),
        BarColumn(),
        MofNCompleteColumn(),
        _FramesPerSecond(),
        TimeRemainingColumn(),
    )
    progress = Progress(*columns, console=_console, disable=not _console.is_terminal)
    task = progress.add_task(what, total=total, completed=done)
    show_at = time.monotonic() + patience
    try:
        if patience == 0:
            progress.start()
        for item in items:
            if time.monotonic() >= show_at:
                progress.start()  # again does nothing
            yield item
            progress.advance(task)
    finally:
        progress.stop()


@contextmanager
def counter(total: int, what: str) -> Iterator[Callable[[], None]]:
    """A bar that goes one step further with each call of what it gives."""
    columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=_console, disable=not _console.is_terminal) as progress:
        task = progress.add_task(what, total=total)
        yield lambda: progress.advance(task)


class WorkBar:
    """A bar for work that is measured in seconds.

    Use it in a ``with`` statement; it is a callback (what is being done, done, in all).
    """

    def __init__(self) -> None:
        """Shows nothing yet."""
        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        self._progress = Progress(*columns, console=_console, disable=not _console.is_terminal)
        self._task = self._progress.add_task("beginning", total=None)

    def __enter__(self) -> "WorkBar":
        """Begins."""
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Ends."""
        self._progress.stop()

    def __call__(self, what: str, done: float, whole: float) -> None:
        """Shows how far the work is, and at the beginning how long it will take."""
        if done == 0:
            say(f"This takes about {_in_words(whole)}.")
        self._progress.update(self._task, description=what, completed=done, total=whole)


def _in_words(seconds: float) -> str:
    return f"{seconds:.0f} seconds" if seconds < 90 else f"{seconds / 60:.0f} minutes"


class _FramesPerSecond(ProgressColumn):
    def render(self, task: Task) -> Text:
        rate = task.completed / task.elapsed if task.elapsed else 0
        return Text(f"{rate:.0f} frames/s", style="progress.data.speed")
