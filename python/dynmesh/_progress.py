"""How far a long piece of work is, on standard error: a bar, or else lines without a terminal."""

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import TypeVar

T = TypeVar("T")

INTERVAL = 10.0
"""Seconds between the lines."""


@contextmanager
def steps(what: str, progress: bool) -> Iterator[Callable[[int, int], None]]:
    """Shows work in steps, labelled with what is being done, if `progress` is set.

    Yields:
        A function of the number of steps that are done and of all steps.
    """
    if not progress or sys.stderr is None:  # which a service may lack
        yield lambda *_: None
        return
    if not sys.stderr.isatty():
        with _lines(what) as show:
            yield show
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeRemainingColumn as Remaining

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Remaining())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def _lines(what: str) -> Iterator[Callable[[int, int], None]]:
    """Prints a line at intervals, also while a single step takes long."""
    began, at, ended = time.monotonic(), "", threading.Event()

    def show(done: int, total: int) -> None:
        nonlocal at
        at = f", {done} of {total}"

    def tell() -> None:
        while not ended.wait(INTERVAL):
            with suppress(OSError):  # a full disk
                print(f"{what}{at}, {time.monotonic() - began:.0f} s", file=sys.stderr, flush=True)

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield show
    finally:
        ended.set()
        teller.join()


def tracked(items: Iterable[T], total: int, what: str, progress: bool) -> Iterator[T]:
    """Passes items on, of which there are so many, and shows how far that is, as `steps` does."""
    with steps(what, progress) as show:
        for done, item in enumerate(items):
            show(done, total)
            yield item
