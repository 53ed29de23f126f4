"""Prints how well the standard errors of method detail describe its errors, as a table.

    python -m benchmarks.calibration FOLDER [NAME ...] [--frames N] [--training] [--noise SHARE]

FOLDER contains sequences in files NAME.npz. Vertices are known at random (10 % and 30 %), seen by a
circling camera, or hidden by patches (30 %, each for ten frames). The table shows the shares of the
filled-in vertices whose error is within the intervals of 50 % and of 90 %, the root mean square
error over the root mean square standard error, and the rank correlation of error with standard
error, generation and age, the mean over frames. With --training, the first half of each sequence
is a training sequence for the second. With --noise, the known positions have noise of that share of
the mean edge, which the completer is told.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from dynmesh import degrade
from dynmesh.sequence import Mask
from dynmesh.study.losses import random_masks, scenario_masks
from dynmesh.study.reliability import reliability
from dynmesh.study.subjects import Subject, from_file
from dynmesh.study.tables import Line, markdown
from dynmesh.study.training_study import halves

LIFETIME = 10


def cases(subject: Subject) -> dict[str, list[Mask]]:
    """Return the known masks by the name of the case."""
    patches = degrade.patch_known(
        subject.faces, subject.n_frames, subject.n_vertices, 0.3, lifetime=LIFETIME
    )
    return {
        "10 %": list(random_masks(subject, 0.1)),
        "30 %": list(random_masks(subject, 0.3)),
        "camera": scenario_masks("camera", subject),
        "patches": list(patches),
    }


def mean_edge(subject: Subject) -> float:
    """Return the mean edge length of frame 0."""
    corners = subject.vertices[0][subject.faces]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", help="the sequences; the default is all of them")
    parser.add_argument("--frames", type=int, default=100, help="at most this many, default 100")
    parser.add_argument("--training", action="store_true", help="train the first half")
    parser.add_argument("--noise", type=float, help="in mean edges of frame 0")
    arguments = parser.parse_args()
    names = arguments.names or sorted(path.stem for path in arguments.folder.glob("*.npz"))
    lines: list[Line] = [
        ("sequence", "known", "in 50 %", "in 90 %", "rms ratio", "rank: bars", "generation", "age"),
    ]
    rows: list[tuple[str, list[float]]] = []
    for name in names:
        subject, training_frames = from_file(arguments.folder / f"{name}.npz"), None
        if arguments.training:
            if (parts := halves(subject)) is None:
                parser.error(f"{name} has too few frames to train one half of them")
            training_frames, subject = parts
        subject = replace(subject, vertices=subject.vertices[: arguments.frames])
        noise = arguments.noise and arguments.noise * mean_edge(subject)
        for case, masks in cases(subject).items():
            measured = reliability(subject, masks, training=training_frames, noise=noise)
            if measured is None:
                continue
            found = measured.calibration
            values = [
                found.coverage_50,
                found.coverage_90,
                found.rms_ratio,
                *(
                    np.nan if value is None else value
                    for value in (
                        found.rank_correlation,
                        found.generation_correlation,
                        found.age_correlation,
                    )
                ),
            ]
            rows.append((case, values))
            lines.append((name, case, *(f"{value:.2f}" for value in values)))
    for title, chosen in {
        "mean": ("10 %", "30 %", "camera", "patches"),
        "mean, hidden regions": ("camera", "patches"),
    }.items():
        means = np.nanmean([values for case, values in rows if case in chosen], axis=0)
        lines.append((title, "", *(f"{value:.2f}" for value in means)))
    print(markdown(lines))


if __name__ == "__main__":
    main()
