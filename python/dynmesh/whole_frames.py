"""Whole frames, put together from frames none of which need be whole."""

import contextlib
import re
from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _core
from ._checks import check_flag, check_integer, check_number
from ._errors import InputError, KindError, locating
from ._progress import steps
from .files.frame import Frame
from .files.reader import Reader
from .polygons import Faces
from .sequence import Description, Mask, Positions, Sequence

Frames: TypeAlias = (
    Positions | Sequence | Reader | Iterable[Positions] | Callable[[], Iterable[Any]]
)
"""Frames that can be read more than once."""


@dataclass(frozen=True, eq=False)
class WholeFrame:
    """What :func:`dynmesh.whole_frame` returns.

    Attributes:
        positions: (k, 3), with the dtype of the frames.
        known: (k,) bool, whether the frame itself knows the vertex; with `outliers`, false for
            those that were left out.
        seen: (k,) bool, whether the vertex is known in at least one frame, this one included.
        standard_error: (k,) of a coordinate, in the unit of the positions, as
            :attr:`dynmesh.Completer.standard_error`: 0 where the frame knows the vertex exactly,
            infinity where no chain of edges ties it to a vertex that the frame knows.
        frame: the frame that was made whole, counted from 0.
        doubtful: whether the result is probably wrong, because its edges are far from the lengths
            that they have where frames know both ends. The frames may not belong together.
    """

    positions: Positions
    known: Mask
    seen: Mask
    standard_error: NDArray[np.floating[Any]]
    frame: int
    doubtful: bool


def whole_frame(
    faces: Faces,
    frames: Frames,
    known: NDArray[np.bool_] | Iterable[Mask] | Callable[[], Iterable[Mask]] | None = None,
    *,
    frame: int | Literal["best"] = "best",
    noise: float | None = None,
    outliers: bool = False,
    threads: int = 1,
    progress: bool = False,
) -> WholeFrame:
    """Puts a whole frame together out of frames of which none need be whole.

    A completer is sent out from a smooth surface through the known vertices of the frame to both
    ends of the sequence and back, five times or more, each time from a frame that the last trip has
    made better. A :class:`dynmesh.Completer` can then start from the result. The time is about that
    of completing the sequence five to ten times with `learn` and `uncertainty`. Of more than 250
    frames, the nearest thirty on each side are used, and then fewer and fewer. At most 300 frames
    are kept in memory, and the frames are read twice.

    Args:
        faces: (m, 3) integers, or other polygons; see :data:`dynmesh.polygons.Faces`.
        frames: an array (n, k, 3), a :class:`dynmesh.Sequence`, a reader as :func:`dynmesh.open`
            returns it, a list of (k, 3) arrays, or a function without arguments that returns a new
            iterator over the frames. Rows that are not finite are missing.
        known: (n, k) bool or likewise a mask for each frame; None for the masks of the sequence or
            of the reader, if it has any.
        frame: the frame that is made whole, counted from 0, or "best" for the one that knows most
            vertices; of several, that nearest to the middle.
        noise: the standard deviation of the noise of known positions, in their unit. With it, known
            vertices are smoothed by what other frames know of them; otherwise, they are exact.
        outliers: whether known positions that contradict the lengths of the edges around them, as
            other frames know them, count as missing.
        threads: the number of threads that may work.
        progress: whether to show a bar on standard error.

    Raises:
        TypeError: an argument has the wrong kind, or `frames` or `known` can be read only once.
        ValueError: an argument has the wrong shape or is out of range, frames and masks differ in
            number, or no vertex is known in any frame.
    """
    if isinstance(frame, str):
        if frame != "best":
            raise KindError(f"must be 'best' or an integer, not {frame!r}", argument="frame")
    else:
        check_integer("frame", frame, 0)
    number = None if frame == "best" else frame
    if noise is not None:
        check_number("noise", noise)
    check_flag("outliers", outliers)
    check_integer("threads", threads, 1, 256)
    with (
        _numbering(frames),
        _without_whole_frame(frames),
        contextlib.closing(_Source(frames, known)) as source,
        steps("putting a whole frame together", progress) as show,
    ):
        first, _ = source(0)
        positions, here, seen, standard_error, number, doubtful = _core.whole_frame(
            _arrays.triangles(faces, len(first)),
            first,
            source.n_frames,
            source,
            number,
            noise,
            outliers,
            threads,
            show,
        )
    return WholeFrame(
        positions.reshape(-1, 3),
        here.astype(np.bool_),
        seen.astype(np.bool_),
        standard_error,
        number,
        doubtful,
    )


