"""dynmesh beside its rivals on the same frames, and how well each of them does."""

import gc
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

import dynmesh
from dynmesh.metrics import bounding_box_diagonal
from dynmesh.sequence import Mask, Positions

from .rivals import ALL, COPY, DYNMESH, FAST, SLOW, Dynmesh, Method, prepare
from .scenes import Scene


@dataclass
class Measurement:
    """One method on one scene with one mask.

    Attributes:
        part: of the scene.
        scene: its name.
        numbering: of its vertices.
        mask: how vertices are lost.
        method: by its name in `rivals`.
        n_vertices: k.
        known: mean share of known vertices.
        generations: mean over the frames.
        seconds: of every frame completed, in the order in which it happened; empty where the
            method cannot run here.
        nmsve: of frames 1, 2, ..., in bounding-box diagonals; empty where nothing is completed.
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
    methods: Iterable[str] = ALL,
    with_error: bool = True,
) -> Iterator[Measurement]:
    """Measures methods with every mask of a scene.

    The fast methods complete all frames in every lap, and once before to find their errors; the
    frames of the slow ones are spread between the laps, so that a disturbance meets all. A method
    completes many frames in a row, as in use: the processor's caches then hold its own data.

    Args:
        scene: the frames.
        laps: of the fast methods.
        slow_frames: that the slow methods complete; 0 leaves them out.
        missing: is told which methods cannot run here, and why.
        methods: their names; dynmesh must be among them.
        with_error: whether NMSVE is measured.
    """
    wanted = [name for name in methods if name in FAST or slow_frames]
    fast = prepare(scene, FAST, wanted, missing)
    slow = prepare(scene, SLOW, wanted, missing)
    for mask, known in scene.masks.items():
        about = scene.part, scene.name, scene.numbering, mask
        share = float(known[1:].mean())
        generations, nmsve = _complete_once(scene, fast, known, with_error=with_error)
        results = {
            name: Measurement(*about, name, scene.n_vertices, share, generations) for name in wanted
        }
        for name, of_frames in nmsve.items():
            results[name].nmsve = of_frames
        for method in slow.values():
            method.reset()
        for part in np.array_split(np.arange(1, len(known))[:slow_frames], laps):
            with no_collection():
                for name, method in fast.items():
                    method.reset()
                    for number in range(1, len(known)):
                        seconds = method.complete(scene.frames[number], known[number])
                        results[name].seconds.append(seconds)
                for name, method in slow.items():
                    for number in part:
                        seconds = method.complete(scene.frames[number], known[number])
                        results[name].seconds.append(seconds)
                        if with_error:
                            results[name].nmsve += errors(scene, [number], [method.completed])
        yield from results.values()


def _complete_once(
    scene: Scene, methods: dict[str, Method], known: Mask, *, with_error: bool
) -> tuple[float, dict[str, list[float]]]:
    """Mean generations of dynmesh, and the NMSVE of each method's frames."""
    generations: list[int] = []
    nmsve = {}
    numbers = range(1, len(known))
    for name, method in methods.items():
        completed = []
        method.reset()
        for number in numbers:
            method.complete(scene.frames[number], known[number])
            completed.append(method.completed.copy())
            if name == DYNMESH and isinstance(method, Dynmesh):
                generations.append(method.completer.report.iterations)
        if with_error and name != COPY:
            nmsve[name] = errors(scene, numbers, completed)
    return float(np.mean(generations)), nmsve


def errors(scene: Scene, numbers: Iterable[int], completed: list[Positions]) -> list[float]:
    """NMSVE of completed frames in bounding-box diagonals of frame 0."""
    truth = scene.frames[list(numbers)].astype(np.float64)
    nmsve = dynmesh.metrics.nmsve(scene.faces, truth, np.stack(completed).astype(np.float64))
    return [float(error) for error in nmsve / bounding_box_diagonal(scene.frames[0])]


@contextmanager
def no_collection() -> Iterator[None]:
    """Keeps Python's garbage collector from what is timed."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
