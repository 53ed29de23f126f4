"""What calls take beside the work: the slowest of many frames, and the overhead of Python.

The time in C++ is that of `Completer.report`.
"""

import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dynmesh import Completer
from dynmesh.sequence import Mask, Positions
from dynmesh.study.completion import Faces
from dynmesh.study.tables import Line, milliseconds, number

from ..harness import Table
from .comparison import no_collection
from .plan import SpeedPlan
from .scenes import Scene

_LOSSES = ("30 %", "camera")
_SHARE = "50 %"
_CALLS_PER_FRAME = 1000  # on the small mesh, where a single call is too short for the clock


@dataclass(frozen=True, eq=False)
class Latency:
    """Many frames that were pushed one after another.

    Attributes:
        loss: the name of the loss.
        n_vertices: the number of vertices.
        threads: the number of threads of the completer.
        others: the state of the other processors, "idle" or "busy".
        seconds: the time of every frame.
        page_faults: the page faults of these frames.
    """

    loss: str
    n_vertices: int
    threads: int
    others: str
    seconds: NDArray[np.float64]
    page_faults: int


def latency(small: Scene, large: Scene, plan: SpeedPlan) -> Iterator[Latency]:
    """Measure with other processors idle and busy, and the large mesh also with two threads."""
    few = max(plan.latency_frames // 4, 1)
    for scene, threads, n_frames in (
        (small, 1, plan.latency_frames),
        (large, 1, few),
        (large, 2, few),
    ):
        for loss in _LOSSES:
            for others in ("idle", "busy"):
                with busy_processors(others == "busy"), no_collection():
                    seconds, faults = _push_all(scene, loss, threads, n_frames)
                yield Latency(loss, scene.subject.n_vertices, threads, others, seconds, faults)


def _push_all(
    scene: Scene, loss: str, threads: int, n_frames: int
) -> tuple[NDArray[np.float64], int]:
    frames, masks = scene.subject.vertices, scene.masks[loss]
    completer = Completer(scene.subject.faces, frames[0], method="motion", threads=threads)
    out = frames[0].copy()
    # The frames are played forwards and backwards, so that the motion does not jump.
    there = np.arange(1, len(masks))
    order = np.resize(np.concatenate([there, there[-2:0:-1]]), n_frames).tolist()
    seconds = np.zeros(n_frames)  # written to, so that it causes no page fault later
    for n in there.tolist():
        completer.push(frames[n], masks[n], out=out)
    before = _page_faults()
    for place, n in enumerate(order):
        completer.push(frames[n], masks[n], out=out)
        seconds[place] = completer.report.seconds
    return seconds, _page_faults() - before


def _page_faults() -> int:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_minflt + used.ru_majflt


@contextmanager
def busy_processors(busy: bool) -> Iterator[None]:
    """Keep every processor but one busy if `busy` is true."""
    count = (os.cpu_count() or 1) - 1 if busy else 0
    spin = [sys.executable, "-c", "while True: pass"]
    spinning = [subprocess.Popen(spin) for _ in range(count)]
    try:
        yield
    finally:
        for process in spinning:
            process.kill()
            process.wait()


def latency_table(rows: list[Latency]) -> Table:
    """Tabulate percentiles of the time, and page faults."""
    columns = ("50 %, ms", "90 %", "99 %", "99.9 %", "longest")
    head = ("vertices", "lost by", "threads", "other cores", "frames")
    lines: list[Line] = [(*head, *columns, "page faults")]
    for row in rows:
        times = np.percentile(row.seconds, (50, 90, 99, 99.9, 100))
        case = str(row.n_vertices), row.loss, str(row.threads), row.others, str(len(row.seconds))
        lines.append((*case, *map(milliseconds, times), str(row.page_faults)))
    return Table("latency", lines)


def overhead_table(scene: Scene, plan: SpeedPlan) -> Table:
    """Tabulate what Python adds to the time of a call.

    The meshes are a strip of 12 vertices, where nearly all is overhead, and that of a scene.
    """
    lines: list[Line] = [
        ("mesh", "vertices", "call", "Python, µs", "C++, µs", "difference, µs", "difference")
    ]
    number_of = np.arange(10, dtype=np.int32)
    flipped = number_of % 2
    strip = np.stack([number_of + flipped, number_of + 1 - flipped, number_of + 2], axis=1)
    frames = np.random.default_rng(0).random((2, 12, 3), np.float32)
    half = np.arange(12) % 2 == 0
    subject, known = scene.subject, scene.masks[_SHARE]
    for name, faces, positions, masks, calls in (
        ("strip", strip, frames, [half, half], _CALLS_PER_FRAME),
        (subject.name, subject.faces, subject.vertices, known, 1),
    ):
        for call, python, cpp in _overhead(faces, positions, masks, calls, plan.call_rounds):
            cells = [number(1e6 * seconds) for seconds in (python, cpp, python - cpp)]
            share = f"{(python - cpp) / cpp:+.1%}"
            lines.append((name, str(positions.shape[1]), call, *cells, share))
    return Table("overhead", lines)


def _overhead(
    faces: Faces, frames: Positions, masks: list[Mask], calls: int, rounds: int
) -> Iterator[tuple[str, float, float]]:
    """Yield the median seconds of a call from Python, and of the same calls in C++."""
    completer = Completer(faces, frames[0], method="motion")
    out = frames[0].copy()
    push, push_sparse = partial(completer.push, out=out), partial(completer.push_sparse, out=out)
    pairs = list(zip(frames[1:], masks[1:], strict=False))
    holes = [np.where(known[:, None], frame, np.float32(np.nan)) for frame, known in pairs]
    sparse = [(np.flatnonzero(known).astype(np.int32), frame[known]) for frame, known in pairs]
    ways: dict[str, list[Callable[[], object]]] = {
        "mask": [partial(push, frame, known) for frame, known in pairs],
        "NaN": [partial(push, frame) for frame in holes],
        "sparse": [partial(push_sparse, *known) for known in sparse],
    }
    for name, pushes in ways.items():
        python, cpp = [], []
        with no_collection():
            for once in pushes * rounds:
                start = time.perf_counter()
                for _ in range(calls):
                    once()
                python.append((time.perf_counter() - start) / calls)
                cpp.append(completer.report.seconds)
        yield name, float(np.median(python)), float(np.median(cpp))
