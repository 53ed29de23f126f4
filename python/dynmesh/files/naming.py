"""Errors that name their file."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from .._checks import SettingError


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Puts the file's name before what is wrong with it: a ValueError, or an OSError as it is.

    A setting that is refused has nothing to do with the file.
    """
    try:
        yield
    except SettingError:
        raise
    except (ValueError, TypeError, EOFError) as error:
        if str(error).startswith(f"{path}: "):
            raise
        raise ValueError(f"{path}: {error}") from error
    except OSError as error:
        if error.filename is not None or error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
