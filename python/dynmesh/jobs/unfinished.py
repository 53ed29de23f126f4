"""What is hidden beside an output: a folder until it is complete, and then whether to doubt it."""

import contextlib
import json
import shutil
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from .._core import __version__
from ..files import CannotResumeError, Target
from ..files.lock import lock_folder, unfinished_folder
from .checkpoint import Checkpoint, identity


def settle(folder: Path, target: Target, n_frames: int, checkpoint: Checkpoint) -> bool:
    """Finishes a run that was killed while it moved its files; returns whether it was this job.

    What was known of the result is remembered.

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
            try:
                saved = checkpoint.read()  # saved before the files were moved
            except CannotResumeError:
                saved = None
            placed = True
        else:
            saved = checkpoint.read()
            # Killed after that, before the checkpoint was removed.
            placed = saved is not None and saved.progress.written == n_frames
            placed = placed and not list((folder / "files").glob("*"))
        if placed and saved is not None:
            remember(target, saved.progress.judged)
        if placed or saved is None:
            _clear(folder)
        return placed and saved is not None and saved.job == checkpoint.job


def remember(target: Target, judged: Mapping[str, Any]) -> None:
    """Keeps beside a complete output why it is doubtful, or removes what was kept of an older one.

    Most formats cannot hold it.
    """
    file = _doubts(target)
    if judged.get("doubtful"):
        file.write_text(json.dumps({"output": _identity(target), "judged": dict(judged)}))
    else:
        file.unlink(missing_ok=True)


def remembered(target: Target) -> Mapping[str, Any]:
    """Returns what was kept, nothing if the output was changed since."""
    try:
        kept = json.loads(_doubts(target).read_text())
        return dict(kept["judged"]) if kept["output"] == _identity(target) else {}
    except (OSError, ValueError, TypeError, LookupError):
        return {}


def _doubts(target: Target) -> Path:
    return target.path.with_name(f".{target.path.name}.doubtful")


def _identity(target: Target) -> list[Any]:
    """What changes when the output or dynmesh does, but not when all files are moved elsewhere."""
    found = [(file.name, *identity(file)[1:]) for file in sorted(target.existing())]
    return [__version__, len(found), zlib.crc32(json.dumps(found).encode())]


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


def frames_kept(output: Path) -> int:
    """The frames in the checkpoint of an interrupted run, which `resume` can use if it is its."""
    try:
        saved = Checkpoint(unfinished_folder(output) / "checkpoint.npz", "").read()
    except (CannotResumeError, OSError):
        return 0
    return 0 if saved is None else saved.progress.done


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
