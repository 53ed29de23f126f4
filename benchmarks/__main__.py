"""Measures the speed of dynmesh, compared with other methods.

    script/bench [--quick] [--docs] [--only SECTION ...] [--out FOLDER]
    script/bench --instructions

Tables are printed in Markdown. They, the figures and all measurements are also written to FOLDER.
What cannot run here is shown as a dash, and standard error names the reason.
"""

import argparse
import functools
import sys
import time
from collections.abc import Callable
from pathlib import Path

from dynmesh.study.methods import MOTION

from . import cpp_calls, instructions, latency, overhead, page, plots, scenes, sizes, training
from .comparison import compare
from .methods import ON_ONE_THREAD, TWO_THREADS
from .plan import SpeedPlan
from .results import Results, machine
from .tables import tables

SECTIONS = (
    "low-resolution",
    "subdivided",
    "largest",
    "training",
    "sizes",
    "unknown",
    "overhead",
    "latency",
    "cpp",
    "instructions",
)


def main() -> None:
    """Run the sections that the arguments name."""
    arguments = _arguments()
    if arguments.instructions or arguments.record_instructions:
        sys.exit(_count_instructions(record=arguments.record_instructions))
    if arguments.results is not None:
        results = Results.read(arguments.results)
    else:
        plan = SpeedPlan()
        if arguments.tiny:
            plan = SpeedPlan.smallest()
        elif arguments.quick:
            plan = SpeedPlan.quick()
        results = measure(plan, arguments.only or SECTIONS)
        results.write(arguments.out / "results.json")
    for what, why in results.missing.items():
        print(f"left out: {what}: {why}", file=sys.stderr)
    made = tables(results)
    text = "\n\n".join(f"**{name}**\n\n{table}" for name, table in made.items())
    print(text)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "tables.md").write_text(text + "\n")
    plots.draw(results, arguments.out)
    if arguments.docs:
        page.rewrite(made, page.PAGE, page.MEASUREMENTS)
        plots.draw(results, page.PAGE.parent / "figures" / "speed")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="script/bench", description=__doc__.split("\n")[0])
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="measure less, in about a minute")
    size.add_argument(
        "--tiny", action="store_true", help="use small meshes, to check that everything runs"
    )
    parser.add_argument("--only", nargs="+", choices=SECTIONS, help="run these sections only")
    parser.add_argument(
        "--out", type=Path, default=Path("build/bench/results"), help="where to write the results"
    )
    parser.add_argument(
        "--results",
        type=Path,
        help="results.json of an earlier run to show again",
    )
    parser.add_argument(
        "--docs",
        action="store_true",
        help="rewrite the tables and figures in docs",
    )
    counting = parser.add_mutually_exclusive_group()
    counting.add_argument(
        "--instructions",
        action="store_true",
        help="only compare instruction counts",
    )
    counting.add_argument(
        "--record-instructions",
        action="store_true",
        help="record instruction counts",
    )
    return parser.parse_args()


def measure(plan: SpeedPlan, sections: tuple[str, ...] | list[str]) -> Results:
    """Run sections, and print on standard error how long each took."""
    results = Results(machine())
    missing = results.missing
    scene = scenes.low_resolution(plan)
    subdivided = functools.cache(lambda: scenes.subdivided(plan))

    def on_low_resolution() -> None:
        results.comparison += compare(
            scene, plan.laps, plan.slow_frames, missing, methods=ON_ONE_THREAD
        )

    def on_permuted(scene: scenes.Scene, laps: int) -> None:
        results.comparison += compare(
            scene.permuted(), laps, 0, missing, methods=[MOTION, TWO_THREADS], with_error=False
        )

    def on_largest() -> None:
        largest = scenes.largest(plan)
        results.comparison += compare(largest, plan.largest[2], 0, missing)
        on_permuted(largest, plan.largest[2])

    def on_subdivided() -> None:
        finer = subdivided()
        _, slow_frames, laps = plan.subdivided
        results.comparison += compare(finer, laps, slow_frames, missing)
        on_permuted(finer, laps)

    def count() -> None:
        results.instructions = instructions.measure()

    runs: dict[str, Callable[[], object]] = {
        "low-resolution": on_low_resolution,
        "subdivided": on_subdivided,
        "largest": on_largest,
        "training": lambda: results.training.extend(training.measure(scene, plan, missing)),
        "sizes": lambda: results.sizes.extend(sizes.against_size(plan)),
        "unknown": lambda: results.unknown.extend(sizes.against_unknown(scene, plan)),
        "overhead": lambda: results.overhead.extend(overhead.measure(scene, plan)),
        "latency": lambda: results.latency.extend(
            latency.measure(scene, subdivided(), plan, missing)
        ),
        "cpp": lambda: results.cpp.extend(cpp_calls.measure(plan)),
        "instructions": count,
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
    return results


def _count_instructions(*, record: bool) -> int:
    """Return the exit code: 1 if a count has grown, 2 if there is nothing to compare with."""
    try:
        counts = instructions.measure()
        if record:
            instructions.record(counts)
        found = instructions.changes(counts)
    except (ImportError, LookupError) as error:
        print(error, file=sys.stderr)
        return 2
    print(tables(Results(instructions=counts))["instructions"])
    for line in found:
        print(line, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    main()
