"""A file that is not a sequence, such as a page, and appears under its name when it is complete."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .lock import unfinished_folder, working_folder


def check_output(path: Path, overwrite: bool, suffix: str) -> None:
    """Refuses a path that such a file cannot be written to.

    Raises:
        OSError: there is no such folder, or the file exists and `overwrite` is not set.
        ValueError: the path has another suffix.
    """
    if path.suffix.lower() != suffix:
        raise ValueError(f"{path}: must end in {suffix}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: there is no folder {path.parent}")
    if path.exists() and not overwrite:
        raise FileExistsError(f"{path}: exists already; --overwrite replaces it")


@contextmanager
def new_output(path: Path, overwrite: bool, suffix: str) -> Iterator[tuple[Path, list[str]]]:
    """Checks a path, and yields a hidden one to write to, which becomes it at the end.

    Yields:
        The hidden path, and remarks for the user.
    """
    check_output(path, overwrite, suffix)
    try:
        with working_folder(path) as (folder, remarks):
            yield folder / path.name, remarks
            check_output(path, overwrite, suffix)  # another process may have written it
            (folder / path.name).replace(path)
    except OSError as error:
        file = "" if error.filename is None else str(error.filename)
        if error.errno is None or not Path(file).is_relative_to(unfinished_folder(path)):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
