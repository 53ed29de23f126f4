"""Bars that show how far a long piece of work is, on standard error."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")


@contextmanager
def steps(what: str, progress: bool) -> Iterator[Callable[[int, int], None]]:
    """Shows a bar for work in steps, labelled with what is being done, if `progress` is set.

    Yields:
        A function of the number of steps that are done and of all steps.
    """
    if not progress:
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeRemainingColumn as Remaining

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Remaining())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def tracked(items: Iterable[T], total: int, what: str, progress: bool) -> Iterator[T]:
    """Passes items on, of which there are so many, and shows a bar if `progress` is set."""
    with steps(what, progress) as show:
        for done, item in enumerate(items):
            show(done, total)
            yield item
