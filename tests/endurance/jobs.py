"""Jobs that complete or track files and are killed, and checks of what they leave."""

import contextlib
import os
import random
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

import dynmesh
from dynmesh import degrade
from dynmesh.degrade.depth_buffer import intrinsics_of, pose_of
from dynmesh.files.scans import DepthFolder, PointFolder, Rig, ScanCamera
from dynmesh.jobs.checkpoint import Checkpoint
from dynmesh.jobs.file_completion import complete_file
from dynmesh.jobs.report import FileReport
from dynmesh.jobs.track_report import TrackFileReport
from dynmesh.jobs.tracking import track_file

OUTPUTS = {
    "npz": "out.npz",
    "hdf5": "out.h5",
    "npy": "out.npy",
    "pc2": "out.pc2",
    "ply": "out",
    "ply, by a pattern": "new/frame_%04d.ply",
    "points, tracked": "out.npz",
    "depth, tracked": "new/frame_%04d.ply",
}
FORMATS = {"ply": "ply"}  # if the name does not determine the format
SOURCES = {"points, tracked": "points", "depth, tracked": "depth"}  # of others, `partial.npz`

Files = dict[str, bytes]


class Job:
    """One completion or tracking, its output and the expected result.

    Attributes:
        kind: one of :data:`OUTPUTS`.
        sources: the folder with what it reads, as :func:`make_sources` writes it.
        pause: seconds between two frames, during which the job can be killed.
        whole: the expected content of the output.
        seconds: the time that the job takes.
    """

    def __init__(self, kind: str, sources: Path, pause: float) -> None:
        """Does not start the job."""
        self.kind, self.sources, self.pause = kind, sources, pause
        self.whole: Files = {}
        self.seconds = 0.0

    def complete_once(self, folder: Path) -> None:
        """Runs the job without interruption and records the result and the time."""
        folder.mkdir(exist_ok=True)
        began = time.monotonic()
        run_in_fork(lambda: self.run(folder))
        self.seconds = time.monotonic() - began
        self.whole = visible(folder)
        if not self.whole:
            raise ValueError(f"{self.kind}: there is no output")

    def output(self, folder: Path) -> Path:
        """Returns the path of the output in that folder."""
        return folder / OUTPUTS[self.kind]

    def run(
        self,
        folder: Path,
        *,
        sources: Path | None = None,
        resume: bool = False,
        overwrite: bool = False,
    ) -> int:
        """Runs the job here; returns the first frame that it made, -1 if the output exists."""
        Checkpoint.least_seconds_between = 0.0
        Checkpoint.most_of_the_time = 0.2

        def slowly(frames: Iterator[Any], *_: int) -> Iterator[Any]:
            for frame in frames:
                time.sleep(self.pause)
                yield frame

        read_from = sources or self.sources
        options: dict[str, Any] = {
            "output_format": FORMATS.get(self.kind),
            "provenance": self.kind != "pc2",
            "resume": resume,
            "overwrite": overwrite,
            "watch": slowly,
        }
        report: FileReport | TrackFileReport
        with contextlib.suppress(FileExistsError):
            if self.kind in SOURCES:
                scans, template = read_from / SOURCES[self.kind], read_from / "template.npz"
                report = track_file(scans, self.output(folder), template=template, **options)
            else:
                report = complete_file(read_from / "partial.npz", self.output(folder), **options)
            return -1 if report.existed else report.resumed_at
        return -1

    def check(self, folder: Path, older: Files | None = None) -> str:
        """Classifies the files after a kill: "nothing", "whole", "a part" or "older"."""
        found = visible(folder)
        if found == self.whole:
            return "whole"
        if older and found.items() <= older.items():
            return "older" if found == older else "a part"
        if not found:
            return "nothing"
        main = OUTPUTS[self.kind]
        if main not in found and found.items() <= self.whole.items():
            return "a part"
        wrong = sorted(name for name in found if found[name] != self.whole.get(name))
        raise ValueError(f"{self.kind}: of the files {sorted(found)}, {wrong} are wrong")

    def check_end(self, folder: Path) -> None:
        """Checks that the output is complete and that no other files exist."""
        if self.check(folder) != "whole":
            raise ValueError(f"{self.kind}: is not complete after an uninterrupted run")
        hidden = folder.rglob(".*")
        # A doubt about a complete output is remembered.
        files = [str(path.relative_to(folder)) for path in hidden if path.suffix != ".doubtful"]
        if files:
            raise ValueError(f"{self.kind}: {files} were left behind")


def make_sources(folder: Path, frames: int = 40) -> Path:
    """Writes an ocean with missing vertices, and scans of it, into a new folder; returns it."""
    folder.mkdir()
    ocean = dynmesh.synth.ocean(frames, grid=20, seed=3)
    known = np.random.default_rng(1).random(ocean.vertices.shape[:2]) < 0.3
    known[0] = True
    partial = dynmesh.Sequence(ocean.vertices, ocean.faces, known, fps=30.0)
    dynmesh.write(folder / "partial.npz", partial)
    dynmesh.write(folder / "template.npz", dynmesh.Sequence(ocean.vertices[:1], ocean.faces))
    cameras = degrade.orbit(ocean.vertices[0], 2)(0)
    size = 32, 24
    rig = Rig(
        tuple(
            ScanCamera(str(number), pose_of(camera), intrinsics_of(camera, *size), 0.001, size)
            for number, camera in enumerate(cameras)
        )
    )
    clouds = degrade.scan_points(ocean.vertices, ocean.faces, cameras, points=500)
    with PointFolder(folder / SOURCES["points, tracked"], rig) as points:
        for cloud in clouds:
            points.append(cloud)
    images = degrade.depth_images(
        ocean.vertices, ocean.faces, cameras, width=size[0], height=size[1]
    )
    with DepthFolder(folder / SOURCES["depth, tracked"], rig) as depth:
        for pair in images:
            depth.append(pair)
    return folder


def visible(folder: Path) -> Files:
    """Returns the content of all files that are not hidden."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(part[0] == "." for part in path.relative_to(folder).parts)
    }


def run_in_fork(job: Any, kill_after: float | None = None) -> bool:
    """Runs a job in a child process; returns whether it was killed before it ended.

    Raises:
        ValueError: the job failed.
    """
    child = os.fork()
    if child == 0:
        _run_and_exit(job)
    if kill_after is not None:
        time.sleep(kill_after)
        os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL:
        return True
    if status != 0:
        raise ValueError(f"a job ended with status {status}")
    return False


def _run_and_exit(job: Any) -> NoReturn:
    try:
        job()
    except BaseException as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr, flush=True)
        os._exit(1)
    os._exit(0)


def kill_at_change(n: int) -> None:
    """Kills this process just before its n-th change to a file system, counted from 1."""
    changes = {"os.rename", "os.remove", "os.rmdir", "os.mkdir", "os.truncate"}
    count = 0

    def look(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal count
        writes = event == "open" and isinstance(arguments[1], str) and arguments[1][0] in "wxa"
        if writes or event in changes:
            count += 1
            if count == n:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(look)


def moment(generator: random.Random, seconds: float) -> float:
    """Returns a random time within the run, or shortly after its end."""
    return generator.uniform(0, 1.05 * seconds)
