"""Measures the speed of dynmesh, compared with other methods.

    script/bench [--quick] [--docs] [--only SECTION ...] [--csv FOLDER]
    script/bench --instructions

Tables are printed in Markdown. They are also written to FOLDER, as CSV, with the figures, and with
--docs to docs. What cannot run here is shown as a dash, and standard error names the reason.
"""

import argparse
import functools
import sys
import time
from collections.abc import Callable
from pathlib import Path

from dynmesh.study.methods import MOTION

from .. import harness
from ..harness import DOCS, Table, show
from ..methods import ON_ONE_THREAD, TWO_THREADS
from . import instructions, plots, scenes, tables
from .calls import latency, latency_table, overhead_table
from .comparison import Comparison, against_size, compare
from .plan import SpeedPlan

SECTIONS = (
    "low-resolution",
    "subdivided",
    "largest",
    "sizes",
    "overhead",
    "latency",
    "instructions",
)


def main() -> None:
    """Run the sections that the arguments name."""
    arguments = _arguments()
    if arguments.instructions or arguments.record_instructions:
        sys.exit(_count_instructions(arguments))
    plan = SpeedPlan()
    if arguments.tiny:
        plan = SpeedPlan.smallest()
    elif arguments.quick:
        plan = SpeedPlan.quick()
    arguments.csv.mkdir(parents=True, exist_ok=True)
    folders = [arguments.csv, DOCS / "figures" / "speed"] if arguments.docs else [arguments.csv]
    missing: dict[str, str] = {}
    made = measure(plan, arguments.only or SECTIONS, missing, folders)
    for what, why in missing.items():
        print(f"left out: {what}: {why}", file=sys.stderr)
    show(arguments, tables.machine(), *made)


def _arguments() -> argparse.Namespace:
    parser = harness.parser(__doc__, folder=False)
    parser.set_defaults(csv=Path("build/bench/results"))
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="measure less, in about a minute")
    size.add_argument(
        "--tiny", action="store_true", help="use small meshes, to check that everything runs"
    )
    parser.add_argument("--only", nargs="+", choices=SECTIONS, help="run these sections only")
    counting = parser.add_mutually_exclusive_group()
    counting.add_argument(
        "--instructions", action="store_true", help="only compare instruction counts"
    )
    counting.add_argument(
        "--record-instructions", action="store_true", help="record instruction counts"
    )
    return parser.parse_args()


def measure(
    plan: SpeedPlan, sections: tuple[str, ...], missing: dict[str, str], folders: list[Path]
) -> list[Table]:
    """Run sections, draw their figures, and print on standard error how long each took."""
    made: list[Table] = []
    permuted: list[tuple[Comparison, Comparison]] = []
    scene = scenes.low_resolution(plan)
    subdivided = functools.cache(lambda: scenes.subdivided(plan))

    def on_low_resolution() -> None:
        found = compare(scene, plan.laps, plan.slow_frames, missing, ON_ONE_THREAD)
        made.extend(tables.of_comparison("low-resolution", found))
        plots.error_and_time(found, folders)

    def compared(part: str, scene: scenes.Scene, laps: int, slow_frames: int) -> None:
        found = compare(scene, laps, slow_frames, missing)
        made.extend(tables.of_comparison(part, found))
        fast = (MOTION, TWO_THREADS)
        shuffled = compare(scene.permuted(), laps, 0, missing, fast, with_error=False)
        permuted.append((found, shuffled))

    def on_sizes() -> None:
        found = [*against_size(plan)]
        made.append(tables.sizes(found))
        plots.size(found, folders)

    def on_latency() -> None:
        rows = [*latency(scene, subdivided(), plan)]
        made.append(latency_table(rows))
        plots.latency(rows, folders)

    runs: dict[str, Callable[[], object]] = {
        "low-resolution": on_low_resolution,
        "subdivided": lambda: compared("subdivided", subdivided(), 5, plan.slow_frames),
        "largest": lambda: compared("largest", scenes.largest(plan), 2, 0),
        "sizes": on_sizes,
        "overhead": lambda: made.append(overhead_table(scene, plan)),
        "latency": on_latency,
        "instructions": lambda: made.append(instructions.table(instructions.measure())),
    }
    for section, run in runs.items():
        if section not in sections:
            continue
        start = time.monotonic()
        try:
            run()
        except ImportError as error:
            missing[section] = str(error)
        print(f"{section}: {time.monotonic() - start:.0f} s", file=sys.stderr)
    if permuted:
        made.append(tables.numbering(permuted))
    return made


def _count_instructions(arguments: argparse.Namespace) -> int:
    """Return the exit code: 1 if a count has grown, 2 if there is nothing to compare with."""
    try:
        counts = instructions.measure()
        if arguments.record_instructions:
            instructions.record(counts)
        found = instructions.changes(counts)
    except (ImportError, LookupError) as error:
        print(error, file=sys.stderr)
        return 2
    print(instructions.table(counts).text())
    for line in found:
        print(line, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    main()
