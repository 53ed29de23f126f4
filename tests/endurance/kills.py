"""Kills jobs that complete or track files at any moment, and checks that nothing is lost.

    script/kill-test [KILLS]

The jobs are forks of this process. Half of the kills hit a run that was resumed after a kill. With
`--moments`, jobs are killed before every change that they make to a file system, one after another.
The exit code is 1 if any check fails.
"""

import argparse
import random
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

from jobs import OUTPUTS, Job, kill_at_change, make_sources, moment, run_in_fork, visible
from rich.console import Console
from rich.progress import Progress
from rich.table import Table


class Tally:
    """Counts of what happened.

    Attributes:
        kills: number of kills that hit a running job.
        left: the files that they left, by class.
        resumed: number of runs that were resumed after a kill.
        wrong: descriptions of failed checks.
    """

    def __init__(self) -> None:
        """Starts all counts at zero."""
        self.kills: Counter[str] = Counter()
        self.left: Counter[tuple[str, str]] = Counter()
        self.resumed: Counter[str] = Counter()
        self.wrong: list[str] = []


def main() -> None:
    """Kills jobs and prints a report."""
    parser = argparse.ArgumentParser(prog="script/kill-test", description=__doc__.split("\n")[0])
    parser.add_argument("kills", nargs="?", type=int, default=100, help="number of kills")
    parser.add_argument("--moments", type=int, metavar="N", help="kill at every N-th change")
    parser.add_argument("--seed", type=int, default=0, help="seed of the moments")
    arguments = parser.parse_args()
    tally = Tally()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if arguments.moments:
            _kill_at_moments(folder, arguments.moments, tally)
        else:
            _kill_at_random(folder, arguments.kills, random.Random(arguments.seed), tally)
    _print(tally)
    sys.exit(1 if tally.wrong else 0)


def _kill_at_random(folder: Path, kills: int, generator: random.Random, tally: Tally) -> None:
    sources = make_sources(folder / "sources")
    jobs = []
    for kind in OUTPUTS:
        own = folder / kind
        own.mkdir()
        jobs.append(Job(kind, sources, pause=0.005))
        jobs[-1].complete_once(own)
    with Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task("killing", total=kills)
        number = 0
        while tally.kills.total() < kills and len(tally.wrong) < kills:
            try:
                _kill_job(jobs[number % len(jobs)], folder / "work", generator, tally)
            except ValueError as error:
                tally.wrong.append(str(error))
            number += 1
            bar.update(task, completed=tally.kills.total())


def _kill_job(job: Job, work: Path, generator: random.Random, tally: Tally) -> None:
    """Kills a run, and the next one in half of the cases; the last run completes."""
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    for _ in range(generator.choice((1, 2))):
        after = moment(generator, job.seconds)
        killed = run_in_fork(lambda: job.run(work, resume=True), kill_after=after)
        left = job.check(work)
        if killed:
            tally.kills[job.kind] += 1
            tally.left[job.kind, left] += 1
    tally.resumed[job.kind] += _finish(job, work)


def _finish(job: Job, work: Path, *, overwrite: bool = False) -> bool:
    """Runs a job to its end; returns whether it was resumed."""
    note = work.with_name("resumed_at")
    run_in_fork(lambda: note.write_text(str(job.run(work, resume=True, overwrite=overwrite))))
    job.check_end(work)
    return int(note.read_text()) > 0


def _kill_at_moments(folder: Path, step: int, tally: Tally) -> None:
    """Kills each job before its first change to the file system, its second, and so on.

    This is done without an older output, and over an older and longer one.
    """
    sources = make_sources(folder / "sources", frames=5)
    older = make_sources(folder / "older", frames=7)
    for kind in OUTPUTS:
        own = folder / kind
        own.mkdir()
        job = Job(kind, sources, pause=0.0)
        job.complete_once(own / "reference")
        for before in (None, older):
            n = 1
            while _kill_at(job, own / "work", n, before, tally):
                n += step


def _kill_at(job: Job, work: Path, n: int, before: Path | None, tally: Tally) -> bool:
    """Returns whether the job made that many changes."""
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    if before is not None:
        run_in_fork(lambda: job.run(work, sources=before))
    older = visible(work)

    def run() -> None:
        kill_at_change(n)
        job.run(work, resume=True, overwrite=before is not None)

    if not run_in_fork(run):
        return False
    tally.kills[job.kind] += 1
    try:
        left = job.check(work, older)
        tally.left[job.kind, left] += 1
        tally.resumed[job.kind] += _finish(job, work, overwrite=left == "older")
    except ValueError as error:
        tally.wrong.append(f"before change {n}: {error}")
    return True


def _print(tally: Tally) -> None:
    outcomes = ("nothing", "a part", "whole", "older")
    table = Table(title="Killed jobs", title_justify="left")
    table.add_column("job")
    for heading in ("kills", *(f"left {outcome}" for outcome in outcomes), "resumed"):
        table.add_column(heading, justify="right")
    for kind in OUTPUTS:
        if tally.kills[kind]:
            left = [tally.left[kind, outcome] for outcome in outcomes]
            table.add_row(kind, *map(str, (tally.kills[kind], *left, tally.resumed[kind])))
    Console(width=100).print(table)
    for wrong in tally.wrong[:20]:
        print(wrong, file=sys.stderr)
    print(f"{tally.kills.total()} kills, {len(tally.wrong)} corruptions")


if __name__ == "__main__":
    main()
