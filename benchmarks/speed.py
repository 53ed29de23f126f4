"""Measures the speed of dynmesh, compared with libigl, SciPy and a plain copy.

    script/bench [--quick] [--docs] [--only comparison|sizes] [--out FOLDER]
    script/bench --instructions compare|record

Tables are printed in Markdown. They are also written to FOLDER, as CSV, with the figures, and with
--docs to docs. What cannot run here is left out, and standard error names the reason.
"""

import gc
import importlib.metadata
import os
import platform
import re
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from dynmesh import synth
from dynmesh.sequence import Mask

from . import harness, instructions
from .cells import ABSENT, NMSVE_UNIT, Line, milliseconds, nmsve_cell, number, ratio
from .harness import DOCS, Table, show
from .methods import ARAP, BIHARMONIC, COPY, DETAIL, HARMONIC, MOTION, SCIPY, Method, dynmesh_method
from .runner import Run, run
from .style import NMSVE_LABEL, new_figure, save
from .subjects import Subject, from_file, losses

TWO_THREADS = dynmesh_method("motion, two threads", "#56b4e9", "--", method="motion", threads=2)
SLOW = (DETAIL, SCIPY, HARMONIC, BIHARMONIC, ARAP)
"""The methods that solve a system for each frame. They take ten to two thousand times as long."""

ON_ONE_THREAD = (MOTION, COPY, *SLOW)
SHARED_FROM = 23_553
"""The number of vertices from which on method motion uses more than one thread."""


@dataclass(frozen=True)
class Plan:
    """How much is measured. The defaults are those of the pages in docs.

    Attributes:
        frames: the number of frames of the person, frame 0 included.
        slow_frames: the number of frames that the slow methods complete.
        laps: the number of times that the fast methods complete all frames.
        grids: the numbers of vertices along a side of the meshes over which time is drawn.
        slow_limit: the largest number of vertices for which slow methods are drawn there.
    """

    frames: int = 100
    slow_frames: int = 99
    laps: int = 8
    grids: tuple[int, ...] = (32, 56, 100, 178, 316, 562, 1000)
    slow_limit: int = 32_000


QUICK = Plan(11, 2, 3, (32, 56, 100, 178, 316), 4_000)
"""Takes about a minute."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """The runs on one mesh, in wall time, by the name of the loss and the method."""

    subject: Subject
    runs: dict[str, dict[Method, Run]]

    @property
    def methods(self) -> list[Method]:
        """The methods that could run here."""
        return list(dict.fromkeys(method for runs in self.runs.values() for method in runs))

    def seconds(self, method: Method) -> list[float]:
        """Return the median time of a method with each loss."""
        return [runs[method].usual_seconds for runs in self.runs.values()]

    def errors(self, method: Method) -> list[float]:
        """Return the mean NMSVE with each loss over the frames that all methods completed."""
        return [float(np.mean(runs[method].nmsve[: _fewest(runs)])) for runs in self.runs.values()]


def _fewest(runs: dict[Method, Run]) -> int:
    return min(len(run.nmsve) for run in runs.values())


def compare(
    subject: Subject,
    masks: dict[str, list[Mask]],
    laps: int,
    slow_frames: int,
    methods: Iterable[Method],
    *,
    with_error: bool = True,
) -> Comparison:
    """Measure methods with every loss.

    The fast methods take turns, so that a disturbance affects all of them. Each completes many
    frames in a row, as in use, when its data are in the caches of the processor.

    Args:
        subject: the sequence, in the types of the C++ library.
        masks: the known masks of every frame by the name of the loss.
        laps: the number of times that the fast methods complete all frames.
        slow_frames: the number of frames that the slow methods complete; 0 leaves these out.
        methods: the methods.
        with_error: whether NMSVE is measured, in the first lap.
    """
    found: dict[str, dict[Method, Run]] = {loss: {} for loss in masks}
    with _no_collection():
        for (loss, of_loss), lap, method in product(masks.items(), range(laps), methods):
            slow = method in SLOW
            n = 1 + (min(slow_frames, len(of_loss) - 1) if slow else len(of_loss) - 1)
            if n == 1 or (slow and lap > 0):
                continue
            frames = replace(subject, vertices=subject.vertices[:n])
            measured = with_error and method is not COPY and lap == 0
            clock = time.perf_counter
            try:
                new = run(frames, method, of_loss[:n], with_error=measured, clock=clock)
            except (ImportError, ValueError) as error:
                print(f"left out: {method.label}: {error}", file=sys.stderr)
                continue
            of_method = found[loss].setdefault(method, new)
            if of_method is not new:
                of_method.seconds = np.concatenate([of_method.seconds, new.seconds])
    return Comparison(subject, found)


@contextmanager
def _no_collection() -> Iterator[None]:
    """Keep the garbage collector of Python from running during a measurement."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def _in_types_of_the_library(subject: Subject) -> Subject:
    vertices = np.ascontiguousarray(subject.vertices, np.float32)
    return replace(subject, vertices=vertices, faces=np.ascontiguousarray(subject.faces, np.int32))


