"""One process at a time in a folder."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: nothing keeps two processes apart
    fcntl = None  # type: ignore[assignment]


@contextlib.contextmanager
def lock_folder(folder: Path, what: Path) -> Iterator[None]:
    """Makes the folder if need be and holds it; the system lets go of it when a process dies.

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
            # Between making and locking it, another process may have ended and removed it.
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