@contextlib.contextmanager
def _without_whole_frame(frames: object) -> Iterator[None]:
    """Reads zeros that stand for missing vertices as such in every frame of a reader."""
    if not isinstance(frames, Reader):
        yield
        return
    whole, frames.whole = frames.whole, None
    try:
        yield
    finally:
        frames.whole = whole


@contextlib.contextmanager
def _numbering(frames: object) -> Iterator[None]:
    """Calls frames by the numbers in their file in errors, which the core counts from 0."""
    described = frames.header if isinstance(frames, Reader) else frames
    try:
        yield
    except (TypeError, ValueError) as error:
        told = re.fullmatch("frame ([0-9]+): (.*)", str(error))
        if told is None:
            raise
        frame = int(told[1])
        number = described.number(frame) if isinstance(described, Description) else frame
        kind = KindError if isinstance(error, TypeError) else InputError
        raise kind(told[2], frame=number) from error


class _Source:
    """Returns the frames by number, reading them in order as often as is needed.

    Attributes:
        n_frames: their number.
    """

    def __init__(self, frames: Frames, known: object) -> None:
        self._frames = frames
        self._known = known
        for name, given in (("frames", frames), ("known", known)):
            _check_repeatable(name, given)
        self.n_frames = self._count()
        if self.n_frames == 0:
            raise InputError("there are none", argument="frames")
        self._pairs = self._anew()
        self._next = self.n_frames
        self._first: Positions | None = None

    def __call__(self, number: int) -> tuple[Positions, Mask]:
        if number < self._next:
            self.close()
            self._pairs, self._next = self._anew(), 0
        for frame in self._pairs:
            self._next += 1
            if self._next > number:
                if self._next == self.n_frames:
                    next(self._pairs, None)  # refuses masks that go on
                with locating(frame=number):
                    return self._exact(frame)
        raise InputError(f"ends before frame {number}, which it had before", argument="frames")

    def _exact(self, frame: Frame) -> tuple[Positions, Mask]:
        """The points, in the dtype of frame 0, and the known mask, as the core takes them."""
        if self._first is None:
            self._first = _arrays.first_frame("points", frame.points)
        points = _arrays.points("points", frame.points, self._first.dtype)
        known = _arrays.known_mask(_known_in(frame))
        k = len(self._first)
        if len(points) != k or len(known) != k:
            raise InputError(
                f"has {len(points)} rows and a mask of {len(known)}, but frame 0 has {k} vertices"
            )
        return points, known

    def close(self) -> None:
        """Ends the iterators."""
        self._pairs.close()

    def _count(self) -> int:
        if isinstance(self._frames, Reader):
            return self._frames.n_frames
        if isinstance(self._frames, np.ndarray | Sequence | list | tuple):
            return len(self._frames)
        return sum(1 for _ in self._anew())

    def _anew(self) -> Generator[Frame, None, None]:
        """A new iterator over the frames."""
        frames, known = self._frames, self._known
        if known is None and isinstance(frames, Sequence):
            known = frames.known
        with _begun(frames) as points:
            if known is None:
                yield from (given if isinstance(given, Frame) else Frame(given) for given in points)
                return
            with _begun(known) as masks:
                yield from _paired(points, masks)


def _paired(frames: Iterator[Any], masks: Iterator[Any]) -> Iterator[Frame]:
    ended: Any = object()
    for number, (given, mask) in enumerate(zip_longest(frames, masks, fillvalue=ended)):
        if given is ended or mask is ended:
            short, long = ("frames", "known") if given is ended else ("known", "frames")
            raise InputError(f"ends before frame {number}, but {long} goes on", argument=short)
        yield Frame(given.points if isinstance(given, Frame) else given, mask)


@contextlib.contextmanager
def _begun(given: Any) -> Iterator[Iterator[Any]]:
    """Begins to read frames or masks, and ends it."""
    items = iter(given() if callable(given) else given)
    try:
        yield items
    finally:
        if isinstance(items, Generator):
            items.close()


def _check_repeatable(name: str, given: object) -> None:
    if given is None and name == "known":
        return
    if isinstance(given, Iterator):
        raise KindError(
            "is an iterator, which can be read only once, but frames are read twice; give an "
            "array, a Sequence, a reader, or a function that returns a new iterator",
            argument=name,
        )
    if not callable(given) and not isinstance(given, Iterable):
        raise KindError(
            "must be an array, a Sequence, a reader, or a function that returns an iterator, not "
            f"{type(given).__name__}",
            argument=name,
        )


def _known_in(frame: Frame) -> Mask:
    """(k,) the vertices that a frame knows."""
    if frame.known is not None:
        return frame.known
    return np.asarray(np.isfinite(frame.points).all(axis=-1))
