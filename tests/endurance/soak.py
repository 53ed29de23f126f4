"""Runs completers and trackers for a long time, with all that can go wrong in a live capture.

    script/soak MINUTES             frames one after another
    script/soak --frames 1000000    this many frames of a small mesh

Prints events and memory, also when it is interrupted. The exit code is 1 if any check
fails.
"""

import argparse
import sys
import time
from collections import Counter
from typing import Any

import numpy as np
from measures import Memory
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from scan_stations import ScanStation
from stations import Station
from watched import Watched

import dynmesh
from dynmesh import _core

MOST_GROWTH = 0.02  # of the memory, plus
MOST_GROWTH_MB = 2.0
MOST_SLOWDOWN = 1.5  # of the median, from the first third of a run to the last
MOST_LOST = 0.25  # of the sound scans; about 0.04 are usual, and 0.08 to 0.16 of small meshes
SHORTEST_JUDGED = 1.0  # minutes; a shorter run cannot show a slowdown


def main() -> None:
    """Runs the completers and prints a report."""
    arguments = _arguments()
    small = arguments.frames is not None
    _share_work(small=small)
    stations = _stations(arguments.seed, small=small)
    memory = Memory()
    began = time.monotonic()
    try:
        _run(stations, memory, arguments)
    except KeyboardInterrupt:
        print("interrupted; so far:", file=sys.stderr)
    seconds = time.monotonic() - began
    _print(Console(width=100), stations, memory)
    n_frames = sum(station.events.total() for station in stations)
    print(f"{n_frames} frames in {seconds:.0f} s")
    violations = [violation for station in stations for violation in station.violations]
    violations += (
        _not_steady(stations, memory, arguments.minutes) + _not_shared(stations) + _lost(stations)
    )
    for violation in violations[:20]:
        print(violation, file=sys.stderr)
    print(f"{len(violations)} violations")
    sys.exit(1 if violations else 0)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="script/soak", description=__doc__.split("\n")[0])
    parser.add_argument("minutes", nargs="?", type=float, help="duration of the run")
    parser.add_argument("--frames", type=int, help="instead: number of frames of a small mesh")
    parser.add_argument("--seed", type=int, default=0, help="seed of the events")
    arguments = parser.parse_args()
    if (arguments.minutes is None) == (arguments.frames is None):
        parser.error("give either MINUTES or --frames")
    return arguments


def _share_work(*, small: bool) -> None:
    """Makes the completers and trackers with two threads share work between them.

    For motion, the usual settings are kept. For detail, only large meshes are usually shared, which
    take long, so its pieces are smaller here. The pieces of the small mesh are so short that every
    call waits for the other thread, which would otherwise start too late.
    """
    if small:
        _core._set_task_sharing(chunk=2, short_chunk=2, fewest_pieces=2, patience=1000)
    else:
        _core._set_task_sharing(chunk=1024, short_chunk=16, fewest_pieces=24, patience=0)


def _stations(seed: int, *, small: bool) -> list[Watched[Any]]:
    """Creates completers of both methods, and trackers, of both precisions and several settings."""

    def ocean(grid: int) -> dynmesh.Sequence:
        return dynmesh.synth.ocean(60, grid=min(grid, 8) if small else grid, seed=3)

    large = ocean(8) if small else dynmesh.synth.walker(60)
    shared = 1 if small else 2  # a tracker waits for the other thread hundreds of times per frame
    motion = {"method": "motion"}
    noisy = {"noise": 1e-3, "reject_outliers": True}
    kinds: list[tuple[str, dynmesh.Sequence, type[np.floating[Any]], dict[str, Any]]] = [
        ("motion", large, np.float32, motion),
        ("motion, 2 threads", ocean(160), np.float32, motion | {"threads": 2}),
        ("motion, float64, 5 extra", ocean(50), np.float64, motion | {"extra_iterations": 5}),
        (
            "motion, once only",
            ocean(50),
            np.float32,
            motion | {"revisit": False, "disconnected": "hold"},
        ),
        ("detail", ocean(50), np.float32, {"method": "detail"}),
        (
            "detail, noise, 2 threads",
            ocean(25),
            np.float64,
            {"method": "detail", "threads": 2, **noisy},
        ),
        ("tracker, float64", ocean(14), np.float64, {}),
        ("tracker, errors", ocean(14), np.float32, {"threads": shared, "uncertainty": True}),
    ]
    made: list[Watched[Any]] = []
    for name, mesh, dtype, settings in kinds:
        station = ScanStation if name.startswith("tracker") else Station
        frames, faces = mesh.vertices.astype(dtype, copy=False), mesh.faces.astype(np.int32)
        made.append(station(name, frames, faces, seed + len(made), **settings))
    return made


