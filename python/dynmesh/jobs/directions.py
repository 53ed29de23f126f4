"""The frames of a sequence, completed backwards and forwards from a whole one.

What cannot yet be written in order waits on disk. On its way, a completer uses only frames that it
has already met.
"""

import contextlib
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from .._core import Completer
from .._errors import InputError, locating
from ..files import Frame, Reader
from ..files.conversion import Output
from ..sequence import Positions
from ..settings import Settings
from .both_ways import combined
from .checkpoint import BEGINNING, Progress
from .completion_options import CompletionOptions
from .report import Tally
from .start import DOUBTFUL_START, StartFrame
from .waiting_frames import WaitingFrames
from .way import Way

Watch = Callable[[Iterator[Any], int, int], Iterator[Any]]

_BLOCK = 1 << 25  # bytes of frames that are read forwards, to be completed backwards


class CreatesCompleter(Protocol):
    """What creates the completer, from training frames if there are any."""

    def __bool__(self) -> bool:
        """Whether there are training frames."""

    def completer(self, first_frame: Positions, settings: Settings) -> Completer:
        """Creates it."""


@dataclass(frozen=True)
class _Leg:
    """A part of the way.

    Attributes:
        numbers: of the frames, in the order of their completion.
        file: in which the completed frames wait; empty if they are written at once.
        after: the leg whose last frame this one leaves; None if it leaves the whole frame.
        is_back: whether what it completes is combined with what earlier legs have completed.
        begin: the number of frames completed on the legs before it.
    """

    numbers: range
    file: str = ""
    after: "_Leg | None" = None
    is_back: bool = False
    begin: int = 0

    @property
    def end(self) -> int:
        """The number of frames completed at its end."""
        return self.begin + len(self.numbers)


def _legs(start: StartFrame, n_frames: int, bidirectional: bool) -> list[_Leg]:
    """The whole way. The whole frame counts as completed where the way forwards begins at it.

    With `bidirectional`, the way leads from the whole frame to the nearer end of the sequence, from
    there to the other end, and back.
    """
    number = start.number
    before, after = range(number - 1, -1, -1), range(start.n_before, n_frames)
    if not bidirectional:
        return _in_order(_Leg(before, "before"), _Leg(after))
    is_near_first = 2 * number < n_frames
    across = range(n_frames) if is_near_first else range(n_frames - 1, -1, -1)
    out = _Leg(before if is_near_first else after[1:], "out")
    there = _Leg(across[1:], "there", out) if out.numbers else _Leg(across, "there")
    return _in_order(out, there, _Leg(across[-2::-1], "back", there, is_back=True))


def _in_order(*legs: _Leg) -> list[_Leg]:
    begin, found = 0, []
    for leg in legs:
        if leg.numbers:
            found.append(replace(leg, begin=begin))
            begin += len(leg.numbers)
    return found


