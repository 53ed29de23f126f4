"""Adds the name of the file to error messages."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from .._errors import DynmeshError, InputError, KindError, locating
from ..sequence import Description


@contextlib.contextmanager
def numbering(path: Path, description: Description) -> Iterator[None]:
    """Adds the name of the file to errors, and calls frames that they count from 0 as it does."""
    try:
        with locating(file=None):
            yield
    except DynmeshError as error:
        if error.file is None:
            error.file = path
            if error.frame is not None:
                error.frame = description.number(int(error.frame))
        raise


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
