"""Prints how well a mesh is tracked in scans of it, as a table.

    script/reproduce tracking FOLDER [NAME ...] [--depth] [--turn 90] [--baselines 2]

At most 80 frames of each sequence are scanned by simulated cameras around it: 20 000 points a
frame, or with --depth images of 640 x 480 pixels, with noise of 0.02 mean edges. The template is
frame 0. Errors are mean distances, in mean edges of frame 0: from the true place of a vertex, and
from the nearest true vertex, which does not count sliding. "Drift" is the error in the last quarter
of the frames over that in the second, and "times detail" the time over that of method detail where
30 % of the vertices are known. With --turn, the cameras stand elsewhere on their circle, by so many
degrees counterclockwise.

With --baselines N, the first N frames are also registered with other libraries, each frame from the
result for the last one; a frame takes them up to a minute, so N is small. A second table compares
them with the tracker over the same frames.

With --training, the scans are of the second half of each sequence, and further rows show the
tracker after training: of the first half, and of the first half with its vertices in another
order, which is of no use. A summary shows the errors with and without training.
"""

import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import trimesh.registration
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dynmesh import Tracker
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.scans import Scan
from dynmesh.sequence import Positions

from .cells import ABSENT, Line, by_row_and_column, milliseconds, number, ratio
from .harness import Table, parser, progress, sequences, show
from .methods import DETAIL
from .runner import run
from .subjects import Subject, random_masks
from .tracking import around, depth_scans, errors, point_scans, push, taken

registration: Any = trimesh.registration  # has no types

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

    def cells(self, detail: float) -> Line:
        """Return what a row shows of it; `detail` is the time of a frame of method detail."""
        n = len(self.errors)
        quarters = (self.errors[n // 4 : n // 2], self.errors[3 * n // 4 :])
        drift = f"{quarters[1].mean() / quarters[0].mean():.2f}" if n >= 8 else ABSENT
        distances = number(float(self.errors.mean())), number(float(self.surface.mean()))
        usual = float(np.median(self.seconds))
        return str(n), *distances, drift, milliseconds(usual), number(usual / detail)


def ours(subject: Subject, training: Positions | None = None) -> Register:
    """Return the tracker of dynmesh."""
    tracker = Tracker(subject.faces, subject.vertices[0], training=training)
    return lambda _, scan: push(tracker, scan)


def baselines(subject: Subject) -> dict[str, Register]:
    """Return what trimesh offers, with its defaults."""

    def rigid(last: Positions, scan: Scan) -> Positions:
        # From the scan to the mesh: the other way round, what the cameras do not see would be drawn
        # to what they see.
        matrix, _, _ = registration.icp(scan.cloud, last, max_iterations=50, scale=False)
        inverse = np.linalg.inv(matrix)
        return np.asarray(last @ inverse[:3, :3].T + inverse[:3, 3])

    def free(method: Any, last: Positions, scan: Scan) -> Positions:
        mesh = trimesh.Trimesh(last, subject.faces, process=False)
        return np.asarray(method(mesh, scan.cloud, use_faces=False))

    return {
        "rigid ICP (trimesh)": rigid,
        "nricp_amberg (trimesh)": partial(free, registration.nricp_amberg),
        "nricp_sumner (trimesh)": partial(free, registration.nricp_sumner),
    }


def measure(subject: Subject, truth: Positions, scans: Iterable[Scan], register: Register) -> Run:
    """Register the scan of each frame of the truth, beginning with the mesh of frame 0."""
    edge = mean_edge_of(subject.vertices[0], subject.faces)
    last = subject.vertices[0]
    rows = []
    for frame, scan in zip(truth, scans, strict=True):
        begun = time.perf_counter()
        last = register(last, scan)
        seconds = time.perf_counter() - begun
        surface = np.mean(cKDTree(frame).query(last)[0]) / edge
        rows.append((errors(subject, last, frame).mean(), surface, seconds))
    return Run(*np.array(rows).T)


def seconds_of_detail(subject: Subject) -> float:
    """Return the median time of the first frames of detail where 30 % are known."""
    few = replace(subject, vertices=subject.vertices[:11])
    return float(np.median(run(few, DETAIL, random_masks(few, 0.3), with_error=False).seconds))


def main() -> None:
    """Measure, and print the table."""
    made = parser(__doc__)
    made.add_argument("--cameras", type=int, nargs="+", default=[4, 1])
    made.add_argument("--frames", type=int, default=80)
    made.add_argument("--turn", type=float, default=0.0, help="turns the cameras, in degrees")
    made.add_argument("--depth", action="store_true", help="depth images instead of points")
    made.add_argument(
        "--baselines", type=int, default=0, metavar="N", help="frames for the baselines"
    )
    made.add_argument("--training", action="store_true", help="train the first half")
    arguments = made.parse_args()
    lines: list[Line] = [
        ("sequence", "cameras", "method", "frames", "error", "from the surface", "drift", "ms",
         "times detail")
    ]  # fmt: skip
    beside: list[Line] = [("sequence", "cameras", "method", "error", "times dynmesh")]
    summary: dict[tuple[str, str], str] = {}
    for sequence in sequences(arguments):
        subject, training = taken(sequence, arguments.frames, training=arguments.training)
        detail = seconds_of_detail(subject)
        trackers: dict[str, Positions | None] = {"dynmesh": None}
        if training is not None:
            order = np.random.default_rng(0).permutation(subject.n_vertices)
            trackers |= {"trained": training, "trained, of no use": training[:, order]}
        for n in arguments.cameras:

            def scans(frames: Positions, n: int = n, subject: Subject = subject) -> Iterable[Scan]:
                cameras = around(subject, subject.vertices, n, arguments.turn)
                scan = depth_scans if arguments.depth else point_scans
                return progress(scan(subject, frames, cameras), f"{subject.name}, {n}", len(frames))

            truth = subject.vertices
            for label, frames in trackers.items():
                found = measure(subject, truth, scans(truth), ours(subject, frames))
                cells = found.cells(detail)
                lines.append((subject.name, str(n), label, *cells))
                if label in ("dynmesh", "trained"):
                    summary[subject.name, f"{label}, cameras: {n}"] = cells[1]
            if not arguments.baselines:
                continue
            # After frame 0, where the template is; frame 0 itself comes first for its mean edge.
            truth = truth[: arguments.baselines + 1]
            kept = list(scans(truth))[1:]
            usual = 0.0
            for label, register in {"dynmesh": ours(subject), **baselines(subject)}.items():
                found = measure(subject, truth[1:], kept, register)
                seconds = float(np.median(found.seconds))
                usual = usual or seconds  # of dynmesh, the first one
                cells = number(float(found.errors.mean())), ratio(seconds, usual)
                beside.append((subject.name, str(n), label, *cells))
    tables = [Table("tracking", lines)]
    if arguments.training:
        tables.append(Table("tracking-training", by_row_and_column("sequence", summary)))
    if arguments.baselines:
        tables.append(Table("tracking-baselines", beside))
    show(arguments, *tables)


if __name__ == "__main__":
    main()
