"""The time and error of methods on the same frames."""

import gc
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from dynmesh.sequence import Mask, Positions
from dynmesh.study.completion import Completion, Method
from dynmesh.study.measure import nmsve, timed
from dynmesh.study.methods import MOTION

from .methods import ALL, BY_KEY, FAST, SLOW, begin
from .scenes import Scene


@dataclass
class Measurement:
    """One method on one scene with one loss.

    Attributes:
        part: the part of the measurements that the scene belongs to.
        scene: the name of the scene.
        numbering: the order of its vertices.
        mask: the name of the loss.
        method: the key of the method.
        n_vertices: the number of vertices.
        known: the mean share of known vertices.
        generations: the mean number of generations of a frame.
        seconds: the wall time of every frame, in the order in which frames were completed. Empty if
            the method cannot run here.
        nmsve: NMSVE of frames 1, 2, ..., in bounding-box diagonals. Empty if it was not measured.
    """

    part: str
    scene: str
    numbering: str
    mask: str
    method: str
    n_vertices: int
    known: float
    generations: float
    seconds: list[float] = field(default_factory=list)
    nmsve: list[float] = field(default_factory=list)


def compare(
    scene: Scene,
    laps: int,
    slow_frames: int,
    missing: dict[str, str],
    *,
    methods: Iterable[Method] = ALL,
    with_error: bool = True,
) -> Iterator[Measurement]:
    """Measure methods with every loss of a scene.

    The fast methods complete all frames in every lap, and once before to measure their errors. The
    frames of the slow ones are spread between the laps, so that a disturbance affects all methods.
    Each method completes many frames in a row, as in use, when its data are in the caches of the
    processor.

    Args:
        scene: the frames.
        laps: the number of times that the fast methods complete all frames.
        slow_frames: the number of frames that the slow methods complete; 0 leaves these out.
        missing: gets the methods that cannot run here, and why.
        methods: the methods, motion among them.
        with_error: whether NMSVE is measured.
    """
    wanted = [method for method in methods if method in FAST or slow_frames]
    fast = begin(scene, [method for method in wanted if method in FAST], missing)
    slow = begin(scene, [method for method in wanted if method in SLOW], missing)
    frames = scene.subject.vertices
    for mask, known in scene.masks.items():
        about = scene.part, scene.name, scene.numbering, mask
        share = float(known[1:].mean())
        generations, errors = _complete_once(scene, fast, known, with_error=with_error)
        results = {
            method.key: Measurement(*about, method.key, scene.n_vertices, share, generations)
            for method in wanted
        }
        for key, of_frames in errors.items():
            results[key].nmsve = of_frames
        for completion in slow.values():
            completion.reset()
        for part in np.array_split(np.arange(1, len(known))[:slow_frames], laps):
            with no_collection():
                for key, completion in fast.items():
                    completion.reset()
                    for number in range(1, len(known)):
                        _, seconds = timed(completion, frames[number], known[number])
                        results[key].seconds.append(seconds)
                for key, completion in slow.items():
                    for number in part:
                        completed, seconds = timed(completion, frames[number], known[number])
                        results[key].seconds.append(seconds)
                        if with_error:
                            results[key].nmsve += _errors(scene, [number], [completed])
        yield from results.values()


def _complete_once(
    scene: Scene, completions: dict[str, Completion], known: Mask, *, with_error: bool
) -> tuple[float, dict[str, list[float]]]:
    """Return the mean number of generations, and the NMSVE of the frames of each method."""
    generations: list[int] = []
    errors = {}
    numbers = range(1, len(known))
    for key, completion in completions.items():
        completed = []
        completion.reset()
        for number in numbers:
            points = scene.subject.vertices[number]
            completed.append(completion.complete(points, known[number]).copy())
            if key == MOTION.key:
                generations.append(completion.iterations)
        if with_error and BY_KEY[key].completes:
            errors[key] = _errors(scene, numbers, completed)
    return float(np.mean(generations)), errors


def _errors(scene: Scene, numbers: Iterable[int], completed: list[Positions]) -> list[float]:
    frames = [frame.astype(np.float32) for frame in completed]
    return [float(error) for error in nmsve(scene.subject, numbers, frames)]


@contextmanager
def no_collection() -> Iterator[None]:
    """Keep the garbage collector of Python from running during a measurement."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
