"""Completion of a stream of frames."""

from collections.abc import Iterable, Iterator
from itertools import repeat, zip_longest
from typing import Any, Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from ._checks import SettingError
from ._core import Completer
from .sequence import Mask, Positions, check_known


class Settings(TypedDict, total=False):
    """The settings of :class:`dynmesh.Completer`, which documents them."""

    method: Literal["motion", "detail"]
    revisit: bool
    extra_iterations: int
    unseen: Literal["follow", "hold"]
    noise: float | None
    reject_outliers: bool
    threads: int


default_settings: Settings = {
    "method": "motion",
    "revisit": True,
    "extra_iterations": 0,
    "unseen": "follow",
    "noise": None,
    "reject_outliers": False,
    "threads": 1,
}
"""The defaults of :class:`dynmesh.Completer`."""


def complete(
    faces: NDArray[np.integer[Any]],
    frames: Iterable[Positions],
    known: Iterable[Mask] | None = None,
    *,
    method: Literal["motion", "detail"] = "motion",
    revisit: bool = True,
    extra_iterations: int = 0,
    unseen: Literal["follow", "hold"] = "follow",
    noise: float | None = None,
    reject_outliers: bool = False,
    threads: int = 1,
) -> Iterator[Positions]:
    """Completes one frame after another, in constant memory.

    This is a generator: nothing is read or checked before the first frame is requested.

    Args:
        faces: (m, 3) integers.
        frames: (k, 3) positions each. The first frame must be complete and is yielded unchanged.
        known: (k,) bool for each frame, or None if rows that are not finite are missing.
        method: "motion" or "detail". This and the following arguments are the settings of
            :class:`dynmesh.Completer`, which explains them.
        revisit: for "motion"; whether every iteration estimates all satellites again.
        extra_iterations: for "motion"; the number of iterations after the last satellite is
            reached.
        unseen: "follow" or "hold"; the motion of vertices that no edges connect to a known one.
        noise: for "detail"; the standard deviation of known positions, or None if they are exact.
        reject_outliers: for "detail"; whether known vertices that do not move like those around
            them are treated as missing.
        threads: the number of threads that a frame may use.

    Yields:
        (k, 3) completed frames, each a new array with the dtype of the first frame.

    Raises:
        ValueError, TypeError: the errors of :class:`dynmesh.Completer`, with the number of the
            frame; also if there is no frame, or if frames and masks differ in number.
    """
    settings: Settings = {
        "method": method,
        "revisit": revisit,
        "extra_iterations": extra_iterations,
        "unseen": unseen,
        "noise": noise,
        "reject_outliers": reject_outliers,
        "threads": threads,
    }
    for completed, _ in complete_pairs(faces, _pair(frames, known), **settings):
        yield completed


def complete_pairs(
    faces: NDArray[np.integer[Any]], pairs: Iterable[Iterable[Any]], **settings: Unpack[Settings]
) -> Iterator[tuple[Positions, Completer]]:
    """Completes (points, known) pairs and also yields the completer after each frame."""
    remaining = iter(pairs)
    first = next(remaining, None)
    if first is None:
        raise ValueError("frames: is empty, but a complete frame 0 is needed")
    points, known = first
    completer = begin(faces, points, known, **settings)
    yield np.array(points, completer.dtype), completer
    yield from push_all(completer, remaining, first_number=1)


def begin(
    faces: NDArray[np.integer[Any]],
    points: Positions,
    known: Mask | None,
    **settings: Unpack[Settings],
) -> Completer:
    """Creates the completer for a sequence with this frame 0, which must be complete."""
    if known is not None and (missing := np.flatnonzero(np.equal(known, False))).size:
        raise ValueError(f"known: vertex {missing[0]} is missing, but frame 0 must be complete")
    try:
        completer = Completer(faces, points, **settings)
    except ValueError as error:
        if str(error).partition(":")[0] in default_settings:
            raise SettingError(str(error)) from error
        raise
    if known is not None:
        mask = np.asarray(known)
        check_known(mask.dtype, mask.shape, (completer.n_vertices,))
    return completer


def push_all(
    completer: Completer, pairs: Iterable[Iterable[Any]], first_number: int
) -> Iterator[tuple[Positions, Completer]]:
    """Completes the following frames, numbered from `first_number`; see :func:`complete_pairs`."""
    for number, (points, known) in enumerate(pairs, first_number):
        try:
            completed = completer.push(points, known)
        except (ValueError, TypeError) as error:
            raise type(error)(f"frame {number}: {error}") from error
        yield completed, completer


def _pair(
    frames: Iterable[Positions], known: Iterable[Mask] | None
) -> Iterator[tuple[Positions, Mask | None]]:
    for name, given in (("frames", frames), ("known", known)):
        if not isinstance(given, Iterable) and (given is not None or name == "frames"):
            raise TypeError(f"{name}: must be iterable, not {type(given).__name__}")
    if known is None:
        yield from zip(frames, repeat(None), strict=False)
        return
    missing: Any = object()
    pairs: Iterator[tuple[Any, Any]] = zip_longest(frames, known, fillvalue=missing)
    for number, (points, mask) in enumerate(pairs):
        if points is missing or mask is missing:
            short, long = ("frames", "known") if points is missing else ("known", "frames")
            raise ValueError(f"{short}: ends before frame {number}, but {long} does not")
        yield points, mask
