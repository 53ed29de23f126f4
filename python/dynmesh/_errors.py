"""Errors that know which argument, value, frame and file they are about; missing libraries."""

import contextlib
import errno
import os
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType


class DynmeshError(Exception):
    """What is wrong with an input, and where. Every instance is a ValueError or a TypeError.

    Attributes:
        reason: what is wrong, in one sentence, without the place.
        argument: the name of the argument at fault, or None.
        value: what was given, or None.
        file: the file at fault, or None.
        frame: the number of the frame at fault, in its file if it has one, or None.
    """

    def __init__(
        self,
        reason: str,
        *,
        argument: str | None = None,
        value: object = None,
        file: Path | None = None,
        frame: float | None = None,
    ) -> None:
        super().__init__(reason)
        self.reason = reason
        self.argument = argument
        self.value = value
        self.file = file
        self.frame = frame

    def __str__(self) -> str:
        """Joins the place and the reason, as "a.npz: frame 3: points: must be float32"."""
        return self.told(self.argument)

    def told(self, argument: str | None) -> str:
        """Joins them with another spelling of the argument, as an option or a column."""
        frame = None if self.frame is None else f"frame {self.frame}"
        place = [str(part) for part in (self.file, frame, argument) if part is not None]
        return ": ".join([*place, self.reason])


class InputError(DynmeshError, ValueError):
    """An input of the right kind that cannot be used."""


class KindError(DynmeshError, TypeError):
    """An input of the wrong kind."""


class SettingError(InputError):
    """A setting that is refused; `argument` is its name."""


def in_one_line(error: Exception) -> str:
    """Returns what an error says, for a list of errors."""
    if isinstance(error, OSError) and error.filename:
        return f"{error.filename}: {error.strerror}"
    lines = str(error).splitlines()
    return lines[0] if lines else type(error).__name__


@contextlib.contextmanager
def locating(*, frame: float | None = None, file: Path | None = None) -> Iterator[None]:
    """Adds the frame and the file to errors of dynmesh that do not know theirs yet.

    SettingErrors are about no frame and no file, and pass unchanged.
    """
    try:
        yield
    except SettingError:
        raise
    except DynmeshError as error:
        error.frame = frame if error.frame is None else error.frame
        error.file = file if error.file is None else error.file
        raise


@contextlib.contextmanager
def within(place: str) -> Iterator[None]:
    """Puts a place in a file, such as a field, before what errors of dynmesh say."""
    try:
        yield
    except DynmeshError as error:
        raise InputError(f"{place}: {error}") from error


@contextlib.contextmanager
def numbering(path: Path, number: Callable[[int], float]) -> Iterator[None]:
    """Adds the name of the file to errors, and calls frames that they count from 0 as it does.

    The function returns the number of such a frame in the file.
    """
    try:
        with locating(file=None):
            yield
    except DynmeshError as error:
        if error.file is None:
            error.file = path
            if error.frame is not None:
                error.frame = number(int(error.frame))
        raise


@contextlib.contextmanager
def of_library(tried: str, kind: type[Exception] = InputError) -> Iterator[None]:
    """Raises whatever a library raises as one error, of what was tried and in the library's words.

    Errors of dynmesh itself, of missing libraries and of the system pass.
    """
    try:
        yield
    except (DynmeshError, ImportError):
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno and error.errno != errno.EINVAL:
            if error.filename is not None:
                raise
            raise OSError(error.errno, os.strerror(error.errno)) from error  # which is one line
        message = _words_of(error)
        lines = [" ".join(line.split()) for line in message.splitlines() if line.strip()]
        if not isinstance(error, ValueError | OSError | RuntimeError):
            lines = [": ".join([type(error).__name__, *lines[-1:]])]
        raise kind(f"{tried}: {lines[-1] if lines else type(error).__name__}") from error


def _words_of(error: Exception) -> str:
    try:
        return str(getattr(error.args[0] if error.args else None, "commentary", error))  # of USD
    except UnicodeDecodeError:  # words of the damaged file are in it
        return "its text is damaged"


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Adds the name of the file to an InputError; an OSError has it already.

    A KindError becomes an InputError, since an array of the wrong kind in a file is not an argument
    of the wrong kind.
    """
    try:
        with locating(file=path):
            yield
    except KindError as error:
        raise InputError(
            error.reason, argument=error.argument, frame=error.frame, file=error.file
        ) from error
    except EOFError as error:
        raise InputError(str(error), file=path) from error
    except OSError as error:
        if error.filename is not None or error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


class MissingLibraryError(ImportError):
    """An optional library is not installed."""


def require_all(*modules: str, extra: str) -> None:
    """Imports modules early, so that a missing one is reported before any work begins."""
    for module in modules:
        require(module, extra=extra)


def require(module: str, *, extra: str) -> ModuleType:
    """Imports `module`, or raises an error that names the extra which installs it."""
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        message = f"this needs {package}: pip install 'dynmesh[{extra}]'"
        raise MissingLibraryError(message) from error
