"""Ends commands that write outputs at any moment, and checks that no output is lost or damaged.

    script/dev/kill-test [N]

An older output must be whole until the new one is, nothing else may be left but a hidden folder,
and the next run must remove it. The commands are forks of this process. Each is ended before every
N-th change that it makes to a file system, counted from the last: by a kill, by Ctrl+C, and as by a
full disk. The exit code is 1 if any check fails.
"""

import argparse
import errno
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

import dynmesh
from dynmesh import cli

COMMANDS = {
    "npz": "complete partial.npz {}/out.npz --provenance",
    "npz, both ways": "complete partial.npz {}/out.npz --bidirectional --start 8",
    "hdf5": "complete partial.npz {}/out.h5",
    "usd": "convert partial.npz {}/out.usdc",
    "ply": "complete partial.npz {}/out/frame_%04d.ply",
    "obj, by a pattern": "complete partial.npz {}/new/frame_%04d.obj",
    "ply, among others": "convert partial.npz {}/mixed/frame_%04d.ply",
    "npy": "complete partial.npz {}/out.npy --provenance",
    "pc2": "convert partial.npz {}/out.pc2",
    "synth": "synth ocean {}/out.npz --frames FRAMES",
    "degrade": "degrade template.npz {}/out.npz --noise 0.1",
    "scans": "degrade partial.npz {}/out --scan --points 60",
    "track": "track points {}/out.npz --template template.npz",
    "track depth": "track depth {}/out.h5 --template template.npz",
    "register": "register template.npz points/frame_00002.ply {}/out.ply",
    "evaluate": "evaluate truth.npz truth.npz --csv {}/out.csv",
}
SEVERAL = {"npy", "obj, by a pattern", "pc2", "ply", "ply, among others", "scans"}
"""Those with several files that are moved one by one."""

Files = dict[str, bytes]
How = Literal["killed", "interrupted", "full"]


class Job:
    """A command, over an older output of other input.

    Attributes:
        kind: one of :data:`COMMANDS`.
        older: what the folder holds before.
        whole: what it holds after an undisturbed run.
        changes: the number of changes to the file system of such a run.
    """

    def __init__(self, kind: str, sources: Path, older: Path, folder: Path) -> None:
        """Runs the command undisturbed.

        Args:
            kind: one of :data:`COMMANDS`.
            sources: the input, as :func:`make_sources` writes it.
            older: other input, of which the output is made that the command replaces.
            folder: to work in.
        """
        self.kind, self._sources = kind, sources
        self._folder, self._work = folder, folder / "work"
        (self._work / "mixed").mkdir(parents=True)
        (self._work / "mixed" / "readme.txt").write_text("is no frame")
        self._must_run(older)
        self.older = visible(self._work)
        self._work.rename(folder / "older")
        self.begin()
        counted = folder / "changes"
        self._must_run(sources, lambda: end_at_change(-1, "killed", counted))
        self.whole, self.changes = visible(self._work), int(counted.read_text())
        if self.whole == self.older:
            raise ValueError(f"{kind}: there is no new output")

    def begin(self) -> None:
        """Lets the folder hold the older output, and nothing else."""
        shutil.rmtree(self._work, ignore_errors=True)
        shutil.copytree(self._folder / "older", self._work)

    def end(self, how: How, at: int) -> bool:
        """Runs the command, which ends at a change; returns whether it did."""
        return run_in_fork(lambda: self._run(self._sources, lambda: end_at_change(at, how))) != 0

    def check(self) -> str:
        """Says what is there: the "older" output, "nothing", "a part", or the "whole" new one."""
        found, older, whole = visible(self._work), self.older, self.whole
        if found == whole:
            return "whole"
        if found == older:
            return "older"
        if self.kind in SEVERAL:
            is_right = found.items() <= older.items() or found.items() <= whole.items()
        else:
            names = found.keys() | older.keys() | whole.keys()
            is_right = all(found.get(n) in (older.get(n), whole.get(n)) for n in names)
        if not is_right:
            raise ValueError(
                f"{self.kind}: {sorted(found)} are neither the older nor the new files"
            )
        return "a part" if found.keys() - {"mixed/readme.txt"} else "nothing"

    def finish(self) -> None:
        """Runs the command again, which must make the output and leave nothing else."""
        self._must_run(self._sources)
        hidden = [str(path) for path in self._work.rglob(".*")]
        if self.check() != "whole" or hidden:
            raise ValueError(f"{self.kind}: the next run left {hidden or 'another output'}")

    def _must_run(self, sources: Path, before: Callable[[], None] | None = None) -> None:
        if run_in_fork(lambda: self._run(sources, before)):
            raise ValueError(f"{self.kind}: failed: {self._said.read_text()}")

    @property
    def _said(self) -> Path:
        return self._folder / "said"

    def _run(self, sources: Path, before: Callable[[], None] | None = None) -> None:
        sys.argv = ["dynmesh", *command(self.kind, sources, self._work)]
        sys.stdout = sys.stderr = self._said.open("w")
        os.chdir(sources)
        if before is not None:
            before()
        cli.main()


