"""The times of the slowest of many frames, and their page faults."""

import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from .plan import SpeedPlan
from .scenes import Scene
from .subjects import CppSubject

_MASKS = ("30 %", "camera")
QUANTILES = tuple(float(q) for q in 100 * (1 - 10 ** -np.linspace(0.0, 4.0, 41)))
"""In per cent, ever closer to 100."""


@dataclass
class Latency:
    """Many frames that were pushed one after another in C++.

    Attributes:
        mask: the name of the loss.
        n_vertices: the number of vertices.
        threads: the number of threads of the completer.
        others: the state of the other processors, "idle" or "busy".
        n_frames: the number of frames.
        percentiles: the seconds that a share of the frames, in per cent, took at most.
        minor_faults: the page faults of these frames that needed no access to the disk.
        major_faults: the page faults that needed one.
    """

    mask: str
    n_vertices: int
    threads: int
    others: str
    n_frames: int
    percentiles: dict[str, float]
    minor_faults: int
    major_faults: int


def measure(
    small: Scene, large: Scene, plan: SpeedPlan, missing: dict[str, str]
) -> Iterator[Latency]:
    """Measure with other processors idle and busy, and the large mesh also with two threads."""
    few = max(plan.latency_frames // 4, 1)
    for scene, threads, n_frames in (
        (small, 1, plan.latency_frames),
        (large, 1, few),
        (large, 2, few),
    ):
        try:
            subject = CppSubject(scene.faces, scene.frames[0], threads)
        except ValueError as error:
            missing[f"latency with {threads} threads"] = str(error)
            continue
        for mask in _MASKS:
            for others in ("idle", "busy"):
                with busy_processors(others == "busy"):
                    yield _push_all(scene, subject, mask, threads, others, n_frames)


def _push_all(
    scene: Scene, subject: CppSubject, mask: str, threads: int, others: str, n_frames: int
) -> Latency:
    known = scene.masks[mask]
    # The frames are played forwards and backwards, so that the motion does not jump.
    there = np.arange(1, len(known))
    there_and_back = np.concatenate([there, there[-2:0:-1]])
    order = np.resize(there_and_back, n_frames).astype(np.int64)
    subject.reset(scene.frames[0])
    subject.push(scene.frames, known, order[: len(there)])
    before = resource.getrusage(resource.RUSAGE_SELF)
    seconds = subject.push(scene.frames, known, order)
    after = resource.getrusage(resource.RUSAGE_SELF)
    shares = (*QUANTILES, 50.0, 90.0, 99.0, 99.9, 100.0)
    percentiles = {f"{share:.6g}": float(np.percentile(seconds, share)) for share in shares}
    return Latency(
        mask,
        scene.n_vertices,
        threads,
        others,
        n_frames,
        percentiles,
        after.ru_minflt - before.ru_minflt,
        after.ru_majflt - before.ru_majflt,
    )


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
