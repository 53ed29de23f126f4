"""Ctrl+C at a moment when nothing is lost."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def holding_interrupts() -> Iterator[Callable[[], bool]]:
    """Lets the first Ctrl+C wait until the end of the block; a second one acts at once.

    Nothing waits in a thread other than the main one, which hears no signals, and in programs that
    handle or ignore Ctrl+C themselves.

    Yields:
        A function that tells whether one waits, so that the block should end soon.

    Raises:
        KeyboardInterrupt: at the end of the block, if one waits.
    """
    waits = False

    def hold(number: int, frame: FrameType | None) -> None:  # noqa: ARG001
        nonlocal waits
        signal.signal(signal.SIGINT, signal.default_int_handler)
        waits = True

    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        yield lambda: False
        return
    signal.signal(signal.SIGINT, hold)
    try:
        yield lambda: waits
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if waits:  # even after an error, as it would be lost otherwise
            raise KeyboardInterrupt
