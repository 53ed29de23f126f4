"""Something that is given an endless stream of frames, and what is noted about it."""

import random
import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any, Generic, TypeVar

import numpy as np
from bad_calls import BadCall
from measures import Times
from numpy.typing import NDArray

import dynmesh
from dynmesh import _core

Array = NDArray[Any]
Subject = TypeVar("Subject", dynmesh.Completer, dynmesh.Tracker)


class Watched(ABC, Generic[Subject]):
    """A completer or tracker, its events, and checks of what is documented of both.

    Attributes:
        name: of the settings.
        threads: number of threads that a frame may use.
        events: number of occurrences of each event.
        refusals: number of correct refusals of each bad call.
        violations: descriptions of failed checks.
        pieces_done_by_others: number of pieces of work in these calls that other threads than the
            calling one have done.
        processor_times: of the calling thread, in each third of the run; this depends less on
            other programs than the time that passes.
    """

    def __init__(
        self,
        name: str,
        frames: Array,
        faces: NDArray[np.int32],
        seed: int,
        often: Mapping[str, int],
        **settings: Any,
    ) -> None:
        """The complete `frames` are played forwards and backwards in turn.

        `often` says how often each event occurs in a thousand frames.
        """
        self.name = name
        self.threads: int = settings.get("threads", 1)
        self.events: Counter[str] = Counter()
        self.refusals: Counter[str] = Counter()
        self.violations: list[str] = []
        self.pieces_done_by_others = 0
        self.processor_times = [Times(), Times(), Times()]
        self._random = random.Random(seed)
        self._rng = np.random.default_rng(seed)
        self._frames, self._faces, self._settings = frames, faces, settings
        self._often = often
        self._number = 0
        self._third = 0
        self._subject: Subject = self._new()
        self._twin: Subject = self._new()

    def step(self, progress: float) -> None:
        """Gives it the next frame; `progress` is the elapsed share of the run."""
        self._third = min(int(3 * progress), 2)
        self._number += 1
        (event,) = self._random.choices(list(self._often), list(self._often.values()))
        self.events[event] += 1
        try:
            self._do(event)
        except Exception as error:  # any error is a violation; the run continues
            self._blame(event, f"raised {type(error).__name__}: {error}")

    @abstractmethod
    def _new(self) -> Subject:
        """Creates one."""

    @abstractmethod
    def _do(self, event: str) -> None:
        """Lets an event happen."""

    @property
    def _place(self) -> int:
        """The number of the frame that is played."""
        there_and_back = 2 * (len(self._frames) - 1)
        place = self._number % there_and_back
        return min(place, there_and_back - place)

    def _timed(self, event: str, call: Callable[[], Array]) -> Array:
        """Makes a frame, and checks what every frame must be."""
        pieces = _core._pieces_done_by_others()
        began = time.thread_time()
        made = call()
        self.processor_times[self._third].add(time.thread_time() - began)
        self.pieces_done_by_others += _core._pieces_done_by_others() - pieces
        if made.shape != self._frames[0].shape or made.dtype != self._frames.dtype:
            self._blame(event, f"answered {made.dtype} of shape {made.shape}")
        elif not np.isfinite(made).all():
            self._blame(event, "a position is not finite")
        return made

    def _check_refused(self, kind: str, bad: BadCall[Subject], *given: Array) -> None:
        """Checks that a bad call raises the expected error and leaves everything unchanged."""
        before = self._subject.state()
        try:
            bad.call(self._subject, *given)
        except Exception as error:  # its class is checked below
            if isinstance(error, bad.error) and str(error).startswith(bad.argument):
                self.refusals[kind] += 1
            else:
                self._blame(kind, f"raised {type(error).__name__}: {error}")
        else:
            self._blame(kind, "was not refused")
        if self._subject.state() != before:
            self._blame(kind, "changed what it refused to use")

    def _check_restored(
        self, event: str, push: Callable[[Subject], Array], checked: Callable[[], Array]
    ) -> None:
        """Checks that a restored one makes the next frame equally, and keeps it.

        Args:
            event: its name.
            push: makes the next frame.
            checked: makes it with `self._subject` and checks it.
        """
        self._twin.restore(self._subject.state())
        expected = push(self._subject)
        self._subject, self._twin = self._twin, self._subject
        if not np.array_equal(expected, checked()):
            self._blame(event, "the restored one made the next frame differently")

    def _blame(self, event: str, what: str) -> None:
        self.violations.append(f"{self.name}, frame {self._number}, {event}: {what}")