class Directions:
    """Completes the frames of one sequence.

    Attributes:
        tally: adds up the frames that were completed.
    """

    def __init__(
        self,
        reader: Reader,
        start_frame: StartFrame,
        options: CompletionOptions,
        training: CreatesCompleter,
        progress: Progress = BEGINNING,
        watch: Watch | None = None,
    ) -> None:
        """Reads the training sequence, and completes nothing yet.

        Args:
            reader: of the sequence.
            start_frame: the whole frame.
            options: of the completion, checked.
            training: its training frames.
            progress: what an earlier run did.
            watch: called with the frames that are left, in the order of their completion, the
                number of all frames and of those already completed; it must pass the frames on.
                With `bidirectional`, a frame counts as often as it is completed.

        Raises:
            OSError, ValueError: the completer cannot be created.
        """
        self._reader = reader
        self._watch = watch
        self._start_frame = start_frame
        self._drop_above = options.drop_above
        self._legs = _legs(start_frame, reader.n_frames, options.bidirectional)
        self._done, self._written, _, self._kept, _ = progress
        self._waiting: dict[str, WaitingFrames] = {}
        self._check(progress)
        self._completer = training.completer(start_frame.points, options.settings)
        last = [leg for leg in self._legs if leg.begin < self._done]
        progress.restore(self._completer, [self._pushed(leg) for leg in last[-1:]])
        self.tally = Tally(options.settings["method"], bool(training))

    def _check(self, progress: Progress) -> None:
        """Refuses what cannot have been written."""
        last = self._legs[-1]
        if last.file:  # nothing is written until all frames are completed
            written = range(self._reader.n_frames + 1 if self._done == last.end else 1)
        elif self._done > last.begin:
            written = range(self._done, self._done + 1)
        else:
            written = range(last.begin + 1 if self._done == last.begin else 1)
        progress.check(last.end, written)

    def _completed(self, leg: _Leg) -> int:
        """How many frames of the leg are completed."""
        return min(max(0, self._done - leg.begin), len(leg.numbers))

    def _pushed(self, leg: _Leg) -> int:
        """How many frames the completer has met on the leg."""
        n = self._completed(leg)
        return n - (leg.after is None and self._start_frame.number in leg.numbers[:n])

    def steps(self, writer: Output, folder: Path) -> Iterator[None]:
        """Completes and writes all frames, in steps between which :meth:`progress` may be called.

        Args:
            writer: holds the frames that were written before.
            folder: for files of frames that wait.

        Raises:
            OSError, ValueError: a frame cannot be read, completed or written.
        """
        with contextlib.ExitStack() as opened:
            frames: Iterator[Frame] = opened.enter_context(contextlib.closing(self._frames()))
            if self._watch is not None:
                frames = self._watch(frames, self._legs[-1].end, self._done)
            for leg in self._legs:
                if leg.file:
                    waiting = self._wait(folder / leg.file, leg, writer)
                    self._waiting[leg.file] = opened.enter_context(contextlib.closing(waiting))
                    for _, frame in self._complete(leg, frames):
                        waiting.append(frame)
                        self._kept = {**self._kept, **waiting.pieces()}
                        self._done += 1
                        yield
                    continue
                yield from self._write_waiting(range(self._written, leg.begin), writer)
                for number, frame in self._complete(leg, frames):
                    self._write(frame, number, writer)
                    self._done += 1
                    yield
            next(frames, None)  # at its end, the reader looks whether the file was changed
            yield from self._write_waiting(range(self._written, self._reader.n_frames), writer)

    def _wait(self, path: Path, leg: _Leg, writer: Output) -> WaitingFrames:
        names = ["generation", "age"]
        if self._completer.settings["uncertainty"]:
            names.append("standard_error")
        kept = self._completed(leg)
        return WaitingFrames(path, writer.header, names, leg.numbers, kept, self._kept)

    def _frames(self) -> Generator[Frame, None, None]:
        """Yields the frames that are left to complete, in the order of their completion."""
        for leg in self._legs:
            left = leg.numbers[self._completed(leg) :]
            if not left:
                continue
            if left.step < 0:
                yield from _backwards(self._reader, left[0] + 1, left[-1])
            else:
                with contextlib.closing(self._reader.frames(left[0], left[-1] + 1)) as frames:
                    yield from frames

    def _complete(self, leg: _Leg, frames: Iterator[Frame]) -> Iterator[tuple[int, Frame]]:
        """Yields the completed frames of a leg that are left, with their numbers."""
        left = leg.numbers[self._completed(leg) :]
        if not left:
            return
        origin = self._origin(leg)
        if not self._pushed(leg) and (leg.after or self._completer.n_frames):
            self._completer.reset(origin.points)
        way = Way(self._completer, origin)
        for number in left:
            frame = next(frames, None)
            if frame is None:
                raise InputError(
                    f"ends before frame {self._reader.header.number(number)}, but must pass all "
                    "frames on",
                    argument="watch",
                )
            with locating(frame=self._reader.header.number(number)):
                if number == self._start_frame.number and leg.after is None:
                    yield number, origin
                    continue
                completed = way.push(frame)
            if number != self._start_frame.number:
                self.tally.add(self._completer)
            if leg.is_back:
                completed = combined(self._waits(number, self._legs.index(leg)), completed)
            yield number, completed

    def _origin(self, leg: _Leg) -> Frame:
        """The whole frame that the leg leaves."""
        if leg.after is None:
            return self._start()
        return self._waiting[leg.after.file].frame(leg.after.numbers[-1])

    def _start(self) -> Frame:
        completer = self._completer
        return self._start_frame.frame(completer.dtype, completer.settings["uncertainty"])

    def _write_waiting(self, numbers: range, writer: Output) -> Iterator[None]:
        """Writes these frames, which wait in files."""
        for number in numbers:
            is_start = number == self._start_frame.number
            self._write(self._start() if is_start else self._waits(number), number, writer)
            yield

    def _waits(self, number: int, before: int | None = None) -> Frame:
        """The frame as the last leg has completed it, or the last one before that of this index."""
        legs = [leg for leg in self._legs[:before] if number in leg.numbers]
        return self._waiting[legs[-1].file].frame(number)

    def _write(self, frame: Frame, number: int, writer: Output) -> None:
        """Writes a completed frame, without what is too uncertain."""
        frame = self._start_frame.add_errors(frame, number)
        self.tally.add_written(frame, self._drop_above)
        if self._drop_above is not None:
            assert frame.standard_error is not None  # as complete_file has set
            known = np.asarray(frame.standard_error <= self._drop_above)
            points = np.where(known[:, None], frame.points, frame.points.dtype.type(np.nan))
            frame = replace(frame, points=points, known=known)
        values = frame.attributes()
        writer.append(frame.points, **{name: values[name] for name in writer.header.attributes})
        self._written += 1

    def progress(self) -> Progress:
        """Returns what a later run needs to continue."""
        judged = {"doubtful": DOUBTFUL_START if self._start_frame.doubtful else ""}
        return Progress(self._done, self._written, self._completer.state(), self._kept, judged)


def _backwards(reader: Reader, stop: int, first: int) -> Iterator[Frame]:
    """Yields the frames before `stop` from the last to the first, in constant memory."""
    size = reader.n_vertices * 3 * reader.dtype.itemsize
    block = max(1, _BLOCK // size)
    for end in range(stop, first, -block):
        yield from reversed(list(reader.frames(max(first, end - block), end)))
