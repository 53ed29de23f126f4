"""The hidden folder beside an output, in which only one process writes."""

import contextlib
import errno
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

try:
    import fcntl
except ImportError:  # on Windows there is no lock
    fcntl = None  # type: ignore[assignment]

_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.EINVAL, errno.EBADF}
"""What file systems without locks answer."""

UNLOCKED = "its file system has no locks, so nothing kept another process from writing it as well"


def unfinished_folder(output: Path) -> Path:
    """Returns the folder that holds an output until it is complete."""
    return output.with_name(f".{output.name}.unfinished")


def check_folder(path: Path) -> None:
    """Refuses a path that is to be written below something that is not a folder."""
    above = next((folder for folder in path.parents if os.path.lexists(folder)), None)
    if above is not None and not above.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, f"{above} is not a folder", str(path))


@contextlib.contextmanager
def lock_folder(folder: Path, what: Path) -> Iterator[list[str]]:
    """Creates the folder if needed and locks it; the system releases it when a process dies.

    Folders above it are created, too, and removed at the end if they stay empty.

    Yields:
        Remarks for the user: a sentence if there is no lock, else nothing.

    Raises:
        BlockingIOError: another process holds it; the message names `what`.
    """
    missing = [above for above in folder.parents if not above.exists()]
    folder.parent.mkdir(parents=True, exist_ok=True)
    try:
        yield from _locked(folder, what)
    finally:
        for above in missing:
            with contextlib.suppress(OSError):  # it is not empty
                above.rmdir()


def _locked(folder: Path, what: Path) -> Iterator[list[str]]:
    is_still = False
    while True:
        try:
            folder.mkdir(exist_ok=True)
        except FileExistsError as error:
            raise NotADirectoryError(f"{folder}: is not a folder; remove it") from error
        if fcntl is None:
            yield [UNLOCKED]
            return
        handle = os.open(folder, os.O_RDONLY)
        try:
            remarks = _lock(handle, what)
            # Another process may have removed the folder before it was locked.
            with contextlib.suppress(FileNotFoundError):
                is_still = os.path.samestat(folder.stat(), os.fstat(handle))
            if is_still:
                yield remarks
                return
        finally:
            os.close(handle)


def _lock(handle: int, what: Path) -> list[str]:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise BlockingIOError(f"{what}: is being written by another process") from error
    except OSError as error:
        if error.errno in _NO_LOCKS:
            return [UNLOCKED]
        raise
    return []


@contextlib.contextmanager
def working_folder(output: Path) -> Iterator[tuple[Path, list[str]]]:
    """Makes an empty folder in which this process alone makes an output, and removes it at the end.

    It is in the :func:`unfinished_folder`, which is locked meanwhile. What a process that was
    killed has left in it is removed; what an interrupted completion keeps beside it stays.

    Yields:
        The folder, and remarks for the user.

    Raises:
        BlockingIOError: another process is writing the output.
    """
    hidden = unfinished_folder(output)
    with lock_folder(hidden, output) as remarks:
        # Without a lock, another process may be at work in a folder of the same name.
        folder = hidden / (f"part.{os.getpid()}" if remarks else "part")
        try:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            yield folder, remarks
        finally:
            shutil.rmtree(folder, ignore_errors=True)
            with contextlib.suppress(OSError):  # an interrupted completion is kept in it
                hidden.rmdir()