def command(kind: str, sources: Path, work: Path) -> list[str]:
    """Returns the words of a command whose outputs are in the folder `work`."""
    frames = str(len(dynmesh.read(sources / "partial.npz")))
    words = COMMANDS[kind].replace("FRAMES", frames).split()
    return [*(word.format(work) for word in words), "--overwrite", "--quiet"]


def make_sources(folder: Path, frames: int) -> Path:
    """Writes an ocean with missing vertices, and scans of it, into a new folder; returns it."""
    folder.mkdir(parents=True)
    ocean = dynmesh.synth.ocean(frames, grid=12, seed=frames)
    known = np.random.default_rng(1).random(ocean.vertices.shape[:2]) < 0.5
    known[0] = True
    partial = dynmesh.Sequence(ocean.vertices, ocean.faces, known, fps=30.0, start=frames)
    dynmesh.write(folder / "partial.npz", partial)
    dynmesh.write(folder / "truth.npz", dynmesh.Sequence(ocean.vertices, ocean.faces))
    dynmesh.write(folder / "template.npz", dynmesh.Sequence(ocean.vertices[:1], ocean.faces))
    for scans in ("points --scan --points 300", "depth --depth 32x24"):
        words = f"-m dynmesh degrade truth.npz {scans} --cameras 2 --quiet".split()
        subprocess.run([sys.executable, *words], cwd=folder, check=True)
    return folder


def visible(folder: Path) -> Files:
    """Returns the content of all files that are not hidden."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(part[0] == "." for part in path.relative_to(folder).parts)
    }


def run_in_fork(job: Callable[[], None]) -> int:
    """Runs a job in a child process; returns its exit code, or the signal that killed it."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            job()
        except SystemExit as ended:
            code = 0 if ended.code in (None, 0, 3) else 1  # 3: the output is doubtful, but written
        finally:
            sys.stdout.flush()
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def end_at_change(n: int, how: How, counted: Path | None = None) -> None:
    """Ends this process just before its n-th change to a file system, counted from 1.

    "full" lets it fail as if the disk were full, and "interrupted" is Ctrl+C at that moment. The
    number of all changes is written to the file `counted`.
    """
    note = os.open(counted, os.O_CREAT | os.O_WRONLY) if counted else None
    writing = {"os.rename", "os.mkdir", "os.truncate"}
    removing = {"os.remove", "os.rmdir"}
    count = 0

    def look(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal count
        writes = event == "open" and isinstance(arguments[1], str) and arguments[1][0] in "wxa"
        if not (writes or event in writing or event in removing):
            return
        count += 1
        if note is not None:
            os.pwrite(note, b"%d" % count, 0)
        if count == n and how == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if count == n and how == "interrupted":
            raise KeyboardInterrupt
        if count == n and how == "full" and event not in removing:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(arguments[0]))

    sys.addaudithook(look)


def main() -> None:
    """Ends commands and prints what was wrong."""
    parser = argparse.ArgumentParser(
        prog="script/dev/kill-test", description=__doc__.split("\n")[0]
    )
    parser.add_argument("every", nargs="?", type=int, default=4, metavar="N", help="which changes")
    every, ended, wrong = parser.parse_args().every, 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sources = make_sources(folder / "sources", frames=5)
        older = make_sources(folder / "older", frames=7)
        jobs = [Job(kind, sources, older, folder / f"{n}") for n, kind in enumerate(COMMANDS)]
        moments = ((job, at) for job in jobs for at in range(job.changes, 0, -every))
        for (job, at), how in product(moments, get_args(How)):
            try:
                job.begin()
                if job.end(how, at):
                    job.check()
                    ended += 1
                job.finish()
            except ValueError as error:
                wrong += 1
                print(f"{how} at change {at}: {error}", file=sys.stderr)
    print(f"{ended} ended, {wrong} corruptions")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
