"""Prints how near to the truth a template is after it was registered with one scan.

    script/reproduce registration FOLDER [NAME[:FRAMES] ...] [--baselines]
    script/reproduce registration --pairs FOLDER

The template is frame 0, and the scans show another frame whose shape is near that of frame 0, or
far from it: 20 000 points of the whole surface with noise of 0.05 mean edges, those of four cameras
and of one with noise of 0.02, half of the whole, and the whole with 5 % of the points moved by some
10 mean edges. Errors are mean distances from the true vertices, in mean edges, of vertices within
two mean edges of the points. Landmarks are the vertices that are farthest from each other along the
surface. With --baselines, whole scans are also registered by trimesh and, if they are installed,
Open3D and pycpd, which begin with the template where the landmarks put it by a rigid motion.

A second table shows how often the quality was right: whether a result with an error below one mean
edge is good, and any other, or one of half a scan, is not.

With --pairs, each mesh of the folder is registered with the scan whose name has tar or tgt in place
of src, or target in place of source.
"""

import time
from argparse import BooleanOptionalAction
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

import dynmesh
from dynmesh.degrade.shared import mean_edge_of
from dynmesh.registration import Landmarks
from dynmesh.sequence import Positions

from .cells import ABSENT, Line, number
from .harness import Table, parser, progress, sequences, show
from .registration_baselines import baselines
from .registration_pairs import SCANS, Pair, near_and_far, of_folder, of_sequence
from .subjects import Subject

LANDMARKS = 6
_NEAR = 2.0
"""Vertices within so many mean edges of the points count."""
_RIGHT = 1.0
"""The error below which a result is right, in mean edges."""


class Found(NamedTuple):
    """A result.

    Attributes:
        pair: what was registered.
        method: with what.
        error: as above; NaN without the truth.
        far: share of the points that are farther than a mean edge from the mesh; NaN for others.
        quality: what dynmesh said; empty for others.
        seconds: the time.
    """

    pair: Pair
    method: str
    error: float
    far: float
    quality: str
    seconds: float

    @property
    def is_right(self) -> bool:
        """Whether the result is near the truth, of a scan that shows enough."""
        return self.error < _RIGHT and self.pair.kind != "half"


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


def measure(pair: Pair, others: bool) -> Iterator[Found]:
    """Yield the results of all methods."""
    subject, scan, truth, *_ = pair
    template = subject.vertices[0].astype(np.float64)
    edge = mean_edge_of(template, subject.faces)

    def error(vertices: Positions) -> float:
        if truth is None:
            return float("nan")
        near = cKDTree(scan.points).query(truth)[0] < _NEAR * edge
        return float(np.linalg.norm(vertices - truth, axis=1)[near].mean() / edge)

    ours: dict[str, Landmarks | None] = {"dynmesh": None}
    if truth is not None:
        ours[f"dynmesh, {LANDMARKS} landmarks"] = landmarks_of(subject, truth, LANDMARKS)
    for name, marks in ours.items():
        began = time.perf_counter()
        found = dynmesh.register(
            subject.faces,
            template,
            scan.points,
            scan.normals,
            landmarks=marks,
            viewpoints=scan.viewpoints,
        )
        seconds = time.perf_counter() - began
        yield Found(pair, name, error(found.vertices), found.far, found.quality, seconds)
        motion = found.transform
    placed = template @ motion[:3, :3].T + motion[:3, 3]
    for name, run in baselines(subject).items() if others and pair.kind == "whole" else ():
        began = time.perf_counter()
        moved = run(placed, scan)
        seconds = time.perf_counter() - began
        yield Found(pair, name, error(moved), float("nan"), "", seconds)


def pairs_of(subjects: Iterable[Subject], kinds: list[str]) -> Iterator[Pair]:
    """Yield the pairs of sequences."""
    for subject in subjects:
        for pose, frame in near_and_far(subject).items():
            yield from of_sequence(subject, pose, frame, kinds)


def lines_of(found: list[Found]) -> list[Line]:
    """The table of results: for each method, those of all poses."""
    poses = list(dict.fromkeys(one.pair.pose for one in found))
    rows: dict[tuple[str, ...], dict[str, Found]] = defaultdict(dict)
    for one in found:
        rows[one.pair.subject.name, one.pair.kind, one.method][one.pair.pose] = one
    head = ["sequence", "scan", "method", *(f"error, {pose}" for pose in poses)]
    head += [f"far (%), {pose}" for pose in poses] + [f"quality, {pose}" for pose in poses]
    lines: list[Line] = [(*head, "seconds")]
    for names, by_pose in rows.items():
        ones = [by_pose[pose] for pose in poses]
        cells = [number(one.error) for one in ones]
        cells += [number(100 * one.far) for one in ones] + [one.quality or ABSENT for one in ones]
        lines.append((*names, *cells, number(float(np.mean([one.seconds for one in ones])))))
    return lines


def judged(found: list[Found]) -> list[Line]:
    """The table of how often the quality was right."""
    lines: list[Line] = [("sequence", "right", "of these good", "wrong", "of these good")]
    counts: dict[str, Counter[tuple[bool, bool]]] = defaultdict(Counter)
    for one in found:
        if one.quality and not np.isnan(one.error):
            for name in (one.pair.subject.name, "all"):
                counts[name][one.is_right, one.quality == "good"] += 1
    for name in sorted(counts, key="all".__eq__):
        count = counts[name]
        cells = [count[a, True] + count[a, False] if whole else count[a, True]
                 for a in (True, False) for whole in (True, False)]  # fmt: skip
        lines.append((name, *map(str, cells)))
    return lines


def main() -> None:
    """Measure, and print the tables."""
    made = parser(__doc__)
    made.add_argument("--scans", nargs="+", default=list(SCANS), choices=SCANS)
    made.add_argument("--pairs", type=Path, metavar="FOLDER", help="pairs of files instead")
    made.add_argument("--baselines", action=BooleanOptionalAction, help="also measure others")
    arguments = made.parse_args()
    if arguments.pairs is not None:
        pairs = list(of_folder(arguments.pairs))
    else:
        pairs = list(pairs_of(sequences(arguments), arguments.scans))
    found = [one for pair in progress(pairs, "pairs") for one in measure(pair, arguments.baselines)]
    tables = [Table("registration", lines_of(found)), Table("registration-quality", judged(found))]
    show(arguments, *(table for table in tables if len(table.lines) > 1))


if __name__ == "__main__":
    main()
