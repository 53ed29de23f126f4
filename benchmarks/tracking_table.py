"""Prints how well a mesh is tracked in scans of it, as a table.

    python -m benchmarks.tracking_table FOLDER [NAME ...] [--depth] [--turn 90] [--baselines 2]

FOLDER contains sequences in files NAME.npz. At most 80 frames of each are scanned by simulated
cameras around it: 20 000 points a frame, or with --depth images of 640 x 480 pixels, with noise of
0.02 mean edges. The template is frame 0. Errors are mean distances, in mean edges of frame 0: from
the true place of a vertex, and from the nearest true vertex, which does not count sliding.
"Drift" is the error in the last quarter of the frames over that in the second, and "times detail"
the time over that of method detail where 30 % of the vertices are known. With --turn, the cameras
stand elsewhere on their circle, by so many degrees counterclockwise.

With --baselines N, the first N frames are also registered with other libraries, each frame from the
result for the last one; a frame takes them up to a minute, so N is small. The rows of the tracker
beside them are over the same frames.

With --training, the scans are of the second half of each sequence, and further rows show the
tracker after training: of the first half, and of the first half with its vertices in another
order, which is of no use.
"""

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from dynmesh import Completer, Tracker, degrade
from dynmesh._extras import require
from dynmesh.degrade import Camera
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.files.scans import PointScan, Scan
from dynmesh.sequence import Positions
from dynmesh.study.subjects import Subject, from_file
from dynmesh.study.tables import ABSENT, Line, markdown, milliseconds, number

MOST_FRAMES = 80
POINTS = 20_000
NOISE = 0.02

Register = Callable[[Positions, Scan], Positions]
"""Takes the mesh of the last frame and a scan, and returns the mesh as it lies in the scan."""


