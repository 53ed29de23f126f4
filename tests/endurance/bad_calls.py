"""Calls that a completer or a tracker must refuse, with the expected errors."""

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


def _overlapping(completer: dynmesh.Completer, points: Array, known: Array) -> None:
    both = np.concatenate([points, points])
    completer.push(both[: len(points)], known, out=both[1 : len(points) + 1])


def _damaged(subject: dynmesh.Completer | dynmesh.Tracker) -> bytes:
    state = bytearray(subject.state())
    state[len(state) // 2] ^= 1
    return bytes(state)


BAD_CALLS: dict[str, BadCall[dynmesh.Completer]] = {
    "a row too few": BadCall(lambda c, p, k: c.push(p[:-1], k), ValueError, "points:"),
    "NaN where known": BadCall(
        lambda c, p, k: c.push(_with(p, k, np.nan), k), ValueError, "points:"
    ),
    "index twice": BadCall(
        lambda c, p, _: c.push_sparse(np.array([3, 1, 3]), p[:3]), ValueError, "indices:"
    ),
    "out over the input": BadCall(_overlapping, ValueError, "out:"),
    "state damaged": BadCall(lambda c, *_: c.restore(_damaged(c)), ValueError, "state:"),
}
"""One for each stage at which a call can be refused; `tests/python/bad_input` has all refusals."""


BAD_SCANS: dict[str, BadCall[dynmesh.Tracker]] = {
    "infinite point": BadCall(
        lambda t, p, n: t.push(np.where(p == p[-1], np.inf, p), n), ValueError, "points:"
    ),
    "a pose of three rows": BadCall(
        lambda t, *_: t.push_depth(np.ones((30, 40)), 30 * np.eye(3), np.eye(4)[:3]),
        ValueError,
        "pose:",
    ),
    "state damaged": BadCall(lambda t, *_: t.restore(_damaged(t)), ValueError, "state:"),
}
