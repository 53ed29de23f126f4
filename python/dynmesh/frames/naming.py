"""Adds the name of the file to error messages."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from .._errors import InputError, KindError, locating


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