def comparison(plan: Plan, folders: list[Path]) -> list[Table]:
    """Measure all methods on the recorded person if it is there, else the walker.

    Both have 10 002 vertices.
    """
    repository = Path(__file__).parents[1]
    folder = Path(os.environ.get("DYNMESH_DATA", repository.parent / "shared" / "data"))
    if (path := folder / "crane.npz").exists():
        subject = from_file(path, plan.frames)
    else:
        subject = Subject.of("walker", synth.walker(), "z", 0, plan.frames)
    subject = _in_types_of_the_library(subject)
    found = compare(subject, losses(subject), plan.laps, plan.slow_frames, ON_ONE_THREAD)
    _draw_error_and_time(found, folders)
    return [Table("speed", ratios(found)), Table("speed-errors", errors(found))]


def ratios(found: Comparison) -> list[Line]:
    """Tabulate the times relative to motion, and that of motion relative to the copy."""
    subject, own = found.subject, found.seconds(MOTION)
    lines: list[Line] = [(f"{subject.name}, {subject.n_vertices} vertices", *found.runs)]
    for method in found.methods:
        theirs = found.seconds(method)
        if method is MOTION:
            lines.append((f"{method.label}, ms", *map(milliseconds, own)))
        elif method is COPY:
            lines.append((f"motion, times a {method.label}", *map(ratio, own, theirs)))
        else:
            lines.append((f"{method.label}, times motion", *map(ratio, theirs, own)))
    return lines


def errors(found: Comparison) -> list[Line]:
    """Tabulate the errors relative to motion."""
    own = found.errors(MOTION)
    lines: list[Line] = [("NMSVE", *found.runs), (f"{MOTION.label}, x 1e4", *map(nmsve_cell, own))]
    for method in found.methods:
        if method not in (MOTION, COPY):
            pairs = zip(found.errors(method), own, strict=True)
            cells = [f"{a / b:.2f}" if a < b else number(a / b) for a, b in pairs]
            lines.append((f"{method.label}, times motion", *cells))
    return lines


