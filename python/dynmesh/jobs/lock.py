"""A lock that lets only one process write to a folder."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

try:
    import fcntl
except ImportError:  # on Windows there is no lock
    fcntl = None  # type: ignore[assignment]


@contextlib.contextmanager
def lock_folder(folder: Path, what: Path) -> Iterator[None]:
    """Creates the folder if needed and locks it; the system releases it when a process dies.

    Raises:
        BlockingIOError: another process holds it; the message names `what`.
    """
    if fcntl is None:
        folder.mkdir(exist_ok=True)
        yield
        return
    while True:
        folder.mkdir(exist_ok=True)
        handle = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Another process may have removed the folder before it was locked.
            if _is_still(folder, handle):
                yield
                return
        except BlockingIOError as error:
            raise BlockingIOError(f"{what}: is being written by another process") from error
        finally:
            os.close(handle)


def _is_still(folder: Path, handle: int) -> bool:
    try:
        return os.path.samestat(folder.stat(), os.fstat(handle))
    except FileNotFoundError:
        return False
