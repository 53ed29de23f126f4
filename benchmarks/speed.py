"""Measures the time of a frame over the size of the mesh, beside libigl, and the slowest frames.

    script/dev/bench [--quick] [--docs] [--out FOLDER] [--only sizes|latency]

The tables are printed in Markdown. They are also written to FOLDER, as CSV, and with --docs to
docs/tables. What cannot run here is left out, and standard error names the reason.
"""

import argparse
import gc
import sys
import time
from collections.abc import Iterable, Sequence
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from dynmesh import synth
from dynmesh._arrays import Mask

from .harness import ABSENT, Line, Table, add_arguments, milliseconds, show
from .methods import ARAP, BIHARMONIC, DETAIL, MOTION, Method, dynmesh_method
from .runner import run
from .subjects import PAPER_SHARES, Subject, losses_of, percent, random_masks

TWO_THREADS = dynmesh_method("detail (dynmesh), two threads", DETAIL.colour, "--", threads=2)

SLOW = (BIHARMONIC, ARAP)
"""The methods that take up to a thousand times as long, and are measured on small meshes alone."""

SLOW_LIMIT = 20_000
"""The largest number of vertices for which slow methods are measured."""

LAPS = 3
"""The number of times that each method completes all frames."""

GRIDS = (50, 100, 141, 224, 447)
"""The numbers of vertices along a side of the meshes; with --quick, the last two are left out."""

FRAMES = 20
"""The number of frames that are completed."""

KNOWN = 0.3
"""The share of vertices that are known, at random."""

STEADY_GRIDS = (50, 100)
STEADY_FRAMES = 120
"""The meshes and the number of frames of which the slowest are compared with the others."""


def times(subject: Subject, masks: list[Mask], methods: Iterable[Method]) -> dict[Method, float]:
    """Return the seconds of a frame of each method that can run here.

    Each method completes many frames in a row, as in use, when its data are in the caches of the
    processor, and the median counts. Of several laps, in which the methods take turns, the least
    counts, since whatever else runs can only lengthen it.
    """
    found: dict[Method, float] = {}
    for _, method in product(range(LAPS), methods):
        try:
            seconds = run(subject, method, masks, clock=time.perf_counter).usual_seconds
        except (ImportError, ValueError) as error:
            print(f"left out: {method.label}: {error}", file=sys.stderr)
            continue
        found[method] = min(seconds, found.get(method, seconds))
    return found


def sea_of(side: int, frames: int) -> Subject:
    """Return a sea on a grid, after frame 0 with so many frames."""
    waves = synth.ocean(frames + 1, grid=side)
    vertices = np.ascontiguousarray(waves.vertices, np.float32)  # the types of the library
    return Subject("sea", vertices, np.ascontiguousarray(waves.faces, np.int32), "z", 0)


def sizes(grids: Sequence[int]) -> Table:
    """Measure seas on grids of several sizes, the slow methods on the smaller ones."""
    by_method: dict[Method, dict[int, float]] = {}
    for side in grids:
        sea = sea_of(side, FRAMES)
        methods = [MOTION, DETAIL, TWO_THREADS, *(SLOW if sea.n_vertices <= SLOW_LIMIT else ())]
        for method, seconds in times(sea, list(random_masks(sea, KNOWN)), methods).items():
            by_method.setdefault(method, {})[sea.n_vertices] = seconds
    counts = [side**2 for side in grids]
    corner = f"ms at so many vertices, {percent(KNOWN)} known"
    lines: list[Line] = [(corner, *map(str, counts), "exponent")]
    for method, found in by_method.items():
        cells = [milliseconds(found[n]) if n in found else ABSENT for n in counts]
        fitted = f"{_exponent(found):.2f}" if len(found) > 2 else ABSENT
        lines.append((method.label, *cells, fitted))
    return Table("sizes", lines)


def latency(grids: Sequence[int]) -> Table:
    """The 99th percentile of the time of a frame over the median, where one mask stays.

    Of each frame, the least processor time of several laps counts. The first frame, whose mask is
    new, does not.
    """
    lines: list[Line] = []
    for side in grids:
        sea = sea_of(side, STEADY_FRAMES)
        of_frames = losses_of(sea, PAPER_SHARES)
        steady = {name: [masks[1]] * sea.n_frames for name, masks in of_frames.items()}
        lines = lines or [("99th percentile / median", "vertices", *steady)]
        for method in (MOTION, DETAIL, TWO_THREADS):
            clock = time.process_time if method is TWO_THREADS else time.thread_time
            cells = []
            for masks in steady.values():
                laps = [run(sea, method, masks, clock=clock).seconds[1:] for _ in range(LAPS)]
                least = np.min(laps, axis=0)
                cells.append(f"{np.percentile(least, 99) / np.median(least):.2f}")
            lines.append((method.label, str(sea.n_vertices), *cells))
    return Table("latency", lines)


def _exponent(found: dict[int, float]) -> float:
    return float(np.polyfit(np.log([*found]), np.log([*found.values()]), 1)[0])


def main() -> None:
    """Measure, and print the table."""
    made = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    add_arguments(made, folder=False)
    made.set_defaults(out=Path("build/bench/results"))
    made.add_argument("--quick", action="store_true", help="measure less, in about a minute")
    made.add_argument("--only", choices=["sizes", "latency"], help="make one table alone")
    arguments = made.parse_args()
    gc.disable()  # of Python, during measurements
    measured = {
        "sizes": partial(sizes, GRIDS[:3] if arguments.quick else GRIDS),
        "latency": partial(latency, STEADY_GRIDS[:1] if arguments.quick else STEADY_GRIDS),
    }
    show(arguments, *(made() for name, made in measured.items() if arguments.only in (None, name)))


if __name__ == "__main__":
    main()
