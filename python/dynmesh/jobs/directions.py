"""The frames of a sequence, completed backwards and forwards from a whole one.

The frames before the whole one are completed first, from the last to the first, and wait on disk.
Then all frames are written in order, while those after the whole one are completed. Each of the two
passes is causal: it uses only frames that it has already met.
"""

import contextlib
from collections.abc import Callable, Generator, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import locating
from ..files import Frame, Reader, Writer
from ..frames.attributes import FUSED
from ..sequence import Positions
from .checkpoint import BEGINNING, Progress
from .completion_options import CompletionOptions
from .report import Tally
from .reversed_frames import ReversedFrames
from .start import StartFrame
from .training import Training

Watch = Callable[[Iterator[Any], int, int], Iterator[Any]]

_BLOCK = 1 << 25  # bytes of frames that are read forwards, to be completed backwards


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
        training: Training,
        progress: Progress = BEGINNING,
        watch: Watch | None = None,
    ) -> None:
        """Reads the training sequence, and completes nothing yet.

        Args:
            reader: of the sequence.
            start_frame: the whole frame.
            options: of the completion, checked.
            training: its training files.
            progress: what an earlier run did.
            watch: called with the frames that are left, in the order of their completion, the
                number of all frames and of those already completed; it must pass the frames on.

        Raises:
            OSError, ValueError: the completer cannot be created.
        """
        self._reader = reader
        self._watch = watch
        self._start_frame = start_frame
        self._drop_above = options.drop_above
        self._done, self._written, _, self._kept = progress
        self._check(progress)
        self._completer = training.completer(start_frame.points, options.settings)
        progress.restore(self._completer, self._pushed())
        self.tally = Tally(options.settings["method"], bool(training))

    def _check(self, progress: Progress) -> None:
        """Refuses what these passes cannot have written."""
        n_before = self._start_frame.n_before
        if self._done < n_before:
            written = range(1)
        elif self._done == n_before:
            written = range(n_before + 1)
        else:
            written = range(self._done, self._done + 1)
        progress.check(self._reader.n_frames, written)

    def _pushed(self) -> tuple[int, ...]:
        """How many frames the completer has met in its pass; the whole one is not among them."""
        n_before = self._start_frame.n_before
        if self._done < n_before:
            return (self._done,)
        if self._done == n_before:  # before or after the end of the first pass
            return (self._done, 0)
        return (self._done - n_before - (self._start_frame.number >= 0),)

    def _frames(self) -> Generator[Frame, None, None]:
        """Yields the frames that are left to complete, in the order of their completion."""
        n_before = self._start_frame.n_before
        if self._done < n_before:
            yield from _backwards(self._reader, n_before - self._done)
        with contextlib.closing(self._reader.frames(max(self._done, n_before))) as frames:
            yield from frames

    def steps(self, writer: Writer, folder: Path) -> Iterator[None]:
        """Completes and writes all frames, in steps between which :meth:`progress` may be called.

        Args:
            writer: holds the frames that were written before.
            folder: for a file of the frames that were completed backwards.

        Raises:
            OSError, ValueError: a frame cannot be read, completed or written.
        """
        with contextlib.closing(self._frames()) as frames:
            watched: Iterator[Frame] = frames
            if self._watch is not None:
                watched = self._watch(frames, self._reader.n_frames, self._done)
            yield from self._complete(watched, writer, folder / "before")

    def _complete(self, frames: Iterator[Frame], writer: Writer, waiting: Path) -> Iterator[None]:
        """Completes and writes these frames; those completed backwards wait in a file."""
        n_before = self._start_frame.n_before
        if n_before:
            kept = min(self._done, n_before)
            with contextlib.closing(
                ReversedFrames(waiting, writer.header, n_before, kept, self._kept)
            ) as before:
                for frame in islice(frames, n_before - kept):
                    number = n_before - 1 - self._done
                    before.append(self._push(frame, number))
                    self._kept = before.pieces()
                    self._done += 1
                    yield
                if self._done == n_before:  # the second pass begins at the whole frame again
                    self._completer.reset(self._start_frame.points)
                for number in range(self._written, n_before):
                    _append(writer, before.frame(number))
                    self._written += 1
                    yield
        for frame in frames:
            _append(writer, self._push(frame, self._done))
            self._done += 1
            self._written += 1
            yield

    def progress(self) -> Progress:
        """Returns what a later run needs to continue."""
        return Progress(self._done, self._written, self._completer.state(), self._kept)

    def _push(self, frame: Frame, number: int) -> Frame:
        """Completes a frame. The whole one is returned as it is."""
        start_frame, completer = self._start_frame, self._completer
        with locating(frame=number):
            if number == start_frame.number:
                points = np.array(start_frame.points, completer.dtype)
            else:
                points = completer.push(frame.points, frame.known)
                self.tally.add(completer, self._standard_error(), self._drop_above)
        return self._as_written(points)

    def _as_written(self, points: Positions) -> Frame:
        """Returns the completed frame with what is known of it, without what is too uncertain."""
        completer, known = self._completer, None
        bars = self._standard_error()
        if self._drop_above is not None:
            assert bars is not None  # as complete_file has set
            known = np.asarray(bars <= self._drop_above)
            points = np.where(known[:, None], points, points.dtype.type(np.nan))
            self.tally.dropped += int(np.count_nonzero(~known))
        return Frame(
            points,
            known,
            generation=self._generation(),
            age=completer.age,
            standard_error=bars,
        )

    def _standard_error(self) -> NDArray[np.floating[Any]] | None:
        """(k,) the standard errors, with that of the start for vertices not observed since."""
        completer, made = self._completer, self._start_frame.made
        if not completer.settings["uncertainty"]:
            return None
        if made is None:
            return completer.standard_error
        since = np.where(completer.age >= completer.n_frames, made.standard_error, 0)
        return np.asarray(np.hypot(completer.standard_error, since))

    def _generation(self) -> NDArray[np.int32]:
        made = self._start_frame.made
        if made is None or self._completer.n_frames:
            return self._completer.generation
        return np.where(made.known, 0, FUSED).astype(np.int32)


def _backwards(reader: Reader, stop: int) -> Iterator[Frame]:
    """Yields the frames before this one from the last to the first, in constant memory."""
    size = reader.n_vertices * 3 * reader.dtype.itemsize
    block = max(1, _BLOCK // size)
    for end in range(stop, 0, -block):
        yield from reversed(list(reader.frames(max(0, end - block), end)))


def _append(writer: Writer, frame: Frame) -> None:
    values = frame.attributes()
    writer.append(frame.points, **{name: values[name] for name in writer.header.attributes})
