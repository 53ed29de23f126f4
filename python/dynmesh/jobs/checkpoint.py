"""The state that an interrupted run leaves beside its unfinished files."""

import json
import time
import zipfile
import zlib
from collections.abc import Collection, Iterable, Mapping
from itertools import zip_longest
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from .._core import Completer, Tracker, __version__
from ..files import CannotResumeError, Header, Pieces, check_unchanged, naming
from ..files.npz import check_members, explaining, read_member


class OtherJobError(ValueError):
    """The unfinished files belong to a job that differs from the one to be resumed."""


class Progress(NamedTuple):
    """How far a job is.

    Attributes:
        done: number of frames that were completed, forwards or backwards.
        written: number of frames in the output.
        state: the completer's state after the last frame; empty if nothing was done.
        kept: checksums of the files that hold the frames, relative to the unfinished folder.
        judged: what is known of the quality of the result, as JSON has it; "doubtful" says in a
            sentence why it is probably wrong, and is empty or missing if it is not.
    """

    done: int = 0
    written: int = 0
    state: bytes = b""
    kept: Pieces = MappingProxyType({})
    judged: Mapping[str, Any] = MappingProxyType({})

    def restore(self, machine: Completer | Tracker, pushed: Collection[int]) -> None:
        """Continues the completer, which must have met as many frames as one of `pushed`.

        Raises:
            CannotResumeError: the state is of no such completer.
        """
        if not self.done:
            return
        try:
            machine.restore(self.state)
        except ValueError as error:
            raise CannotResumeError(f"its state cannot be restored: {error}") from error
        if machine.n_frames not in pushed:
            raise CannotResumeError(
                f"{self.done} frames are done, but its state is that after {machine.n_frames}"
            )

    def check(self, n_frames: int, written: Collection[int]) -> None:
        """Refuses what a job of so many frames, after those that are done, cannot have written."""
        if self.done > n_frames:
            raise CannotResumeError(f"{self.done} of {n_frames} frames are done")
        if self.written not in written:
            raise CannotResumeError(f"{self.done} frames are done, but {self.written} written")


BEGINNING = Progress()
"""Of a job that has done nothing."""


class Saved(NamedTuple):
    """The content of a checkpoint: the result of :func:`describe_job`, and how far it is."""

    job: str
    progress: Progress


class Checkpoint:
    """A file, beside the unfinished files, from which the same job can be continued.

    Attributes:
        path: of the file.
        job: what it is a checkpoint of.
    """

    least_seconds_between = 2.0
    most_of_the_time = 0.05

    def __init__(self, path: Path, job: str) -> None:
        """Does not access the file yet; `job` is the result of :func:`describe_job`."""
        self.path = path
        self.job = job
        self._next = time.monotonic() + self.least_seconds_between

    def load(self) -> Progress | None:
        """Returns what an earlier run of this job saved, or None.

        Raises:
            CannotResumeError: it, or a file with frames, is damaged or of another version.
            OtherJobError: it is of another job.
            OSError: a file cannot be read.
        """
        saved = self.read()
        if saved is None:
            return None
        if saved.job != self.job:
            changed = "; ".join(_differences(json.loads(saved.job), json.loads(self.job)))
            raise OtherJobError(
                f"{self.path}: is of another job: {changed}; run with --overwrite to start again, "
                "or write another output"
            )
        check_unchanged(self.path.parent, saved.progress.kept)
        return saved.progress

    def read(self) -> Saved | None:
        """Returns what an earlier run of any job saved, or None.

        This is the only reader, so that all damage of the file is met here.

        Raises:
            CannotResumeError: the file is damaged or of another version.
            OSError: the file cannot be read.
        """
        try:
            with naming(self.path), explaining(), zipfile.ZipFile(self.path) as archive:
                check_members(archive, self.path)
                job = str(read_member(archive, "job"))
                version = json.loads(job)["version"]
                if version != __version__:
                    raise CannotResumeError(f"is of dynmesh {version}, not {__version__}")
                done, written = (int(read_member(archive, name)) for name in ("done", "written"))
                state = read_member(archive, "state").tobytes()
                kept, judged = (
                    json.loads(str(read_member(archive, name))) for name in ("kept", "judged")
                )
        except FileNotFoundError:
            return None
        except IsADirectoryError as error:
            raise CannotResumeError("is a folder", file=self.path) from error
        except CannotResumeError:  # a ValueError, too
            raise
        except (ValueError, TypeError) as error:
            raise CannotResumeError(
                "is damaged or of an earlier version", file=self.path
            ) from error
        return Saved(job, Progress(done, written, state, kept, judged))

    def is_due(self) -> bool:
        """Whether enough time has passed to save again."""
        return time.monotonic() >= self._next

    def save(self, progress: Progress) -> None:
        """Replaces the checkpoint atomically."""
        began = time.monotonic()
        partial = self.path.with_suffix(".part")
        done, written, state, kept, judged = progress
        with naming(self.path), partial.open("wb") as file:
            np.savez(
                file,
                job=self.job,
                done=done,
                written=written,
                state=np.frombuffer(state, np.uint8),
                kept=json.dumps(kept),
                judged=json.dumps(dict(judged)),
            )
        partial.replace(self.path)
        now = time.monotonic()
        pause = (now - began) / self.most_of_the_time
        self._next = now + max(self.least_seconds_between, pause)


def describe_job(
    inputs: Iterable[Path], header: Header, format: str, said: Mapping[str, Any]
) -> str:
    """Everything on which the output depends, as JSON.

    `inputs` are the files that are read; `said` describes the start, the training sequence and the
    options.
    """
    description = {
        "version": __version__,
        "input": list(map(identity, inputs)),
        "faces": zlib.crc32(header.faces.tobytes()),
        "prim": header.name,
        "fps": header.fps,
        "provenance": header.has_provenance,
        "format": format,
        **said,
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
        elif name in ("input", "cameras", "template", "training"):
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
