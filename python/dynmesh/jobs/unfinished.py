"""The hidden folder beside an output that holds it until it is complete."""

import contextlib
import shutil
from collections.abc import Iterator
from pathlib import Path

from ..files import CannotResumeError, Target
from ..files.lock import lock_folder, unfinished_folder
from .checkpoint import Checkpoint


def settle(folder: Path, target: Target, n_frames: int, checkpoint: Checkpoint) -> bool:
    """Finishes a run that was killed while it moved its files; returns whether it was this job.

    Args:
        folder: exists and holds the unfinished output.
        target: the output.
        n_frames: the number of its frames.
        checkpoint: of this job.

    Raises:
        CannotResumeError: what is in the folder is damaged or of another version.
    """
    if not folder.is_dir():
        raise CannotResumeError("is not a folder", file=folder)
    with lock_folder(folder, target.path):
        if target.finish_placing(folder / "files"):
            same = checkpoint.is_of_this_job()  # saved before the files were moved
            _clear(folder)
            return same
        saved = checkpoint.read()
        # Killed after that, before the checkpoint was removed.
        placed = saved is not None and saved.progress.written == n_frames
        placed = placed and not list((folder / "files").glob("*"))
        if placed or saved is None:
            _clear(folder)
        return placed and saved is not None and saved.job == checkpoint.job


def set_aside(folder: Path, output: Path, why: str) -> str:
    """Moves what cannot be continued out of the way, and returns a sentence that says so.

    It is kept, as it may be of use to someone, until the next one takes its place.
    """
    aside = folder.with_name(f".{output.name}.set-aside")
    lock = lock_folder(folder, output) if folder.is_dir() else contextlib.nullcontext()
    with lock:
        if aside.is_dir() and not aside.is_symlink():
            shutil.rmtree(aside)
        else:
            aside.unlink(missing_ok=True)
        folder.rename(aside)
    return f"the unfinished output cannot be continued and was moved to {aside}: {why}"


def _clear(folder: Path) -> None:
    """Removes an unfinished folder, the checkpoint first, so that no run can resume from it."""
    (folder / "checkpoint.npz").unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)


def is_unfinished(output: Path) -> bool:
    """Whether an interrupted run left a checkpoint that `resume` can use, if it is of the job."""
    try:
        return Checkpoint(unfinished_folder(output) / "checkpoint.npz", "").read() is not None
    except (CannotResumeError, OSError):
        return False


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
    except CannotResumeError:  # nothing was changed
        raise
    except (ValueError, TypeError):  # resuming would fail again
        _clear(folder)
        raise
    except BaseException:
        if not (folder / "checkpoint.npz").exists():
            _clear(folder)
        raise
    _clear(folder)
