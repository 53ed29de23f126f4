"""What a call from Python takes longer than the same call in C++."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

import dynmesh
from dynmesh.sequence import Mask

from .comparison import no_collection
from .plan import SpeedPlan
from .scenes import Faces, Frames, Scene
from .subjects import CppSubject

_SHARE = "50 %"


@dataclass
class Overhead:
    """One way to call, measured alternately from Python and in C++.

    Attributes:
        mesh: the name of the mesh.
        n_vertices: the number of vertices.
        call: how known vertices are given, "mask", "NaN" or "sparse".
        python: the median seconds of a call from Python, for each round.
        cpp: the median seconds of the same call in C++, for each round.
    """

    mesh: str
    n_vertices: int
    call: str
    python: list[float]
    cpp: list[float]


def measure(scene: Scene, plan: SpeedPlan) -> list[Overhead]:
    """Measure a strip of 12 vertices, where nearly all is overhead, and the frames of a scene."""
    known = scene.masks[_SHARE]
    number = np.arange(10, dtype=np.int32)
    flipped = number % 2
    strip = np.stack([number + flipped, number + 1 - flipped, number + 2], axis=1)
    rng = np.random.default_rng(0)
    frames = rng.random((2, 12, 3), np.float32)
    half = np.tile(np.arange(12) % 2 == 0, (2, 1))
    small = _Calls("strip", strip, frames, half, 1000, plan.call_rounds)
    large = _Calls(scene.name, scene.faces, scene.frames, known, 1, plan.call_rounds)
    return [*small.measure(), *large.measure()]


@dataclass(frozen=True, eq=False)
class _Calls:
    name: str
    faces: Faces
    frames: Frames
    known: Mask
    calls_per_frame: int  # more than one if a single call is too short for the clock
    rounds: int

    def measure(self) -> list[Overhead]:
        completer = dynmesh.Completer(self.faces, self.frames[0], method="motion")
        subject = CppSubject(self.faces, self.frames[0], threads=1)
        holes = np.where(self.known[..., None], self.frames, np.float32(np.nan))
        indices = [np.flatnonzero(known).astype(np.int32) for known in self.known]
        points = [frame[known] for frame, known in zip(self.frames, self.known, strict=True)]
        out = self.frames[0].copy()

        def order(i: int) -> NDArray[np.int64]:
            return np.full(self.calls_per_frame, i, np.int64)

        def sparse(i: int) -> NDArray[np.float64]:
            calls = range(self.calls_per_frame)
            return np.array([subject.push_sparse(indices[i], points[i]) for _ in calls])

        push, push_sparse = completer.push, completer.push_sparse
        numbers = range(1, len(self.frames))
        python: dict[str, list[Callable[[], object]]] = {
            "mask": [partial(push, self.frames[i], self.known[i], out=out) for i in numbers],
            "NaN": [partial(push, holes[i], out=out) for i in numbers],
            "sparse": [partial(push_sparse, indices[i], points[i], out=out) for i in numbers],
        }
        cpp: dict[str, Callable[[int], NDArray[np.float64]]] = {
            "mask": lambda i: subject.push(self.frames, self.known, order(i)),
            "NaN": lambda i: subject.push(holes, None, order(i)),
            "sparse": sparse,
        }
        results = [Overhead(self.name, len(out), call, [], []) for call in python]
        for _ in range(self.rounds):
            for result in results:
                with no_collection():
                    here = [self._seconds(call) for call in python[result.call]]
                    there = [np.median(cpp[result.call](i)) for i in numbers]
                result.python.append(float(np.median(here)))
                result.cpp.append(float(np.median(there)))
        return results

    def _seconds(self, call: Callable[[], object]) -> float:
        calls = range(self.calls_per_frame)
        start = time.perf_counter()
        for _ in calls:
            call()
        return (time.perf_counter() - start) / self.calls_per_frame
