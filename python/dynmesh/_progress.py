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
    if not is_terminal:
        with _lines(what) as show:
            yield show
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


def tracked(items: Iterable[T], total: int, what: str, progress: bool | None) -> Iterator[T]:
    """Passes items on, of which there are so many, and shows how far that is, as `steps` does."""
    with steps(what, progress) as show:
        for done, item in enumerate(items):
            show(done, total)
            yield item
