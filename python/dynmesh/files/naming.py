"""Errors that name their file."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from .._errors import InputError, KindError, locating


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Adds the file to what is wrong with it: an InputError, or an OSError as it is.

    An array of the wrong kind in a file is not a wrong argument, hence a KindError becomes an
    InputError.
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
