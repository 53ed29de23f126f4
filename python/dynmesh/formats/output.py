"""How an output appears under its name only when it is complete.

It is made in a hidden folder beside it, which one process holds locked. Whatever ends a run, the
older output is whole until the new one takes its place, and nothing else is left but the hidden
folder. The next run to the same output removes it. Of several files, what is there while they are
moved is a beginning of the new or of the older ones, and never a mixture.
"""

import errno
import os
import shutil
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from .._errors import InputError
from .._report import listed, warn
from ..header import ATTRIBUTES, Header

NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP}
"""What disks that have no locks answer, such as those of some networks and containers."""
_MOST_ATTEMPTS = 1000
"""Of locking a folder that other processes keep removing."""


def unfinished_folder(output: Path) -> Path:
    """Returns the folder in which an output is made."""
    return output.with_name(f".{output.name}.unfinished")


def destination_of(path: Path) -> Path:
    """Where a file belongs that is made in the folder that :func:`making` yields."""
    return path.parent.parent.with_name(path.name)


@contextmanager
def making(output: Path) -> Iterator[Path]:
    """Yields an empty hidden folder, in which this process alone makes an output.

    Folders above it are created, too, and removed at the end if they stay empty.
    """
    from filelock import BaseFileLock, FileLock, SoftFileLock, Timeout  # takes a while

    hidden = unfinished_folder(output)
    missing = [above for above in hidden.parents if not above.exists()]
    how: dict[str, Any] = {"blocking": False, "thread_local": False}
    lock: BaseFileLock = FileLock(hidden / "lock", fallback_to_soft=False, **how)
    attempts = 0
    while not lock.is_locked:
        attempts += 1
        try:
            _make_folder(hidden)
            lock.acquire()
        except FileNotFoundError:  # the process that had it has just removed it
            if attempts == _MOST_ATTEMPTS:
                raise
        except Timeout:
            if Path(lock.lock_file).exists() or attempts == _MOST_ATTEMPTS:
                raise BlockingIOError(f"{output}: is being written by another process") from None
        except OSError as error:
            if error.errno not in NO_LOCKS:
                raise
            warn(f"{output}: its disk has no locks ({error.strerror}); a lock file stands in")
            lock = SoftFileLock(hidden / "lock_file", **how)
    try:
        _clear(hidden)
        folder = hidden / "new"
        folder.mkdir()
        yield folder
    finally:
        with suppress(OSError):
            _clear(hidden)
        with suppress(OSError):  # Windows keeps a file that is open
            (hidden / "lock").unlink()
        lock.release()
        for above in (hidden, *missing):
            with suppress(OSError):  # it is not empty
                above.rmdir()


def _make_folder(hidden: Path) -> None:
    """Makes a folder that may be there, which another process may remove at any time."""
    hidden.parent.mkdir(parents=True, exist_ok=True)
    try:
        hidden.mkdir()
    except FileExistsError:
        if not stat.S_ISDIR(hidden.lstat().st_mode):
            raise NotADirectoryError(f"{hidden}: is not a folder; remove it") from None


def _clear(hidden: Path) -> None:
    for name in ("new", "aside"):
        shutil.rmtree(hidden / name, ignore_errors=True)


def move(places: Mapping[Path, Path], outdated: Iterable[Path]) -> None:
    """Moves files to their places, where they get the modes of those that they replace.

    Of one file, this is atomic. If there are several, those that they replace and those that are
    outdated are put aside first, starting with the last. All are put back if one cannot be moved.
    """
    new, older = [*places.values()], [*outdated]
    if older or len(new) > 1:
        older = [*reversed(new), *older]
    aside = next(iter(places)).parent.with_name("aside")
    aside.mkdir()
    moved: list[tuple[Path, Path]] = []
    try:
        for file, place in places.items():
            with suppress(FileNotFoundError):
                shutil.copymode(place, file)
        for number, file in enumerate(older):
            if file.exists():
                moved.append((file, aside / f"{number}"))
                file.replace(moved[-1][1])
        for file, place in places.items():
            moved.append((file, place))
            file.replace(place)
    except BaseException:
        for file, place in reversed(moved):
            if not file.exists():  # else it is the one that could not be moved
                place.replace(file)
        raise


def seen_from(folder: Path, file: Path) -> str:
    """Names a file relative to a folder in which a file that refers to it is made."""
    try:  # without following links, as USD does
        return f"./{Path(os.path.relpath(file, folder)).as_posix()}"
    except ValueError:  # on another drive of Windows
        return file.absolute().as_posix()


