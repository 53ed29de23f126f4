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
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

from jobs import COMMANDS, How, Job, make_sources


def main() -> None:
    """Ends commands and prints what was wrong."""
    parser = argparse.ArgumentParser(prog="script/kill-test", description=__doc__.split("\n")[0])
    parser.add_argument("kills", nargs="?", type=int, default=100, help="number of kills")
    parser.add_argument("--moments", type=int, metavar="N", help="end at every N-th change")
    parser.add_argument("--seed", type=int, default=0, help="seed of the moments")
    arguments = parser.parse_args()
    ended, wrong, generator = 0, 0, random.Random(arguments.seed)

    def moments(jobs: list[Job]) -> Iterator[tuple[Job, How, int | None, float | None]]:
        for number in range(0 if arguments.moments else arguments.kills):
            job = jobs[number % len(jobs)]
            yield job, "killed", None, generator.uniform(0, 1.05 * job.seconds)
        for job in jobs if arguments.moments else ():
            for at in range(job.changes, 0, -arguments.moments):
                for how in get_args(How):
                    yield job, how, at, None

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sources = make_sources(folder / "sources", frames=5)
        older = make_sources(folder / "older", frames=7)
        jobs = [Job(kind, sources, older, folder / f"{n}") for n, kind in enumerate(COMMANDS)]
        for job, how, at, after in moments(jobs):
            try:
                job.begin()
                if job.end(how, at, after):
                    job.check(how)
                    ended += 1
                job.finish()
            except ValueError as error:
                wrong += 1
                print(f"{how} at change {at} or after {after} s: {error}", file=sys.stderr)
    print(f"{ended} ended, {wrong} corruptions")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
