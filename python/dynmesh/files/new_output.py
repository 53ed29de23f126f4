"""A file that is not a sequence, such as a page, and appears under its name when it is complete."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .lock import check_folder, unfinished_folder, working_folder


def exists_already(path: Path, replaced: str = "it") -> FileExistsError:
    """The error for a file that stays unless `overwrite` is set, which replaces what is named."""
    return FileExistsError(
        f"{path}: exists already; --overwrite replaces {replaced}, in Python overwrite=True"
    )


def check_output(path: Path, overwrite: bool, *suffixes: str) -> None:
    """Refuses a path that such a file cannot be written to.

    Raises:
        OSError: it would be in a file, or the file exists and `overwrite` is not set.
        ValueError: the path has none of these suffixes.
    """
    if path.suffix.lower() not in suffixes:
        *others, last = suffixes
        expected = f"{', '.join(others)} or {last}" if others else last
        raise ValueError(f"{path}: must end in {expected}")
    check_folder(path)
    if path.exists() and not overwrite:
        raise exists_already(path)


@contextmanager
def new_output(path: Path, overwrite: bool, *suffixes: str) -> Iterator[tuple[Path, list[str]]]:
    """Checks a path, and yields a hidden one to write to, which becomes it at the end.

    Yields:
        The hidden path, and remarks for the user.
    """
    check_output(path, overwrite, *suffixes)
    try:
        with working_folder(path) as (folder, remarks):
            yield folder / path.name, remarks
            check_output(path, overwrite, *suffixes)  # another process may have written it
            (folder / path.name).replace(path)
    except OSError as error:
        file = "" if error.filename is None else str(error.filename)
        if error.errno is None or not Path(file).is_relative_to(unfinished_folder(path)):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
