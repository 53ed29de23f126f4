"""Prints where the time of a frame of method detail goes, as a table.

    python -m benchmarks.stages

The first 60 frames of the built-in walker, in one thread; each number is the least of all frames
in milliseconds, as what else the machine does can only add to it.
"""

import numpy as np

import dynmesh
from dynmesh.study.measure import Subject
from dynmesh.study.plan import PAPER_SHARES, scenario_masks
from dynmesh.study.style import percent

from .markdown import Line, table

FRAMES = 60


def main() -> None:
    """Measures and prints."""
    walker = Subject.of("walker", dynmesh.synth.walker(), "z", 0, FRAMES)
    losses = {
        f"{percent(share)} known": list(
            dynmesh.degrade.random_known(FRAMES, walker.n_vertices, share)
        )
        for share in PAPER_SHARES
    }
    losses["seen by one camera"] = scenario_masks("camera", walker, 0)
    lines: list[Line] = [("walker", "factor", "rotations", "the rest")]
    for name, masks in losses.items():
        completer = dynmesh.Completer(walker.faces, walker.vertices[0], method="detail")
        rows = []
        for points, mask in zip(walker.vertices[1:], masks[1:], strict=True):
            completer.push(points, mask)
            report = completer.report
            stages = report.factor_seconds, report.rotation_seconds
            rows.append((*stages, report.seconds - sum(stages)))
        lines.append((name, *(f"{1e3 * least:.1f}" for least in np.min(rows, axis=0))))
    print(table(lines))


if __name__ == "__main__":
    main()
