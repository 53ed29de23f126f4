"""Completion of a stream of frames."""

from collections.abc import Iterable, Iterator
from itertools import repeat, zip_longest
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from ._core import Completer
from ._errors import InputError, KindError, locating
from .frames.attributes import ATTRIBUTES
from .sequence import Mask, Positions
from .settings import Settings, all_settings, takes_settings


@takes_settings
def complete(
    faces: NDArray[np.integer[Any]],
    frames: Iterable[Positions],
    known: Iterable[Mask] | None = None,
    *,
    training: Iterable[Positions] | None = None,
    **settings: Unpack[Settings],
) -> Iterator[Positions]:
    """Completes one frame after another, in constant memory.

    This is a generator: nothing is read or checked before the first frame is requested.

    Args:
        faces: (m, 3) integers.
        frames: (k, 3) positions each. The first frame must be complete and is yielded unchanged.
        known: (k,) bool for each frame, or None if rows that are not finite are missing.
        training: complete frames of the same mesh, seen before, from which method detail learns;
            see :class:`dynmesh.Completer`. They are read when the first frame is requested.
        **settings: `method`, `noise` and the other settings of :class:`dynmesh.Completer`, which
            explains them.

    Yields:
        (k, 3) completed frames, each a new array with the dtype of the first frame.

    Raises:
        ValueError, TypeError: the errors of :class:`dynmesh.Completer`, with the number of the
            frame; also if there is no frame, or if frames and masks differ in number.
    """
    pairs = _pair(frames, known)
    first = next(pairs, None)
    if first is None:
        raise InputError("is empty, but frame 0 is needed, complete", argument="frames")
    points, mask = first
    if mask is not None and (missing := np.flatnonzero(np.equal(mask, False))).size:
        raise InputError(
            f"vertex {missing[0]} is missing, but frame 0 must be complete", argument="known"
        )
    completer = Completer(faces, points, training=training, **all_settings(settings))
    if mask is not None:
        given = np.asarray(mask)
        ATTRIBUTES["known"].check(given.dtype, given.shape, (completer.n_vertices,))
    yield np.array(points, completer.dtype)
    for number, (points, mask) in enumerate(pairs, 1):
        with locating(frame=number):
            completed = completer.push(points, mask)
        yield completed


def _pair(
    frames: Iterable[Positions], known: Iterable[Mask] | None
) -> Iterator[tuple[Positions, Mask | None]]:
    for name, given in (("frames", frames), ("known", known)):
        if not isinstance(given, Iterable) and (given is not None or name == "frames"):
            raise KindError(f"must be iterable, not {type(given).__name__}", argument=name)
    if known is None:
        yield from zip(frames, repeat(None), strict=False)
        return
    missing: Any = object()
    pairs: Iterator[tuple[Any, Any]] = zip_longest(frames, known, fillvalue=missing)
    for number, (points, mask) in enumerate(pairs):
        if points is missing or mask is missing:
            short, long = ("frames", "known") if points is missing else ("known", "frames")
            raise InputError(f"ends before frame {number}, but {long} goes on", argument=short)
        yield points, mask
