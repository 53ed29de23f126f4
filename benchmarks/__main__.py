"""Measures how fast dynmesh is, beside what else one could use.

    script/bench [--quick] [--docs] [--only SECTION ...] [--out FOLDER]
    script/bench --instructions

Prints tables in Markdown; writes them, figures and everything that was measured to FOLDER. What
cannot run here stands as a dash, and is named on standard error with the reason.
"""

import argparse
import functools
import sys
import time
from collections.abc import Callable
from pathlib import Path

from . import cpp_calls, instructions, latency, overhead, page, plots, scenes, sizes
from .comparison import compare
from .plan import Plan
from .results import Results, machine
from .rivals import DYNMESH, ON_ONE_THREAD, TWO_THREADS
from .tables import tables

SECTIONS = (
    "low-resolution",
    "subdivided",
    "largest",
    "sizes",
    "unknown",
    "overhead",
    "latency",
    "cpp",
    "instructions",
)


def main() -> None:
    """Measures what is asked for."""
    arguments = _arguments()
    if arguments.instructions or arguments.record_instructions:
        sys.exit(_count_instructions(record=arguments.record_instructions))
    if arguments.results is not None:
        results = Results.read(arguments.results)
    else:
        plan = Plan.smallest() if arguments.tiny else Plan.quick() if arguments.quick else Plan()
        results = measure(plan, arguments.only or SECTIONS)
        results.write(arguments.out / "results.json")
    for what, why in results.missing.items():
        print(f"without {what}: {why}", file=sys.stderr)
    made = tables(results)
    text = "\n\n".join(f"**{name}**\n\n{table}" for name, table in made.items())
    print(text)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "tables.md").write_text(text + "\n")
    plots.draw(results, arguments.out)
    if arguments.docs:
        page.rewrite(made)
        plots.draw(results, page.PAGE.parent / "figures" / "speed")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="script/bench", description=__doc__.split("\n")[0])
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="in about a minute")
    size.add_argument("--tiny", action="store_true", help="small meshes, to see that it runs")
    parser.add_argument("--only", nargs="+", choices=SECTIONS, help="leave out the others")
    parser.add_argument("--out", type=Path, default=Path("build/bench/results"))
    parser.add_argument("--results", type=Path, help="results.json of a run, to measure nothing")
    parser.add_argument("--docs", action="store_true", help="rewrite docs/speed.md and its figures")
    counting = parser.add_mutually_exclusive_group()
    counting.add_argument(
        "--instructions", action="store_true", help="compare counts with the reference, no more"
    )
    counting.add_argument(
        "--record-instructions", action="store_true", help="make the counts the reference"
    )
    return parser.parse_args()


def measure(plan: Plan, sections: tuple[str, ...] | list[str]) -> Results:
    """Runs sections, and says on standard error which one."""
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
            scene.permuted(), laps, 0, missing, methods=[DYNMESH, TWO_THREADS], with_error=False
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
    """Returns the exit code: 1 for a changed count, 2 where there is nothing to compare."""
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
