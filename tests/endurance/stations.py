"""A completer with random events, and checks of everything that is documented."""

from collections.abc import Callable
from typing import Any

import numpy as np
from bad_calls import BAD_CALLS
from numpy.typing import NDArray
from watched import Array, Watched

import dynmesh

# How often each event occurs in a thousand frames.
EVENTS = {
    "masked": 480,
    "holes as NaN": 200,
    "sparse": 100,
    "in place": 50,
    "nothing arrived": 30,
    "nothing known": 20,
    "bad call": 40,
    "state, restore": 6,
    "reset": 3,
    "new completer": 1,
}


class Station(Watched[dynmesh.Completer]):
    """One completer and its endless stream of frames."""

    def __init__(
        self, name: str, frames: Array, faces: NDArray[np.int32], seed: int, **settings: Any
    ) -> None:
        """The complete `frames` are played forwards and backwards in turn."""
        super().__init__(name, frames, faces, seed, EVENTS, **settings)
        self._exact = settings.get("noise") is None and not settings.get("reject_outliers")
        self._masks = self._make_masks()
        self._make_room()

    def _new(self) -> dynmesh.Completer:
        return dynmesh.Completer(self._faces, self._frames[0], **self._settings)

    def _make_masks(self) -> list[NDArray[np.bool_]]:
        """Returns random masks of all shares, and masks of what is visible from several sides."""
        k = len(self._frames[0])
        shares = np.linspace(0.05, 0.95, 19)
        masks = [self._rng.random(k) < share for share in shares]
        centred = self._frames[0] - self._frames[0].mean(axis=0)
        for side in self._rng.normal(size=(8, 3)):
            masks.append(centred @ side > 0)
        for mask in masks:
            mask[self._rng.integers(k)] = True
        return masks

    def _make_room(self) -> None:
        """Computes the largest factor first, since memory grows with the largest one so far."""
        for completer in (self._subject, self._twin):
            completer.skip()
            for known in self._masks:
                completer.push(self._frames[0], known)
            completer.reset(self._frames[0])

    def _do(self, event: str) -> None:
        completer = self._subject
        points: Array = self._frames[self._place]
        known = self._random.choice(self._masks)
        match event:
            case "masked":
                given = self._with_rubbish(points, known)
                self._push(event, points, known, lambda: completer.push(given, known))
            case "holes as NaN":
                given = np.where(known[:, None], points, points.dtype.type(np.nan))
                self._push(event, points, known, lambda: completer.push(given))
            case "sparse":
                indices = self._rng.permutation(np.flatnonzero(known))
                given = points[indices]
                self._push(event, points, known, lambda: completer.push_sparse(indices, given))
            case "in place":
                own = self._with_rubbish(points, known)
                self._push(event, points, known, lambda: completer.push(own, known, out=own))
            case "nothing arrived":
                self._push(event, points, np.zeros_like(known), completer.skip)
            case "nothing known":
                none = np.zeros_like(known)
                self._push(event, points, none, lambda: completer.push(points, none))
            case "bad call":
                self._refuse(points, known)
            case "state, restore":
                self._move_on(event, points, known)
            case "reset":
                completer.reset(points)
                if not np.array_equal(completer.skip(), points):
                    self._blame(event, "the frame differs from the one it was reset to")
            case "new completer":
                self._subject = self._new()

    def _with_rubbish(self, points: Array, known: NDArray[np.bool_]) -> Array:
        """Fills unknown rows with arbitrary values."""
        given = points.copy()
        rubbish = self._random.choice([np.nan, np.inf, -np.inf, 1e38, 0.0])
        given[~known] = rubbish
        return given

    def _push(
        self, event: str, points: Array, known: NDArray[np.bool_], call: Callable[[], Array]
    ) -> Array:
        completed = self._timed(event, call)
        if self._exact and not np.array_equal(completed[known], points[known]):
            self._blame(event, "an anchor was moved")
        report = self._subject.report
        n_known = int(np.count_nonzero(known))
        if report.known + report.rejected != n_known:
            self._blame(event, f"reports {report.known} known, not {n_known}")
        if report.known + report.filled + report.disconnected != len(points):
            self._blame(event, "the report's numbers do not add up")
        return completed

    def _refuse(self, points: Array, known: NDArray[np.bool_]) -> None:
        kind = self._random.choice(list(BAD_CALLS))
        self._check_refused(kind, BAD_CALLS[kind], points, known)
        self._move_on(kind, points, known)

    def _move_on(self, event: str, points: Array, known: NDArray[np.bool_]) -> None:
        self._check_restored(
            event,
            lambda completer: completer.push(points, known),
            lambda: self._push(event, points, known, lambda: self._subject.push(points, known)),
        )
