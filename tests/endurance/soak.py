"""Runs completers and trackers for a long time, as a live capture does.

    script/dev/soak [FRAMES]

The exit code is 1 if memory grows, frames become slower, a position is not finite, or a tracker
loses the surface. What single calls must keep is checked by tests/fuzz/completer.cpp and
tests/python/tracking/test_stateful.py.
"""

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import dynmesh
from dynmesh import losses
from dynmesh.topology import mean_edge_of

MOST_GROWTH = 0.02  # of the memory, plus
MOST_GROWTH_MB = 2.0
MOST_SLOWDOWN = 1.5  # of the median, from the first third of a run to the last
MOST_LOST = 0.25  # of the frames; 0.04 are usual, and 0.08 to 0.16 of small meshes
SHORTEST_JUDGED = 10_000  # frames; a shorter run cannot show a slowdown

Array = np.ndarray[Any, Any]
Station = Callable[[int], tuple[Array, bool]]
"""Makes the frame of a number, and says whether the surface was lost."""


def there_and_back(frames: Any, number: int) -> Any:
    """An endless stream of the frames."""
    return frames[abs(number % (2 * len(frames) - 2) - len(frames) + 1)]


def completing(mesh: dynmesh.Sequence, seed: int, **settings: Any) -> Station:
    """A completer of any share of known vertices, or in an outage of none."""
    rng = np.random.default_rng(seed)
    completer = dynmesh.Completer(mesh.faces, mesh.vertices[0], **settings)

    def frame(number: int) -> tuple[Array, bool]:
        points = there_and_back(mesh.vertices, number)
        if number % 500 == 250:
            completer.restore(completer.state())
        if number % 500 == 499:
            completer.reset(points)
        if number % 100 < 10:
            return completer.skip(), False
        return completer.push(points, rng.random(len(points)) < rng.random()), False

    return frame


def tracking(mesh: dynmesh.Sequence, seed: int, **settings: Any) -> Station:
    """A tracker of scans by three cameras, some with outliers, and of some the half."""
    first, rng = mesh.vertices[0], np.random.default_rng(seed)
    cameras = losses.orbit(first, 3)(0)
    scans = list(losses.scan_points(mesh.vertices, mesh.faces, cameras, points=3 * len(first)))
    edge = mean_edge_of(first, mesh.faces)
    tracker = dynmesh.Tracker(mesh.faces, first, **settings)

    def frame(number: int) -> tuple[Array, bool]:
        scan = there_and_back(scans, number)
        points, normals = scan.points, scan.normals
        if number % 10 == 3:
            moved = rng.random(len(points)) < 0.2
            points = np.where(moved[:, None], rng.permuted(points, axis=0), points)
        if number % 10 == 6 and normals is not None:
            side = points @ rng.normal(size=3)
            points, normals = (rows[side > np.median(side)] for rows in (points, normals))
        tracked = tracker.push(points, normals, viewpoints=scan.viewpoints)
        distances = np.linalg.norm(scan.points[::10, None] - tracked, axis=2).min(axis=1)
        return tracked, bool(np.median(distances) > edge)

    return frame


def resident() -> float:
    """The memory of this process in MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def main() -> None:
    """Runs all and prints what failed."""
    parser = argparse.ArgumentParser(prog="script/dev/soak", description=__doc__.split("\n")[0])
    parser.add_argument("frames", nargs="?", type=int, default=1_000_000, metavar="FRAMES")
    frames = parser.parse_args().frames
    sea = dynmesh.synth.ocean(60, grid=8, seed=3)
    stations = {
        "motion": completing(sea, 0, method="motion", threads=2),
        "detail": completing(sea, 1, threads=2),
        "detail, noise": completing(sea, 2, noise=1e-3, reject_outliers=True),
        "detail, learning": completing(sea, 3, learn=True, uncertainty=True),
        "tracker": tracking(sea, 4, uncertainty=True),
    }
    times: dict[str, list[float]] = {name: [] for name in stations}
    lost = dict.fromkeys(stations, 0)
    memory: list[float] = []
    wrong: list[str] = []
    began, n = time.monotonic(), 0
    while n * len(stations) < frames:
        for name, station in stations.items():
            before = time.thread_time()
            made, is_lost = station(n)
            times[name].append(time.thread_time() - before)
            lost[name] += is_lost
            if not np.isfinite(made).all():
                wrong.append(f"{name}, frame {n}: a position is not finite")
        memory.append(resident())
        n += 1
    # The first third is left out, as memory for the largest frames is allocated there.
    growth = float(np.median(memory[-n // 10 :]) - np.median(memory[n // 3 :][: n // 10]))
    print(f"memory: {max(memory):.1f} MB at most, {growth:+.2f} MB after the first third")
    if growth > MOST_GROWTH * max(memory) + MOST_GROWTH_MB:
        wrong.append(f"memory grew by {growth:.1f} MB after the first third")
    for name, taken in times.items():
        first, last = np.median(taken[: n // 3]), np.median(taken[-n // 3 :])
        print(f"{name}: {1e3 * last:.3f} ms a frame, {last / first:.2f} of the first third")
        if frames >= SHORTEST_JUDGED and last > MOST_SLOWDOWN * first:
            wrong.append(f"{name}: the last third was slower by a factor of {last / first:.2f}")
        if lost[name] > MOST_LOST * n:
            wrong.append(f"{name}: lost the surface in {lost[name]} of {n} frames")
    print(f"{n * len(stations)} frames in {time.monotonic() - began:.0f} s")
    for one in wrong[:20]:
        print(one, file=sys.stderr)
    print(f"{len(wrong)} violations")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
