"""Measures the time of a frame over the size of the mesh, beside libigl.

    script/bench [--quick] [--docs] [--out FOLDER]

The table is printed in Markdown. It is also written to FOLDER, as CSV, with the figure, and with
--docs to docs. What cannot run here is left out, and standard error names the reason.
"""

import argparse
import gc
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist

from dynmesh import synth
from dynmesh.sequence import Mask

from .harness import ABSENT, DOCS, Line, Table, add_arguments, milliseconds, show
from .methods import ARAP, BIHARMONIC, DETAIL, MOTION, Method, dynmesh_method
from .runner import run
from .style import new_figure, save
from .subjects import Subject, losses

TWO_THREADS = dynmesh_method("motion, two threads", "#56b4e9", "--", method="motion", threads=2)
SLOW = (DETAIL, BIHARMONIC, ARAP)
"""The methods that solve a system for each frame. They take ten to two thousand times as long."""

SHARED_FROM = 23_553
"""The number of vertices from which on method motion uses more than one thread."""

LAPS = 2
"""The number of times that the fast methods complete all frames."""

SLOW_FRAMES = 2
"""The number of frames that the slow methods complete."""


GRIDS = (32, 56, 100, 178, 316, 562, 1000)
"""The numbers of vertices along a side of the meshes; with --quick, the last two are left out."""

FRAMES = 49
"""The largest number of frames that are completed; of large meshes, there are fewer."""

SLOW_LIMIT = 32_000
"""The largest number of vertices for which slow methods are measured."""

Times = dict[Method, dict[int, float]]
"""The median seconds of a frame of each method, by number of vertices."""


def times(subject: Subject, masks: list[Mask], methods: Iterable[Method]) -> dict[Method, float]:
    """Return the median seconds of a frame of each method that can run here, in wall time.

    The fast methods take turns, so that a disturbance affects all of them. Each completes many
    frames in a row, as in use, when its data are in the caches of the processor.
    """
    found: dict[Method, list[float]] = {}
    for lap, method in product(range(LAPS), methods):
        n = 1 + min(SLOW_FRAMES if method in SLOW else len(masks), len(masks) - 1)
        if method in SLOW and lap > 0:
            continue
        frames = replace(subject, vertices=subject.vertices[:n])
        try:
            new = run(frames, method, masks[:n], clock=time.perf_counter)
        except (ImportError, ValueError) as error:
            print(f"left out: {method.label}: {error}", file=sys.stderr)
            continue
        found.setdefault(method, []).extend(new.seconds)
    return {method: float(np.median(seconds)) for method, seconds in found.items()}


def sizes(grids: Sequence[int], folders: Sequence[Path]) -> Table:
    """Measure seas on grids of several sizes, the slow methods on the smaller ones."""
    by_loss: dict[str, Times] = {}
    for side in grids:
        n_frames = max(2, min(FRAMES, 2_000_000 // side**2))
        waves = synth.ocean(n_frames + 1, grid=side)
        vertices = np.ascontiguousarray(waves.vertices, np.float32)  # the types of the library
        sea = Subject("sea", vertices, np.ascontiguousarray(waves.faces, np.int32), "z", 0)
        methods = [MOTION, *(SLOW if sea.n_vertices <= SLOW_LIMIT else ())]
        methods += [TWO_THREADS] if sea.n_vertices >= SHARED_FROM else []
        for loss, masks in losses(sea, (0.1, 0.5), ()).items():
            for method, seconds in times(sea, masks, methods).items():
                by_loss.setdefault(loss, {}).setdefault(method, {})[sea.n_vertices] = seconds
    counts = [side**2 for side in grids]
    lines: list[Line] = [("ms at so many vertices", *map(str, counts), "exponent")]
    for loss, by_method in by_loss.items():
        for method, found in by_method.items():
            cells = [milliseconds(found[n]) if n in found else ABSENT for n in counts]
            fitted = f"{_power_law(found)[0]:.2f}" if len(found) > 2 else ABSENT
            lines.append((f"{method.label}, {loss} known", *cells, fitted))
    _draw(by_loss, folders)
    return Table("sizes", lines)


def _power_law(found: dict[int, float]) -> tuple[float, float]:
    """Return the exponent and the logarithm of the factor of the law that fits best."""
    exponent, intercept = np.polyfit(np.log([*found]), np.log([*found.values()]), 1)
    return float(exponent), float(intercept)


def _draw(by_loss: dict[str, Times], folders: Sequence[Path]) -> None:
    """Draw the time over the size of the mesh."""
    handles: dict[str, Artist] = {}
    with new_figure(12, 5.6) as figure:
        axes = figure.subplots(1, len(by_loss), sharey=True)
        for axis, (loss, by_method) in zip(axes, by_loss.items(), strict=True):
            for method, found in by_method.items():
                counts, shown = np.array([*found]), 1e3 * np.array([*found.values()])
                (line,) = axis.plot(counts, shown, "o-", color=method.colour)
                handles[method.label] = line
                if method is MOTION:
                    exponent, intercept = _power_law(found)
                    fitted = 1e3 * np.exp(intercept) * counts**exponent
                    axis.plot(counts, fitted, "--", color="#000000", linewidth=1, zorder=3)
                    text = f"{MOTION.label}: vertices to the power of {exponent:.2f}"
                    axis.annotate(text, (0.98, 0.03), xycoords="axes fraction", ha="right")
            axis.set(title=f"{loss} known", xlabel="vertices", xscale="log", yscale="log")
        axes[0].set_ylabel("time of a frame / ms")
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4)
        for folder in folders:
            save(figure, folder / "size.png", is_chart=True)


def main() -> None:
    """Measure, draw, and print the table."""
    made = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    add_arguments(made, folder=False)
    made.set_defaults(out=Path("build/bench/results"))
    made.add_argument("--quick", action="store_true", help="measure less, in about a minute")
    arguments = made.parse_args()
    gc.disable()  # of Python, during measurements
    folders = [arguments.out, *([DOCS / "figures" / "speed"] if arguments.docs else [])]
    show(arguments, sizes(GRIDS[:5] if arguments.quick else GRIDS, folders))


if __name__ == "__main__":
    main()