class Run(NamedTuple):
    """What a method made of some frames.

    Attributes:
        errors: (n,) mean distance from the true vertex in each frame, in mean edges.
        surface: (n,) mean distance from the nearest true vertex.
        seconds: (n,) time of each frame.
    """

    errors: NDArray[np.float64]
    surface: NDArray[np.float64]
    seconds: NDArray[np.float64]

    def line(self, *names: str, detail: float) -> Line:
        """Return a row of the table; `detail` is the time of a frame of method detail."""
        n = len(self.errors)
        quarters = (self.errors[n // 4 : n // 2], self.errors[3 * n // 4 :])
        drift = quarters[1].mean() / quarters[0].mean() if n >= 8 else np.nan
        return (
            *names,
            str(n),
            number(float(self.errors.mean())),
            number(float(self.surface.mean())),
            ABSENT if np.isnan(drift) else f"{drift:.2f}",
            milliseconds(float(np.median(self.seconds))),
            number(float(np.median(self.seconds)) / detail),
        )


def scans_of(
    subject: Subject, frames: Positions, cameras: list[Camera], *, depth: bool
) -> Iterator[Scan]:
    """Yield the scans of frames; noise is in mean edges of the first one."""
    if depth:
        yield from degrade.depth_images(frames, subject.faces, cameras, noise=NOISE)
    else:
        yield from degrade.scan_points(frames, subject.faces, cameras, points=POINTS, noise=NOISE)


def around(subject: Subject, frames: Positions, n: int, turn: float = 0.0) -> list[Camera]:
    """Return cameras around everywhere that the subject goes, turned by some degrees."""
    box = np.stack([frames.min(axis=(0, 1)), frames.max(axis=(0, 1))])
    up = (float(subject.up == "x"), float(subject.up == "y"), float(subject.up == "z"))
    return degrade.orbit(box, n, degrees_per_frame=turn, up=up)(1)


def ours(subject: Subject, first: Positions, training: Positions | None = None) -> Register:
    """Return the tracker of dynmesh."""
    tracker = Tracker(subject.faces, first, training=training)

    def register(_: Positions, scan: Scan) -> Positions:
        if isinstance(scan, PointScan):
            return tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
        return tracker.push_depth(scan.depth, scan.intrinsics, scan.poses)

    return register


def baselines(subject: Subject) -> dict[str, Register]:
    """Return what trimesh offers, with its defaults.

    Raises:
        ImportError: trimesh is not installed.
    """
    trimesh = require("trimesh", extra="reproduce")
    registration = require("trimesh.registration", extra="reproduce")

    def rigid(last: Positions, scan: Scan) -> Positions:
        # From the scan to the mesh: the other way round, what the cameras do not see would be drawn
        # to what they see.
        matrix, _, _ = registration.icp(scan.cloud, last, max_iterations=50, scale=False)
        inverse = np.linalg.inv(matrix)
        return np.asarray(last @ inverse[:3, :3].T + inverse[:3, 3])

    def free(name: str) -> Register:
        def register(last: Positions, scan: Scan) -> Positions:
            mesh = trimesh.Trimesh(last, subject.faces, process=False)
            moved: Any = getattr(registration, name)(mesh, scan.cloud, use_faces=False)
            return np.asarray(moved)

        return register

    return {
        "rigid ICP (trimesh)": rigid,
        "nricp_amberg (trimesh)": free("nricp_amberg"),
        "nricp_sumner (trimesh)": free("nricp_sumner"),
    }


def measure(subject: Subject, truth: Positions, scans: Iterator[Scan], register: Register) -> Run:
    """Register the scan of each frame of the truth, beginning with the mesh of frame 0."""
    tree = require("scipy.spatial", extra="reproduce").cKDTree
    edge = mean_edge_of(subject.vertices[0], subject.faces)
    last = subject.vertices[0]
    errors, surface, seconds = [], [], []
    for frame, scan in zip(truth, scans, strict=True):
        begun = time.perf_counter()
        last = register(last, scan)
        seconds.append(time.perf_counter() - begun)
        errors.append(np.linalg.norm(last - frame, axis=1).mean() / edge)
        surface.append(tree(frame).query(last)[0].mean() / edge)
    return Run(np.array(errors), np.array(surface), np.array(seconds))


def seconds_of_detail(subject: Subject, frames: int) -> float:
    """Return the median time of detail where 30 % are known, to compare with."""
    completer = Completer(subject.faces, subject.vertices[0], method="detail")
    masks = degrade.random_known(frames + 1, subject.n_vertices, 0.3)
    seconds = []
    for points, known in zip(subject.vertices[1 : frames + 1], list(masks)[1:], strict=True):
        completer.push(points, known)
        seconds.append(completer.report.seconds)
    return float(np.median(seconds))


def taken(path: Path, arguments: argparse.Namespace) -> tuple[Subject, dict[str, Positions]]:
    """Return the frames to scan, and the training sequences by the name of their row."""
    if not arguments.training:
        return from_file(path, arguments.frames), {}
    both = from_file(path)
    half = both.n_frames // 2
    first, second = both.vertices[:half], both.vertices[half : half + arguments.frames]
    order = np.random.default_rng(0).permutation(both.n_vertices)
    training = {"trained": first, "trained, of no use": first[:, order]}
    return replace(both, vertices=second), training


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", help="the sequences; the default is all of them")
    parser.add_argument("--cameras", type=int, nargs="+", default=[4, 1])
    parser.add_argument("--frames", type=int, default=MOST_FRAMES)
    parser.add_argument("--turn", type=float, default=0.0, help="turns the cameras, in degrees")
    parser.add_argument("--depth", action="store_true", help="depth images instead of points")
    parser.add_argument(
        "--baselines", type=int, default=0, metavar="N", help="frames for the baselines"
    )
    parser.add_argument("--training", action="store_true", help="train the first half")
    arguments = parser.parse_args()
    names = arguments.names or sorted(path.stem for path in arguments.folder.glob("*.npz"))
    lines: list[Line] = [
        (
            "sequence",
            "cameras",
            "method",
            "frames",
            "error",
            "from the surface",
            "drift",
            "ms",
            "times detail",
        )
    ]
    for name in names:
        subject, training = taken(arguments.folder / f"{name}.npz", arguments)
        truth = subject.vertices
        for n in arguments.cameras:
            cameras = around(subject, truth, n, arguments.turn)
            scans = track(
                scans_of(subject, truth, cameras, depth=arguments.depth),
                f"{name}, {n}",
                len(truth),
                console=Console(stderr=True),
            )
            run = measure(subject, truth, iter(scans), ours(subject, truth[0]))
            detail = seconds_of_detail(subject, min(10, len(truth) - 1))
            lines.append(run.line(name, str(n), "dynmesh", detail=detail))
            for label, frames in training.items():
                scans = scans_of(subject, truth, cameras, depth=arguments.depth)
                run = measure(subject, truth, scans, ours(subject, truth[0], frames))
                lines.append(run.line(name, str(n), label, detail=detail))
            if not arguments.baselines:
                continue
            # After frame 0, where the template is; frame 0 itself comes first for its mean edge.
            some = truth[: arguments.baselines + 1]
            kept = list(scans_of(subject, some, cameras, depth=arguments.depth))[1:]
            for label, register in {
                "dynmesh": ours(subject, truth[0]),
                **baselines(subject),
            }.items():
                run = measure(subject, some[1:], iter(kept), register)
                lines.append(run.line(name, str(n), f"{label}, the first frames", detail=detail))
    print(markdown(lines))


if __name__ == "__main__":
    main()
