"""Prints how near to the truth a template is after it was registered with one scan.

    python -m benchmarks.registration_table FOLDER [NAME[:FRAMES] ...] [--frames T ...]

The template is frame 0, and the scans are 20 000 points of the whole surface in other frames, with
noise of 0.05 mean edges. Errors are mean distances from the true vertices, in mean edges. Landmarks
are the vertices that are farthest from each other along the surface.
"""

import time
from collections.abc import Iterator

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

import dynmesh
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.files.scans import PointScan
from dynmesh.registration import Landmarks
from dynmesh.sequence import Positions
from dynmesh.study.subjects import Subject
from dynmesh.study.tables import ABSENT, Line, number

from .harness import Table, parser, progress, sequences, show
from .tracking_table import baselines

POINTS = 20_000
NOISE = 0.05


def scan_of(subject: Subject, positions: Positions) -> PointScan:
    """Points spread over the surface, with normals."""
    rng = np.random.default_rng(0)
    corners = positions.astype(np.float64)[subject.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    chosen = rng.choice(len(areas), POINTS, p=areas / areas.sum())
    points = np.einsum("nc,ncx->nx", rng.dirichlet([1, 1, 1], POINTS), corners[chosen])
    noise = NOISE * mean_edge_of(subject.vertices[0], subject.faces)
    points += noise * rng.standard_normal(points.shape)
    return PointScan(points, normals[chosen] / areas[chosen, None], None)


def landmarks_of(subject: Subject, positions: Positions, n: int) -> Landmarks:
    """The true positions of vertices that are far from each other."""
    first = subject.vertices[0].astype(np.float64)
    a, b = np.concatenate([subject.faces[:, [s, (s + 1) % 3]] for s in range(3)]).T
    lengths = np.linalg.norm(first[a] - first[b], axis=1)
    graph = coo_array((lengths, (a, b)), shape=(len(first),) * 2).tocsr()
    centre = np.linalg.norm(first - first.mean(axis=0), axis=1)
    marks = [int(centre.argmax())]
    while len(marks) < n:
        nearest = dijkstra(graph, directed=False, indices=np.array(marks)).min(axis=0)
        marks.append(int(nearest.argmax()))
    return np.array(marks), positions[marks].astype(np.float64)


def rows_of(subject: Subject, numbers: list[int], others: bool) -> Iterator[Line]:
    """The rows of a sequence."""
    template = subject.vertices[0].astype(np.float64)
    edge = mean_edge_of(template, subject.faces)

    def off(found: Positions, truth: Positions) -> str:
        return number(float(np.linalg.norm(found - truth, axis=1).mean() / edge))

    for t in numbers:
        truth = subject.vertices[t]
        scan = scan_of(subject, truth)

        for name, n in (("register", 0), ("register, six landmarks", 6)):
            marks = landmarks_of(subject, truth, n) if n else None
            began = time.perf_counter()
            found = dynmesh.register(
                subject.faces, template, scan.points, scan.normals, landmarks=marks
            )
            seconds = f"{time.perf_counter() - began:.1f}"
            far = f"{100 * found.far:.2f}"
            yield (
                subject.name, str(t), name, off(found.vertices, truth), far, found.quality, seconds,
            )  # fmt: skip
        for name, run in baselines(subject).items() if others else ():
            began = time.perf_counter()
            placed = run(template, scan)
            seconds = f"{time.perf_counter() - began:.1f}"
            yield subject.name, str(t), name, off(placed, truth), ABSENT, ABSENT, seconds


def main() -> None:
    """Measure, and print the table."""
    made = parser(__doc__)
    made.add_argument("--frames", type=int, nargs="+", default=[5, 20, 60], help="of the scans")
    made.add_argument("--baselines", action="store_true", help="also measure those of trimesh")
    arguments = made.parse_args()
    head = ("sequence", "frame", "method", "error", "far (%)", "quality", "seconds")
    rows: list[Line] = []
    for subject in sequences(arguments, max(arguments.frames) + 1):
        numbers = [t for t in arguments.frames if t < len(subject.vertices)]
        rows += progress(rows_of(subject, numbers, arguments.baselines), subject.name)
    show(arguments, Table("registration", [head, *rows]))


if __name__ == "__main__":
    main()