def check_folder(path: Path) -> None:
    """Refuses a path that is to be written below something that is not a folder."""
    above = next((folder for folder in path.parents if os.path.lexists(folder)), None)
    if above is not None and not above.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, f"{above} is not a folder", str(path))


def refuse_existing(path: Path, overwrite: bool) -> None:
    """Refuses a path at which a file may not be made."""
    if not os.path.lexists(path):
        return
    mode = path.lstat().st_mode
    if stat.S_ISLNK(mode):
        raise FileExistsError(f"{path}: is a symbolic link; name the file to which it leads")
    if not stat.S_ISREG(mode):
        raise FileExistsError(f"{path}: is no file but a folder, a device or a pipe")
    if not overwrite:
        raise FileExistsError(f"{path}: exists already; `overwrite` replaces it")
    if not mode & 0o222:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))


def refuse_inputs(existing: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Refuses to replace one of the files that are read, whichever path names it."""
    read = set(map(identity, inputs))
    for file in existing:
        if file.exists() and identity(file) in read:
            raise InputError("is the input; writing over it would lose it", file=file)


def identity(file: Path) -> tuple[int, int]:
    """Identifies a file, whichever path names it."""
    result = file.stat()
    return result.st_dev, result.st_ino


def check_output(path: Path, overwrite: bool, *suffixes: str, inputs: Iterable[Path] = ()) -> None:
    """Refuses a path that a file that is not a sequence, such as a page, cannot be written to."""
    if suffixes and path.suffix.lower() not in suffixes:
        raise InputError(f"{path}: must end in {listed(suffixes, 'or')}")
    check_folder(path)
    refuse_inputs([path], inputs)
    refuse_existing(path, overwrite)


@contextmanager
def new_output(
    path: Path, overwrite: bool, *suffixes: str, inputs: Iterable[Path] = ()
) -> Iterator[Path]:
    """Checks the path of such a file, and yields a hidden one, which becomes it at the end."""
    check_output(path, overwrite, *suffixes, inputs=inputs)
    with blaming(path, path), making(path) as folder:
        yield folder / path.name
        check_output(path, overwrite, *suffixes)  # another process may have written it
        move({folder / path.name: path}, [])


@contextmanager
def new_folder(path: Path, overwrite: bool, is_ours: Callable[[Path], bool]) -> Iterator[Path]:
    """Yields a hidden folder, whose files take the place of those of a folder.

    That is new, empty or, with `overwrite`, holds nothing but files that are ours.
    """
    inside = path / "scans"

    def check() -> None:
        check_folder(path)
        if os.path.lexists(path) and not path.is_dir():
            raise FileExistsError(f"{path}: exists already")
        older = [file for file in path.glob("*") if file != unfinished_folder(inside)]
        for file in sorted(older, key=is_ours):
            if not is_ours(file):
                raise FileExistsError(f"{file}: exists already, and would not be replaced")
            refuse_existing(file, overwrite)

    check()
    with blaming(path, inside), making(inside) as hidden:
        yield hidden
        check()  # another process may have written it
        places = {file: path / file.name for file in sorted(hidden.iterdir())}
        move(places, {*filter(is_ours, path.glob("*"))} - {*places.values()})


@contextmanager
def blaming(path: Path, output: Path) -> Iterator[None]:
    """Names a path in errors of the system, unless they name another file than a hidden one."""
    try:
        yield
    except OSError as error:
        if error.errno is None:
            if isinstance(error, BlockingIOError | FileExistsError):
                raise  # from here, and names the file
            raise OSError(f"{path}: {str(error).splitlines()[0]}") from error
        named, hidden = error.filename, unfinished_folder(output)
        if named is not None and not Path(str(named)).is_relative_to(hidden):
            raise
        raise OSError(error.errno, os.strerror(error.errno), str(path)) from error


def bytes_of(header: Header) -> int:
    """Returns the least number of bytes that the frames of a sequence take in a file."""
    of_position = 12  # at least, in every format
    of_vertex = of_position + sum(ATTRIBUTES[name].dtype.itemsize for name in header.attributes)
    return header.n_frames * header.n_vertices * of_vertex


def check_space(folder: Path, needed: int) -> None:
    """Refuses an output that the disk of the folder in which it is made has no space for."""
    left = shutil.disk_usage(folder).free
    if needed > left:
        raise OSError(
            f"needs at least {needed / 1e9:.2g} GB, but its disk has {left / 1e9:.2g} GB left"
        )