def sizes(plan: Plan, folders: list[Path]) -> list[Table]:
    """Measure seas on grids of several sizes, the slow methods on the smaller ones."""
    rows = []
    for side in plan.grids:
        n_frames = max(2, min((plan.frames - 1) // 2, 2_000_000 // side**2))
        sea = Subject.of("sea", synth.ocean(n_frames + 1, grid=side), "z", 0, None)
        sea = _in_types_of_the_library(sea)
        slow_frames = 2 if sea.n_vertices <= plan.slow_limit else 0
        shared = (TWO_THREADS,) if sea.n_vertices >= SHARED_FROM else ()
        masks = losses(sea, (0.1, 0.5), ())
        methods = (*ON_ONE_THREAD, *shared)
        rows.append(compare(sea, masks, 2, slow_frames, methods, with_error=False))
    counts = [row.subject.n_vertices for row in rows]
    lines: list[Line] = [("ms at so many vertices", *map(str, counts), "exponent")]
    for place, loss in enumerate(rows[0].runs):
        for method in dict.fromkeys(method for row in rows for method in row.methods):
            times = _times(rows, method, place)
            cells = [milliseconds(times[n]) if n in times else ABSENT for n in counts]
            fitted = f"{_power_law(times)[0]:.2f}" if len(times) > 2 else ABSENT
            lines.append((f"{method.label}, {loss} known", *cells, fitted))
    _draw_sizes(rows, folders)
    return [Table("sizes", lines)]


def _times(rows: Sequence[Comparison], method: Method, place: int) -> dict[int, float]:
    """Return the seconds by number of vertices, with the loss of a number."""
    return {
        row.subject.n_vertices: row.seconds(method)[place] for row in rows if method in row.methods
    }


def _power_law(times: dict[int, float]) -> tuple[float, float]:
    """Return the exponent and the logarithm of the factor of the law that fits best."""
    exponent, intercept = np.polyfit(np.log([*times]), np.log([*times.values()]), 1)
    return float(exponent), float(intercept)


def _draw_error_and_time(found: Comparison, folders: list[Path]) -> None:
    """Draw error against time on one mesh, with a panel for each loss."""
    with new_figure(12, 6.6) as figure:
        axes = figure.subplots(2, 3, sharex=True, sharey=True)
        for axis, (loss, runs) in zip(axes.ravel(), found.runs.items(), strict=True):
            for method, run in runs.items():
                time = 1e3 * run.usual_seconds
                if method is COPY:
                    axis.axvline(time, color=COPY.colour, linestyle="--", label=COPY.label)
                else:
                    error = np.mean(run.nmsve[: _fewest(runs)]) / NMSVE_UNIT
                    style = {"color": method.colour, "label": method.label}
                    axis.plot(time, error, "o", markersize=9, **style)
            axis.set(title=_title(loss), xscale="log", yscale="log")
        for axis in axes[-1]:
            axis.set_xlabel("time of a frame / ms")
        for axis in axes[:, 0]:
            axis.set_ylabel(NMSVE_LABEL)
        _save(figure, folders, "error_and_time.png")


def _draw_sizes(rows: Sequence[Comparison], folders: list[Path]) -> None:
    """Draw the time over the size of the mesh."""
    with new_figure(12, 5.6) as figure:
        axes = figure.subplots(1, len(rows[0].runs), sharey=True)
        for place, (axis, loss) in enumerate(zip(axes, rows[0].runs, strict=True)):
            for method in dict.fromkeys(method for row in rows for method in row.methods):
                times = _times(rows, method, place)
                counts, shown = np.array([*times]), 1e3 * np.array([*times.values()])
                axis.plot(counts, shown, "o-", color=method.colour, label=method.label)
                if method is MOTION:
                    exponent, intercept = _power_law(times)
                    fitted = 1e3 * np.exp(intercept) * counts**exponent
                    axis.plot(counts, fitted, "--", color="#000000", linewidth=1, zorder=3)
                    text = f"{MOTION.label}: vertices to the power of {exponent:.2f}"
                    axis.annotate(text, (0.98, 0.03), xycoords="axes fraction", ha="right")
            axis.set(title=_title(loss), xlabel="vertices", xscale="log", yscale="log")
        axes[0].set_ylabel("time of a frame / ms")
        _save(figure, folders, "size.png")


def _title(loss: str) -> str:
    return f"{loss} known" if "%" in loss else loss


def _save(figure: Figure, folders: list[Path], name: str) -> None:
    handles: dict[str, Artist] = {}
    for axis in figure.axes:
        found = axis.get_legend_handles_labels()
        handles |= dict(zip(found[1], found[0], strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4)
    for folder in folders:
        save(figure, folder / name, is_chart=True)


def machine() -> str:
    """Describe the processor and the versions of the software in a line."""
    information = Path("/proc/cpuinfo")
    text = information.read_text() if information.exists() else ""
    named = re.search(r"^model name\s*: (.*)$", text, re.MULTILINE)
    processor = named[1].strip() if named else platform.processor() or platform.machine()
    packages = ("numpy", "scipy", "libigl")
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in packages)
    python = f"Python {platform.python_version()}"
    return f"{processor}, {os.cpu_count()} cores; {platform.system()}; {python}, {versions}"


SECTIONS = {"comparison": comparison, "sizes": sizes}


def main() -> None:
    """Run the sections that the arguments name."""
    made = harness.parser(__doc__, folder=False)
    made.set_defaults(out=Path("build/bench/results"))
    made.add_argument("--quick", action="store_true", help="measure less, in about a minute")
    made.add_argument("--only", choices=SECTIONS, help="run this section only")
    made.add_argument(
        "--instructions", choices=("compare", "record"), help="only count instructions of a frame"
    )
    arguments = made.parse_args()
    if arguments.instructions:
        sys.exit(instructions.main(record=arguments.instructions == "record"))
    folders = [arguments.out, *([DOCS / "figures" / "speed"] if arguments.docs else [])]
    plan = QUICK if arguments.quick else Plan()
    chosen = [arguments.only] if arguments.only else [*SECTIONS]
    print(f"{machine()}\n")
    show(arguments, *(table for name in chosen for table in SECTIONS[name](plan, folders)))


if __name__ == "__main__":
    main()
