"""A completer with random events, and checks of everything that is documented."""

import random
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
from bad_calls import BAD_CALLS
from measures import Latencies
from numpy.typing import NDArray

import dynmesh
from dynmesh import _core

Array = NDArray[Any]

# How often each event occurs in a thousand frames.
EVENTS = {
    "masked": 480,
    "holes as NaN": 200,
    "sparse": 100,
    "into out=": 50,
    "in place": 50,
    "nothing arrived": 30,
    "nothing known": 20,
    "all known": 20,
    "bad call": 40,
    "state, restore": 6,
    "reset": 3,
    "new completer": 1,
}


class Station:
    """One completer and its endless stream of frames.

    Attributes:
        name: of the settings.
        threads: number of threads that a frame may use.
        events: number of occurrences of each event.
        refusals: number of correct refusals of each bad call.
        violations: descriptions of failed checks.
        latencies: of all calls that completed a frame.
        pieces_done_by_others: number of pieces of work in these calls that other threads than the
            calling one have done.
        processor_times: of the calling thread, in each third of the run; this depends less on
            other programs than the latencies.
    """

    def __init__(
        self, name: str, frames: Array, faces: NDArray[np.int32], seed: int, **settings: Any
    ) -> None:
        """The complete `frames` are played forwards and backwards in turn."""
        self.name = name
        self.events: Counter[str] = Counter()
        self.refusals: Counter[str] = Counter()
        self.violations: list[str] = []
        self.latencies = Latencies()
        self.pieces_done_by_others = 0
        self.processor_times = [Latencies(), Latencies(), Latencies()]
        self._random = random.Random(seed)
        self._rng = np.random.default_rng(seed)
        self._frames, self._faces, self._settings = frames, faces, settings
        self.threads: int = settings.get("threads", 1)
        self._exact = settings.get("noise") is None and not settings.get("reject_outliers")
        self._masks = self._make_masks()
        self._completer, self._twin = self._new(), self._new()
        self._number = 0
        self._third = 0
        self._make_room()

    def step(self, progress: float) -> None:
        """Gives the completer the next frame; `progress` is the elapsed share of the run."""
        self._third = min(int(3 * progress), 2)
        self._number += 1
        (event,) = self._random.choices(list(EVENTS), list(EVENTS.values()))
        points = self._points()
        known = self._random.choice(self._masks)
        self.events[event] += 1
        try:
            self._do(event, points, known)
        except Exception as error:  # any error is a violation; the run continues
            self._blame(event, f"raised {type(error).__name__}: {error}")

    def _new(self) -> dynmesh.Completer:
        return dynmesh.Completer(self._faces, self._frames[0], **self._settings)

    def _points(self) -> Array:
        there_and_back = 2 * (len(self._frames) - 1)
        place = self._number % there_and_back
        points: Array = self._frames[min(place, there_and_back - place)]
        return points

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
        for completer in (self._completer, self._twin):
            completer.skip()
            for known in self._masks:
                completer.push(self._frames[0], known)
            completer.reset(self._frames[0])

    def _do(self, event: str, points: Array, known: NDArray[np.bool_]) -> None:
        completer = self._completer
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
            case "into out=":
                out = np.empty_like(points)
                self._push(event, points, known, lambda: completer.push(points, known, out=out))
            case "in place":
                own = self._with_rubbish(points, known)
                self._push(event, points, known, lambda: completer.push(own, known, out=own))
            case "nothing arrived":
                self._push(event, points, np.zeros_like(known), completer.skip)
            case "nothing known":
                none = np.zeros_like(known)
                self._push(event, points, none, lambda: completer.push(points, none))
            case "all known":
                every = np.ones_like(known)
                self._push(event, points, every, lambda: completer.push(points))
            case "bad call":
                self._refuse(points, known)
            case "state, restore":
                self._move_on(event, points, known)
            case "reset":
                completer.reset(points)
                if not np.array_equal(completer.skip(), points):
                    self._blame(event, "the frame differs from the one it was reset to")
            case "new completer":
                self._completer = self._new()

    def _with_rubbish(self, points: Array, known: NDArray[np.bool_]) -> Array:
        """Fills unknown rows with arbitrary values."""
        given = points.copy()
        rubbish = self._random.choice([np.nan, np.inf, -np.inf, 1e38, 0.0])
        given[~known] = rubbish
        return given

    def _push(
        self, event: str, points: Array, known: NDArray[np.bool_], call: Callable[[], Array]
    ) -> Array:
        pieces = _core._pieces_done_by_others()
        began, began_work = time.perf_counter(), time.thread_time()
        completed = call()
        self.processor_times[self._third].add(time.thread_time() - began_work)
        self.latencies.add(time.perf_counter() - began)
        self.pieces_done_by_others += _core._pieces_done_by_others() - pieces
        if completed.shape != points.shape or completed.dtype != points.dtype:
            self._blame(event, f"answered {completed.dtype} of shape {completed.shape}")
        elif not np.isfinite(completed).all():
            self._blame(event, "a completed position is not finite")
        elif self._exact and not np.array_equal(completed[known], points[known]):
            self._blame(event, "an anchor was moved")
        report = self._completer.report
        n_known = int(np.count_nonzero(known))
        if report.known + report.rejected != n_known:
            self._blame(event, f"reports {report.known} known, not {n_known}")
        if report.known + report.filled + report.unseen != len(points):
            self._blame(event, "the report's numbers do not add up")
        return completed

    def _refuse(self, points: Array, known: NDArray[np.bool_]) -> None:
        """Checks that a bad call raises the expected error and leaves the completer unchanged."""
        kind = self._random.choice(list(BAD_CALLS))
        bad = BAD_CALLS[kind]
        before = self._completer.state()
        try:
            bad.call(self._completer, points, known)
        except Exception as error:  # its class is checked below
            if type(error) is bad.error and str(error).startswith(bad.argument):
                self.refusals[kind] += 1
            else:
                self._blame(kind, f"raised {type(error).__name__}: {error}")
        else:
            self._blame(kind, "was not refused")
        if self._completer.state() != before:
            self._blame(kind, "changed the completer")
        self._move_on(kind, points, known)

    def _move_on(self, event: str, points: Array, known: NDArray[np.bool_]) -> None:
        """Checks that a restored completer completes the next frame equally, and keeps it."""
        self._twin.restore(self._completer.state())
        expected = self._completer.push(points, known)
        self._completer, self._twin = self._twin, self._completer
        got = self._push(event, points, known, lambda: self._completer.push(points, known))
        if not np.array_equal(expected, got):
            self._blame(event, "the restored completer completed the frame differently")

    def _blame(self, event: str, what: str) -> None:
        self.violations.append(f"{self.name}, frame {self._number}, {event}: {what}")
