"""How long the slowest of many frames take, and with what page faults."""

import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from .plan import Plan
from .scenes import Scene
from .subjects import CppSubject

_MASKS = ("30 %", "camera")
QUANTILES = tuple(float(q) for q in 100 * (1 - 10 ** -np.linspace(0.0, 4.0, 41)))
"""In per cent, closer and closer to all."""


@dataclass
class Latency:
    """Many frames, pushed one after another in C++.

    Attributes:
        mask: how vertices are lost.
        n_vertices: of the mesh.
        threads: of the completer.
        others: what the other processors do, "idle" or "busy".
        n_frames: how many were pushed.
        percentiles: seconds, by the share of frames in per cent that took no longer.
        minor_faults: page faults of all these frames; the ones before are not counted.
        major_faults: of them, those that went to the disk.
    """

    mask: str
    n_vertices: int
    threads: int
    others: str
    n_frames: int
    percentiles: dict[str, float]
    minor_faults: int
    major_faults: int


def measure(small: Scene, large: Scene, plan: Plan, missing: dict[str, str]) -> Iterator[Latency]:
    """With other processors idle and busy; the large mesh also with two threads, which share it."""
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
    # To the last frame and back again, so that the motion has no jumps.
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
    """Keeps every processor but one busy, if asked to."""
    count = (os.cpu_count() or 1) - 1 if busy else 0
    spin = [sys.executable, "-c", "while True: pass"]
    spinning = [subprocess.Popen(spin) for _ in range(count)]
    try:
        yield
    finally:
        for process in spinning:
            process.kill()
            process.wait()