def _run(stations: list[Watched[Any]], memory: Memory, arguments: argparse.Namespace) -> None:
    """Gives every station a frame, again and again."""
    whole = arguments.frames
    seconds = 60 * (arguments.minutes or 0.0)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    began = looked = time.monotonic()
    done = 0
    with Progress(
        *columns, TimeRemainingColumn(), console=Console(stderr=True), auto_refresh=False
    ) as bar:
        task = bar.add_task("frames" if whole else "seconds", total=whole or seconds)
        while True:
            now = time.monotonic()
            progress = done / whole if whole else (now - began) / seconds
            if progress >= 1:
                return
            if now - looked > 0.5:
                looked = now
                memory.sample()
                bar.update(task, completed=done if whole else int(now - began), refresh=True)
            for station in stations:
                station.step(progress)
            done += len(stations)


def _print(console: Console, stations: list[Watched[Any]], memory: Memory) -> None:
    for title, counts in (
        ("What happened", [station.events for station in stations]),
        ("Refused as expected", [station.refusals for station in stations]),
    ):
        table = Table("", "times", title=title, title_justify="left")
        for what, count in sum(counts, Counter[str]()).most_common():
            table.add_row(what, str(count))
        table.add_row("all", str(sum(c.total() for c in counts)))
        console.print(table)
    for station in stations:
        if station.threads > 1:
            print(
                f"{station.name}: other threads did {station.pieces_done_by_others} pieces of work"
            )
    print(f"memory: {memory.peak:.1f} MB at most, {memory.growth:+.2f} MB after the first third")


def _slowdown(station: Watched[Any]) -> float:
    """Of the median."""
    first, _, last = (third.median for third in station.processor_times)
    return last / first


def _not_shared(stations: list[Watched[Any]]) -> list[str]:
    """Returns the stations whose additional threads did no work."""
    return [
        f"{station.name}: no other thread did a piece of the work"
        for station in stations
        if station.threads > 1 and station.events and not station.pieces_done_by_others
    ]


def _lost(stations: list[Watched[Any]]) -> list[str]:
    """Returns the trackers that often did not find the surface."""
    return [
        f"{station.name}: did not find the surface in {station.lost} of {station.sound} sound scans"
        for station in stations
        if isinstance(station, ScanStation) and station.lost > MOST_LOST * station.sound
    ]


def _not_steady(stations: list[Watched[Any]], memory: Memory, minutes: float | None) -> list[str]:
    """What became larger or slower.

    Times are not judged in a run of a number of frames, whose duration says nothing but how busy
    the machine is.
    """
    found = []
    if memory.growth > MOST_GROWTH * memory.peak + MOST_GROWTH_MB:
        found.append(f"memory grew by {memory.growth:.1f} MB after the first third")
    if minutes is not None and minutes >= SHORTEST_JUDGED:
        found += [
            f"{station.name}: the last third was slower by a factor of {_slowdown(station):.2f}"
            for station in stations
            if _slowdown(station) > MOST_SLOWDOWN
        ]
    return found


if __name__ == "__main__":
    main()
