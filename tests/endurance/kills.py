"""Ends commands that write outputs at any moment, and checks that no output is lost or damaged.

    script/kill-test [KILLS]

An older output must be whole until the new one is, nothing else may be left but a hidden folder,
and the next run must remove it. The commands are forks of this process. With `--moments`, each is
ended before every N-th change that it makes to a file system, counted from the last: by a kill, by
Ctrl+C, and as by a full disk. The exit code is 1 if any check fails.
"""

import argparse
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

from jobs import COMMANDS, How, Job, make_sources
from rich.console import Console
from rich.table import Table

OUTCOMES = ("nothing", "a part", "older", "whole")


class Tally:
    """Counts what ended commands left, and notes failed checks."""

    def __init__(self) -> None:
        """Starts all counts at zero."""
        self.left: Counter[tuple[str, str]] = Counter()
        self.wrong: list[str] = []

    def end(self, job: Job, how: How, at: int | None = None, after: float | None = None) -> None:
        """Ends a run, checks what it leaves, and lets the next one finish."""
        try:
            job.begin()
            if job.end(how, at, after):
                self.left[job.kind, job.check(how)] += 1
            job.finish()
        except ValueError as error:
            self.wrong.append(
                f"{how} {f'at change {at}' if at else f'after {after:.3f} s'}: {error}"
            )


def main() -> None:
    """Ends commands and prints a report."""
    parser = argparse.ArgumentParser(prog="script/kill-test", description=__doc__.split("\n")[0])
    parser.add_argument("kills", nargs="?", type=int, default=100, help="number of kills")
    parser.add_argument("--moments", type=int, metavar="N", help="end at every N-th change")
    parser.add_argument("--seed", type=int, default=0, help="seed of the moments")
    arguments = parser.parse_args()
    tally, generator = Tally(), random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as name:
        jobs = list(_jobs(Path(name)))
        for number in range(0 if arguments.moments else arguments.kills):
            job = jobs[number % len(jobs)]
            tally.end(job, "killed", after=generator.uniform(0, 1.05 * job.seconds))
        for job in jobs if arguments.moments else ():
            for at in range(job.changes, 0, -arguments.moments):
                for how in get_args(How):
                    tally.end(job, how, at=at)
    _print(tally)
    sys.exit(1 if tally.wrong else 0)


def _jobs(folder: Path) -> Iterator[Job]:
    """All commands."""
    sources = make_sources(folder / "sources", frames=5)
    older = make_sources(folder / "older", frames=7)
    for number, kind in enumerate(COMMANDS):
        yield Job(kind, sources, older, folder / f"{number}")


def _print(tally: Tally) -> None:
    table = Table(title="Commands that were ended", title_justify="left")
    table.add_column("command")
    for outcome in OUTCOMES:
        table.add_column(f"left {outcome}", justify="right")
    for kind in COMMANDS:
        table.add_row(kind, *(str(tally.left[kind, outcome]) for outcome in OUTCOMES))
    Console(width=100).print(table)
    for wrong in tally.wrong[:20]:
        print(wrong, file=sys.stderr)
    print(f"{tally.left.total()} ended, {len(tally.wrong)} corruptions")


if __name__ == "__main__":
    main()
