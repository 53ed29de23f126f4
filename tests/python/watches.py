"""Watches of frames that are interrupted."""

from collections.abc import Callable, Iterator
from typing import Any


def interrupted_after(
    n: int, error: BaseException | None = None, *, of: int | None = None
) -> Callable[..., Iterator[Any]]:
    """Passes n frames on, then raises an error: by default what Ctrl+C raises.

    Args:
        n: counted from the beginning of the work, also if it continues.
        error: of the user or the system.
        of: the number of frames that the watch must be told.
    """

    def watch(frames: Iterator[Any], whole: int = 0, done: int = 0) -> Iterator[Any]:
        assert of in (None, whole)
        for number, frame in enumerate(frames, done):
            if number == n:
                raise error or KeyboardInterrupt
            yield frame

    return watch
