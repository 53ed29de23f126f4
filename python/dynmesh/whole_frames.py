"""Whole frames, put together from frames none of which need be whole."""

import contextlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _core
from ._arrays import Mask, Positions
from ._checks import check_flags, check_integer, check_number
from ._errors import DynmeshError, InputError, KindError
from ._progress import steps
from .arrays import ArrayFrames
from .frames import Frames, check_any
from .header import Header
from .polygons import Faces


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
    frames: Positions | Frames,
    known: NDArray[np.bool_] | None = None,
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
        frames: an array (n, k, 3), a :class:`dynmesh.Sequence`, or a file as :func:`dynmesh.open`
            returns it. Rows that are not finite are missing.
        known: (n, k) bool; None for the masks of the sequence or of the file, if it has any.
        frame: the frame that is made whole, counted from 0, or "best" for the one that knows most
            vertices; of several, that nearest to the middle.
        noise: the standard deviation of the noise of known positions, in their unit. With it, known
            vertices are smoothed by what other frames know of them; otherwise, they are exact.
        outliers: whether known positions that contradict the lengths of the edges around them, as
            other frames know them, count as missing.
        threads: the number of threads that may work; more than one helps from 23 553 vertices on.
        progress: whether to show on standard error how far it is.

    Raises:
        TypeError: an argument has the wrong kind.
        ValueError: an argument has the wrong shape or is out of range, or no vertex is known in any
            frame.
    """
    number = None if isinstance(frame, str) and frame == "best" else frame
    if number is not None:
        check_integer("frame", number, 0)
    if noise is not None:
        check_number("noise", noise)
    check_flags(outliers=outliers)
    check_integer("threads", threads, 1, 256)
    reader = _frames_of(faces, frames, known)
    check_any(reader)
    with (
        _numbering(reader.header),
        steps("putting a whole frame together", progress) as show,
        _source(reader) as source,
    ):
        first, _ = source(0)
        positions, here, seen, standard_error, number, doubtful = _core.whole_frame(
            _arrays.triangles(faces, len(first)),
            first,
            reader.n_frames,
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


def _frames_of(faces: Faces, frames: Positions | Frames, known: NDArray[np.bool_] | None) -> Frames:
    """Returns frames, wherever they are."""
    if isinstance(frames, ArrayFrames):
        own = frames if known is None else replace(frames, known=known)
        return own.named("frames")
    if isinstance(frames, Frames):
        if known is not None:
            raise InputError("is that of the file; open it with masks", argument="known")
        return frames
    try:
        of_any_kind: Any = faces
        return ArrayFrames(frames, of_any_kind, known).named("frames")
    except DynmeshError as error:
        error.argument = "frames" if error.argument == "vertices" else error.argument
        raise


@contextlib.contextmanager
def _numbering(header: Header) -> Iterator[None]:
    """Calls frames by the numbers in their file in errors, which the core counts from 0."""
    try:
        yield
    except DynmeshError as error:
        message = re.fullmatch("frame ([0-9]+): (.*)", str(error))
        if message is None:
            raise
        kind = KindError if isinstance(error, KindError) else InputError
        raise kind(message[2], frame=header.number(int(message[1]))) from error


@contextlib.contextmanager
def _source(reader: Frames) -> Iterator[Callable[[int], tuple[Positions, Mask]]]:
    """Yields a function that reads a frame, and seeks it unless it follows the one before."""
    frames, following = reader.frames(), 0

    def read(number: int) -> tuple[Positions, Mask]:
        nonlocal frames, following
        if number != following:
            frames = reader.frames(number)
        following = number + 1
        frame = next(frames)
        points = _arrays.points("points", frame.points, reader.dtype)
        return points, _arrays.known_mask(frame.claimed)

    try:
        yield read
    finally:
        frames.close()
