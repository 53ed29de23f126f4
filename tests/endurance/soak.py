"""Runs completers and trackers for a long time, as a live capture does.

    script/soak MINUTES             frames one after another
    script/soak --frames 1000000    this many frames of a small mesh

The exit code is 1 if memory grows, frames become slower, a position is not finite, or a tracker
loses the surface. What single calls must keep is checked by tests/python/test_stateful.py.
"""

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import dynmesh
from dynmesh import degrade
from dynmesh.degrade.shared import mean_edge_of

MOST_GROWTH = 0.02  # of the memory, plus
MOST_GROWTH_MB = 2.0
MOST_SLOWDOWN = 1.5  # of the median, from the first third of a run to the last
MOST_LOST = 0.25  # of the frames; 0.04 are usual, and 0.08 to 0.16 of small meshes
SHORTEST_JUDGED = 1.0  # minutes; a shorter run cannot show a slowdown

Array = np.ndarray[Any, Any]


class Completing:
    """A completer with an endless stream of frames, which are played there and back."""

    lost = 0

    def __init__(self, mesh: dynmesh.Sequence, seed: int, **settings: Any) -> None:
        """Makes the completer from the first frame."""
        self.frames, self.rng = mesh.vertices, np.random.default_rng(seed)
        self.subject = dynmesh.Completer(mesh.faces, self.frames[0], **settings)

    def frame(self, number: int) -> Array:
        """Completes a frame of any share of known vertices, or in an outage none."""
        points = self.frames[abs(number % (2 * len(self.frames) - 2) - len(self.frames) + 1)]
        if number % 500 == 250:
            self.subject.restore(self.subject.state())
        if number % 500 == 499:
            self.subject.reset(points)
        if number % 100 < 10:
            return self.subject.skip()
        return self.subject.push(points, self.rng.random(len(points)) < self.rng.random())


class Tracking:
    """A tracker with an endless stream of scans, some with outliers, and of some the half."""

    def __init__(self, mesh: dynmesh.Sequence, seed: int, **settings: Any) -> None:
        """Makes the tracker from the first frame, and the scans by three cameras."""
        first, self.rng = mesh.vertices[0], np.random.default_rng(seed)
        cameras = degrade.orbit(first, 3)(0)
        self.scans = list(
            degrade.scan_points(mesh.vertices, mesh.faces, cameras, points=3 * len(first))
        )
        self.edge = mean_edge_of(first, mesh.faces)
        self.subject = dynmesh.Tracker(mesh.faces, first, **settings)
        self.lost = 0

    def frame(self, number: int) -> Array:
        """Tracks the next scan."""
        scan = self.scans[abs(number % (2 * len(self.scans) - 2) - len(self.scans) + 1)]
        points, normals = scan.points, scan.normals
        if number % 10 == 3:
            moved = self.rng.random(len(points)) < 0.2
            points = np.where(moved[:, None], self.rng.permuted(points, axis=0), points)
        if number % 10 == 6 and normals is not None:
            side = points @ self.rng.normal(size=3)
            points, normals = (rows[side > np.median(side)] for rows in (points, normals))
        tracked = self.subject.push(points, normals, viewpoints=scan.viewpoints)
        distances = np.linalg.norm(scan.points[::10, None] - tracked, axis=2).min(axis=1)
        self.lost += int(np.median(distances) > self.edge)
        return tracked


def stations(seed: int, *, small: bool) -> dict[str, Completing | Tracking]:
    """Completers of both methods, and trackers, with several settings."""
    large = dynmesh.synth.ocean(60, grid=8, seed=3) if small else dynmesh.synth.walker(60)
    sea = dynmesh.synth.ocean(60, grid=8 if small else 25, seed=3)
    return {
        "motion": Completing(large, seed, method="motion", threads=2),
        "detail": Completing(large, seed + 1, threads=2),
        "detail, noise": Completing(sea, seed + 2, noise=1e-3, reject_outliers=True),
        "detail, learning": Completing(sea, seed + 3, learn=True, uncertainty=True),
        "tracker": Tracking(sea, seed + 4, uncertainty=True),
    }


def resident() -> float:
    """The memory of this process in MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def main() -> None:
    """Runs all and prints what failed."""
    parser = argparse.ArgumentParser(prog="script/soak", description=__doc__.split("\n")[0])
    parser.add_argument("minutes", nargs="?", type=float, help="duration of the run")
    parser.add_argument("--frames", type=int, help="instead: number of frames of a small mesh")
    parser.add_argument("--seed", type=int, default=0, help="seed of what is lost")
    arguments = parser.parse_args()
    if (arguments.minutes is None) == (arguments.frames is None):
        parser.error("give either MINUTES or --frames")
    all_ = stations(arguments.seed, small=arguments.frames is not None)
    times: dict[str, list[float]] = {name: [] for name in all_}
    memory: list[float] = []
    wrong: list[str] = []
    began, number, progress = time.monotonic(), 0, 0.0
    while progress < 1:
        for name, station in all_.items():
            before = time.thread_time()
            made = station.frame(number)
            times[name].append(time.thread_time() - before)
            if not np.isfinite(made).all():
                wrong.append(f"{name}, frame {number}: a position is not finite")
        memory.append(resident())
        number += 1
        progress = (
            number * len(all_) / arguments.frames
            if arguments.frames
            else ((time.monotonic() - began) / (60 * arguments.minutes))
        )
    # The first third is left out, as memory for the largest frames is allocated there.
    growth = float(
        np.median(memory[-number // 10 :]) - np.median(memory[number // 3 :][: number // 10])
    )
    print(f"memory: {max(memory):.1f} MB at most, {growth:+.2f} MB after the first third")
    if growth > MOST_GROWTH * max(memory) + MOST_GROWTH_MB:
        wrong.append(f"memory grew by {growth:.1f} MB after the first third")
    for name, station in all_.items():
        first, last = (
            np.median(part) for part in (times[name][: number // 3], times[name][-number // 3 :])
        )
        print(f"{name}: {1e3 * last:.3f} ms a frame, {last / first:.2f} of the first third")
        if (arguments.minutes or 0) >= SHORTEST_JUDGED and last > MOST_SLOWDOWN * first:
            wrong.append(f"{name}: the last third was slower by a factor of {last / first:.2f}")
        if station.lost > MOST_LOST * number:
            wrong.append(f"{name}: lost the surface in {station.lost} of {number} frames")
    print(f"{number * len(all_)} frames in {time.monotonic() - began:.0f} s")
    for one in wrong[:20]:
        print(one, file=sys.stderr)
    print(f"{len(wrong)} violations")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
