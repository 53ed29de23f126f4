"""The time and error of methods on the same frames."""

import gc
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from dynmesh.study.completion import Method
from dynmesh.study.measure import Run, run

from ..methods import ALL, ON_ONE_THREAD, SHARED_FROM, SLOW
from .plan import SpeedPlan
from .scenes import Scene, grid


@dataclass(frozen=True, eq=False)
class Comparison:
    """The runs on one scene, in wall time, by the name of the loss and the key of the method."""

    scene: Scene
    runs: dict[str, dict[str, Run]]

    @property
    def keys(self) -> list[str]:
        """The methods that could run here."""
        return list(dict.fromkeys(key for runs in self.runs.values() for key in runs))

    def seconds(self, key: str) -> list[float]:
        """Return the median time of a method with each loss."""
        return [float(np.median(runs[key].seconds)) for runs in self.runs.values()]

    def errors(self, key: str) -> list[float]:
        """Return the mean NMSVE with each loss over the frames that all methods completed."""
        return [float(np.mean(runs[key].nmsve[: fewest(runs)])) for runs in self.runs.values()]


def fewest(runs: dict[str, Run]) -> int:
    """Return the number of frames, counted from the first, that all methods completed."""
    return min(len(run.nmsve) for run in runs.values())


def compare(
    scene: Scene,
    laps: int,
    slow_frames: int,
    missing: dict[str, str],
    methods: Iterable[Method] = ALL,
    *,
    with_error: bool = True,
) -> Comparison:
    """Measure methods with every loss of a scene.

    The fast methods take turns, so that a disturbance affects all of them. Each completes many
    frames in a row, as in use, when its data are in the caches of the processor.

    Args:
        scene: the frames.
        laps: the number of times that the fast methods complete all frames.
        slow_frames: the number of frames that the slow methods complete; 0 leaves these out.
        missing: gets the methods that cannot run here, and why.
        methods: the methods.
        with_error: whether NMSVE is measured, in the first lap.
    """
    found: dict[str, dict[str, Run]] = {loss: {} for loss in scene.masks}
    turns = product(scene.masks.items(), range(laps), methods)
    with no_collection():
        for (loss, masks), lap, method in turns:
            slow = method in SLOW
            n = 1 + (min(slow_frames, len(masks) - 1) if slow else len(masks) - 1)
            if n == 1 or (slow and lap > 0):
                continue
            frames = replace(scene.subject, vertices=scene.subject.vertices[:n])
            measured = with_error and method.completes and lap == 0
            clock = time.perf_counter
            try:
                new = run(frames, method, masks[:n], with_error=measured, clock=clock)
            except (ImportError, ValueError) as error:
                missing[method.label] = str(error)
                continue
            of_method = found[loss].setdefault(method.key, new)
            if of_method is not new:
                of_method.seconds = np.concatenate([of_method.seconds, new.seconds])
    return Comparison(scene, found)


def against_size(plan: SpeedPlan) -> Iterator[Comparison]:
    """Measure seas on grids of several sizes, the slow methods on the smaller ones."""
    for side in plan.grids:
        scene = grid(side, max(2, min((plan.frames - 1) // 2, 2_000_000 // side**2)))
        n_vertices = scene.subject.n_vertices
        slow_frames = 2 if n_vertices <= plan.slow_limit else 0
        methods = ALL if n_vertices >= SHARED_FROM else ON_ONE_THREAD
        yield compare(scene, 2, slow_frames, {}, methods, with_error=False)


@contextmanager
def no_collection() -> Iterator[None]:
    """Keep the garbage collector of Python from running during a measurement."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
