"""The state that an interrupted run leaves beside its unfinished files."""

import json
import time
import zipfile
import zlib
from collections.abc import Iterable
from itertools import zip_longest
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from .._core import __version__
from ..files import Header, PathLike
from ..settings import SETTINGS, Settings


class Source(TypedDict, total=False):
    """How to read the input; :func:`dynmesh.open` documents the keywords."""

    format: str | None
    faces: NDArray[np.integer[Any]] | PathLike | None
    prim: str | None
    known: NDArray[np.bool_] | PathLike | None
    missing: Literal["zero"] | None
    gaps: Literal["refuse", "lost"]


class OtherJobError(ValueError):
    """The unfinished files belong to a job that differs from the one to be resumed."""


class Progress(NamedTuple):
    """How far a job is.

    Attributes:
        done: number of frames that were completed, forwards or backwards.
        written: number of frames in the output.
        state: the completer's state after the last frame; empty if nothing was done.
    """

    done: int = 0
    written: int = 0
    state: bytes = b""


BEGINNING = Progress()
"""Of a job that has done nothing."""


_DAMAGE = (ValueError, EOFError, KeyError, zipfile.BadZipFile)


class Checkpoint:
    """A file, beside the unfinished files, from which the same job can be continued."""

    least_seconds_between = 2.0
    most_of_the_time = 0.05

    def __init__(self, path: Path, job: str) -> None:
        """Does not access the file yet; `job` is the result of :func:`describe_job`."""
        self._path = path
        self._job = job
        self._next = time.monotonic() + self.least_seconds_between

    def load(self) -> Progress | None:
        """Returns what an earlier run of this job saved, or None."""
        try:
            with np.load(self._path, allow_pickle=False) as saved:
                job, state = str(saved["job"]), saved["state"].tobytes()
                progress = Progress(int(saved["done"]), int(saved["written"]), state)
        except FileNotFoundError:
            return None
        except _DAMAGE as error:
            raise ValueError(
                f"{self._path}: is damaged; run without --resume to start again"
            ) from error
        if job != self._job:
            changed = "; ".join(_differences(json.loads(job), json.loads(self._job)))
            raise OtherJobError(
                f"{self._path}: is of another job: {changed}; run without --resume to start again, "
                "or write another output"
            )
        return progress

    def exists(self) -> bool:
        """Whether there is a checkpoint, of any job."""
        return self._path.exists()

    def is_of_this_job(self) -> bool:
        """Whether there is a checkpoint of this job."""
        try:
            return self.load() is not None
        except ValueError:  # of another job, or damaged
            return False

    def has_only_begun(self) -> bool:
        """Whether there is a checkpoint, of any job, before the first written frame."""
        try:
            with np.load(self._path, allow_pickle=False) as saved:
                return int(saved["written"]) == 0
        except (*_DAMAGE, FileNotFoundError):
            return False

    def is_due(self) -> bool:
        """Whether enough time has passed to save again."""
        return time.monotonic() >= self._next

    def save(self, progress: Progress) -> None:
        """Replaces the checkpoint atomically."""
        began = time.monotonic()
        partial = self._path.with_suffix(".part")
        done, written, state = progress
        with partial.open("wb") as file:
            state_bytes = np.frombuffer(state, np.uint8)
            np.savez(file, job=self._job, done=done, written=written, state=state_bytes)
        partial.replace(self._path)
        now = time.monotonic()
        pause = (now - began) / self.most_of_the_time
        self._next = now + max(self.least_seconds_between, pause)


def describe_job(
    inputs: Iterable[Path],
    header: Header,
    source: Source,
    start: dict[str, Any],
    format: str,
    settings: Settings,
) -> str:
    """Everything on which the output depends, as JSON. All settings must be given.

    `inputs` are the files that are read; `start` describes the beginning and the rehearsal.
    """
    masks = source.get("known")
    description: dict[str, Any] = {
        "version": __version__,
        "input": list(map(identity, inputs)),
        **start,
        "known": zlib.crc32(masks.tobytes()) if isinstance(masks, np.ndarray) else None,
        "faces": zlib.crc32(header.faces.tobytes()),
        "missing": source.get("missing"),
        "gaps": source.get("gaps", "refuse"),
        "prim": header.name,
        "fps": header.fps,
        "provenance": header.has_provenance,
        "format": format,
        **{name: value for name, value in settings.items() if SETTINGS[name].changes_results},
    }
    return json.dumps(description)


def identity(file: Path) -> list[Any]:
    """What changes when a file is replaced or written again."""
    found = file.stat()
    return [str(file.absolute()), found.st_size, found.st_mtime_ns]


def _differences(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """Names what differs, with values except for masks and faces, which are digests."""
    told = []
    for name in sorted(one.keys() | other.keys()):
        before, now = one.get(name), other.get(name)
        if before == now:
            continue
        if name in ("known", "faces"):
            told.append(f"{name} changed")
        elif name in ("input", "cameras", "template", "rehearsal"):
            told.append(_changed_files(name, before or [], now or []))
        else:
            told.append(changed(name, before, now))
    return told


def _changed_files(name: str, before: list[list[Any]], now: list[list[Any]]) -> str:
    """Says which is the first of the files that differs; their order matters."""
    pairs = zip_longest(before, now, fillvalue=[None])
    (was, *_), (is_now, *_) = next(pair for pair in pairs if pair[0] != pair[1])
    if was == is_now:
        return f"{name} changed ({was} was written again)"
    alike = len(before) == len(now) or not before or not now
    numbers = "" if alike else f"; {len(before)} files, now {len(now)}"
    return f"{name} changed (it was {_shown(was)}, now it is {_shown(is_now)}{numbers})"


def changed(name: str, before: object, now: object) -> str:
    """Says that an option of a job differs."""
    return f"{name} changed (it was {_shown(before)}, now it is {_shown(now)})"


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return "not given" if value is None else str(value)
