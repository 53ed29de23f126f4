"""Adds the name of the file to error messages."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from .._checks import SettingError


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Prefixes the messages of ValueErrors with the name of the file; OSErrors have it already.

    Refused settings are not prefixed, as they do not depend on the file.
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
