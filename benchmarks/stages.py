"""Prints the time of each stage of a frame of method detail, as a table.

    python -m benchmarks.stages

The first 60 frames of the built-in walker are completed in one thread. Each number is the minimum
over all frames in milliseconds, because other programs can only add to it.
"""

import numpy as np

from dynmesh import Completer
from dynmesh.study.losses import SCENARIOS, losses
from dynmesh.study.subjects import built_in
from dynmesh.study.tables import Line

from .harness import Table, parser, progress, show

FRAMES = 60


def main() -> None:
    """Measure, and print the table."""
    arguments = parser(__doc__, folder=False).parse_args()
    walker, _ = built_in(FRAMES)
    lines: list[Line] = [("walker", "factor", "rotations", "the rest")]
    for name, masks in progress(losses(walker, scenarios=("camera",)).items(), "walker"):
        completer = Completer(walker.faces, walker.vertices[0], method="detail")
        rows = []
        for points, mask in zip(walker.vertices[1:], masks[1:], strict=True):
            completer.push(points, mask)
            report = completer.report
            stages = report.factor_seconds, report.rotation_seconds
            rows.append((*stages, report.seconds - sum(stages)))
        title = SCENARIOS.get(name, f"{name} known")
        lines.append((title, *(f"{1e3 * least:.1f}" for least in np.min(rows, axis=0))))
    show(arguments, Table("stages", lines))


if __name__ == "__main__":
    main()
