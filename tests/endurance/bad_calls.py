"""Calls that a completer must refuse, with the expected errors."""

from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

import dynmesh

Array = NDArray[Any]
Subject = TypeVar("Subject")


class BadCall(NamedTuple, Generic[Subject]):
    """A call that must raise.

    Attributes:
        call: called with a completer and the points, at least one of them known, and the mask of a
            valid frame, or with a tracker and the points and normals of a scan; it changes no
            array.
        error: the class of the exception.
        argument: the beginning of the message.
    """

    call: Callable[[Subject, Array, Array], object]
    error: type[Exception]
    argument: str


def _with(points: Array, known: Array, value: float) -> Array:
    """Returns the points with one known coordinate replaced."""
    changed = points.copy()
    changed[np.flatnonzero(known)[-1], 1] = value
    return changed


def _too_large(points: Array) -> float:
    return 1e30 if points.dtype == np.float32 else 1e250


def _sparse(completer: dynmesh.Completer, points: Array, indices: list[int]) -> None:
    completer.push_sparse(np.array(indices), points[: len(indices)])


def _overlapping(completer: dynmesh.Completer, points: Array, known: Array) -> None:
    both = np.concatenate([points, points])
    completer.push(both[: len(points)], known, out=both[1 : len(points) + 1])


def _read_only(completer: dynmesh.Completer, points: Array, known: Array) -> None:
    out = np.empty_like(points)
    out.flags.writeable = False
    completer.push(points, known, out=out)


def _damaged(completer: dynmesh.Completer) -> bytes:
    state = bytearray(completer.state())
    state[len(state) // 2] ^= 1
    return bytes(state)


def _other_dtype(points: Array) -> Array:
    other = np.float64 if points.dtype == np.float32 else np.float32
    return np.empty(points.shape, other)


BAD_CALLS: dict[str, BadCall[dynmesh.Completer]] = {
    "a row too few": BadCall(lambda c, p, k: c.push(p[:-1], k), ValueError, "points:"),
    "two coordinates": BadCall(lambda c, p, k: c.push(p[:, :2], k), ValueError, "points:"),
    "no rows at all": BadCall(lambda c, p, k: c.push(p.ravel(), k), ValueError, "points:"),
    "text for points": BadCall(lambda c, _, k: c.push("frame", k), TypeError, "points:"),  # type: ignore[arg-type]
    "mask too short": BadCall(lambda c, p, k: c.push(p, k[:-1]), ValueError, "known:"),
    "mask of numbers": BadCall(
        lambda c, p, k: c.push(p, k.astype(np.int64)),
        TypeError,
        "known:",
    ),
    "NaN where known": BadCall(
        lambda c, p, k: c.push(_with(p, k, np.nan), k), ValueError, "points:"
    ),
    "infinite where known": BadCall(
        lambda c, p, k: c.push(_with(p, k, -np.inf), k), ValueError, "points:"
    ),
    "too large where known": BadCall(
        lambda c, p, k: c.push(_with(p, k, _too_large(p)), k), ValueError, "points:"
    ),
    "too large without mask": BadCall(
        lambda c, p, k: c.push(_with(p, k, _too_large(p))), ValueError, "points:"
    ),
    "index twice": BadCall(lambda c, p, _: _sparse(c, p, [3, 1, 3]), ValueError, "indices:"),
    "index too large": BadCall(lambda c, p, _: _sparse(c, p, [0, len(p)]), ValueError, "indices:"),
    "index negative": BadCall(lambda c, p, _: _sparse(c, p, [0, -1]), ValueError, "indices:"),
    "rows without index": BadCall(
        lambda c, p, _: c.push_sparse(np.array([0, 1]), p[:3]), ValueError, "points:"
    ),
    "NaN in what was observed": BadCall(
        lambda c, p, _: c.push_sparse(np.array([0]), np.full_like(p[:1], np.nan)),
        ValueError,
        "points:",
    ),
    "out read-only": BadCall(_read_only, ValueError, "out:"),
    "out of another dtype": BadCall(
        lambda c, p, k: c.push(p, k, out=_other_dtype(p)), TypeError, "out:"
    ),
    "out over the input": BadCall(_overlapping, ValueError, "out:"),
    "state cut off": BadCall(lambda c, *_: c.restore(c.state()[:-9]), ValueError, "state:"),
    "state damaged": BadCall(lambda c, *_: c.restore(_damaged(c)), ValueError, "state:"),
    "state empty": BadCall(lambda c, *_: c.restore(b""), ValueError, "state:"),
    "state is text": BadCall(lambda c, *_: c.restore("state"), TypeError, "state:"),
    "frame 0 with holes": BadCall(
        lambda c, p, k: c.reset(_with(p, k, np.nan)), ValueError, "frame:"
    ),
    "frame 0 too short": BadCall(lambda c, p, _: c.reset(p[1:]), ValueError, "frame:"),
}
