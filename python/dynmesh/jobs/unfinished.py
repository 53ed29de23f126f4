"""The hidden folder beside an output that holds it until it is complete."""

import contextlib
import shutil
from collections.abc import Iterator
from pathlib import Path

from .. import files
from ..files import Target
from ..files.lock import lock_folder, unfinished_folder
from .checkpoint import Checkpoint


def settle(folder: Path, output: Path, checkpoint: Checkpoint) -> bool:
    """Finishes a run that was killed while it moved its files; returns whether it was this job."""
    if not folder.exists():
        return False
    with lock_folder(folder, output):
        # While frames are completed backwards, nothing is written, which would look like placed.
        placed = not checkpoint.has_only_begun() and files.finish_placing(folder / "files")
        same = placed and checkpoint.is_of_this_job()  # saved before the files were moved
        if placed or not checkpoint.exists():
            _clear(folder)
    return same


def _clear(folder: Path) -> None:
    """Removes an unfinished folder, the checkpoint first, so that no run can resume from it."""
    (folder / "checkpoint.npz").unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)


def is_unfinished(output: Path) -> bool:
    """Whether an interrupted run left a checkpoint that `resume` can use."""
    return (unfinished_folder(output) / "checkpoint.npz").exists()


@contextlib.contextmanager
def folder_for(target: Target) -> Iterator[None]:
    """Creates the folder of an output if it needs one, and removes it if it stays empty."""
    new = target.new_folder()
    if new is not None:
        new.mkdir()
    try:
        yield
    finally:
        if new is not None:
            with contextlib.suppress(OSError):  # the folder is not empty
                new.rmdir()


@contextlib.contextmanager
def clearing(folder: Path) -> Iterator[None]:
    """Removes the unfinished folder, unless an interruption left a checkpoint in it."""
    try:
        yield
    except (ValueError, TypeError):  # resuming would fail again
        _clear(folder)
        raise
    except BaseException:
        if not (folder / "checkpoint.npz").exists():
            _clear(folder)
        raise
    _clear(folder)
