"""Frames that are made while they are gone through."""

import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import replace
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import Any, Generic, NoReturn, TypeVar

from numpy.typing import DTypeLike

from ._errors import InputError, KindError
from ._report import DoubtfulWarning, Report
from .frames import Frame, Frames
from .header import Header, summary

R = TypeVar("R", bound=Report)

_held_back: ContextVar[list[Callable[[], object]] | None] = ContextVar("held_back", default=None)


@contextmanager
def whole_first() -> Iterator[None]:
    """Holds back what verbs write beside their frames until this is left without an error."""
    actions: list[Callable[[], object]] = []
    token = _held_back.set(actions)
    try:
        yield
    finally:
        _held_back.reset(token)
    for action in actions:
        action()


class ComputedFrames(Frames, Generic[R]):
    """Frames that are made while they are gone through, each time anew: by a verb, or by a caller.

    When all were made, `report` says how; what is made of doubtful frames is doubtful. A result
    that is doubtful is a :class:`DoubtfulWarning` as well.
    """

    def __init__(
        self,
        header: Header,
        make: Callable[[], Iterator[Frame] | Generator[Frame, None, R]],
        source: Frames | None = None,
        *,
        files: Sequence[Path] = (),
        wanted: Sequence[str] = (),
        beside: Callable[[R], object] | None = None,
        close: Callable[[], object] = lambda: None,
    ) -> None:
        """Takes what makes the frames.

        Args:
            header: of the frames that are made.
            make: returns an iterator over the frames; a generator may return a report.
            source: the frames of which they are made, if there are any.
            files: those that are read beside those of the source.
            wanted: see :class:`Frames`.
            beside: writes a file about the frames, from their report, when all were made or, if
                they are written, when that file is whole.
            close: closes what was opened for the frames.
        """
        self.header, self.faces, self.fps = header, header.faces, header.fps
        self.path, self.files, self.wanted = Path("frames"), files, wanted
        if source is not None:
            self.path, self.files, self.lost = source.path, [*source.files, *files], source.lost
        self._make, self._source, self._opened, self._beside = make, source, close, beside
        self._report: Any = None

    def __iter__(self) -> Iterator[Frame]:
        """Makes all frames, from the first on.

        The report is there before the last one is yielded, after which nobody may ask for more.
        """
        self._check_open()
        frames = iter(self._make())
        yield from islice(frames, self.n_frames - 1)
        last = next(frames, None)
        if last is None:  # there are fewer than the header says, so nothing is reported of them
            return
        try:
            further = next(frames)
        except StopIteration as end:
            done = Report() if end.value is None else end.value
            before = Report() if self._source is None else report_of(self._source)
            if done.quality == "good":
                done = replace(done, quality=before.quality, reason=before.reason)
            self._report = done
            self._write_beside()
            if self._report.reason:
                warnings.warn(f"{self.path}: {self._report.reason}", DoubtfulWarning, stacklevel=2)
        else:
            frames = chain([further], frames)  # which are too many
        yield last
        yield from frames

    def _write_beside(self) -> None:
        if self._beside is None:
            return
        action, held_back = partial(self._beside, self._report), _held_back.get()
        action() if held_back is None else held_back.append(action)

    @property
    def report(self) -> R:
        """What was done.

        Raises:
            ValueError: not all frames have been made yet.
        """
        if self._report is None:
            message = "is there when all frames have been gone through, as write and read do"
            raise InputError(message, argument="report")
        report: R = self._report
        return report

    def _close(self) -> None:
        self._opened()

    def __getitem__(self, frames: object) -> NoReturn:
        """Refuses to make some of the frames: see :func:`dynmesh.read`."""
        raise KindError("frames are made one after another; dynmesh.read(frames) gives all of them")

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NoReturn:
        """Refuses to make an array: see :func:`dynmesh.read`."""
        raise KindError("frames are made one after another; dynmesh.read(frames) gives arrays")

    def __repr__(self) -> str:
        """Describes the frames without their numbers."""
        counts = summary(self.n_frames, self.n_vertices, len(self.faces), self.dtype)
        return f"{type(self).__name__}({str(self.path)!r}: {counts}, made when gone through)"


def report_of(frames: Frames) -> Report:
    """The report of frames that were made and gone through; of others, an empty one."""
    report = getattr(frames, "_report", None)
    return report if isinstance(report, Report) else Report()
