"""Prints what training changes in the error of method detail, beside other methods, as tables.

    python -m benchmarks.training_table FOLDER [NAME ...]
    python -m benchmarks.training_table FOLDER [NAME ...] --whole
    python -m benchmarks.training_table --learning

The training frames are from the first half of each sequence, at most 50, evenly; vertices are lost
in the second half, of which at most the first 50 frames are completed. Some rows show training
frames that are of no use. With --whole, all frames are completed, without training. With
--learning, it prints instead how long completers take to learn 75 frames of an ocean. The first
table is a summary of the second.
"""

import time

import numpy as np

from dynmesh import Completer, synth
from dynmesh.study.measure import Run
from dynmesh.study.methods import DETAIL, MOTION
from dynmesh.study.tables import ABSENT, Line, by_row_and_column, nmsve_cell, number, ratio

from .baselines import BIHARMONIC
from .harness import Table, parser, progress, sequences, show
from .training_study import OFFLINE, TRAINED, Runs, halves, training_study


def training_table(halves: dict[str, Runs]) -> list[Line]:
    """Tabulate errors on the second halves of sequences, by name, relative to that of detail.

    Errors below that of detail are bold. Times are those of a frame, relative to detail. Training
    that is of no use has rows of its own.
    """
    columns = (MOTION.key, BIHARMONIC.key, TRAINED, *OFFLINE)
    lines: list[Line] = [
        ("NMSVE", "known", "detail, x 1e4", "motion", "biharmonic (libigl)",
         "detail, trained", "matrix completion, offline", "with the graph, offline",
         "prior weight", "time, trained", "time, matrix completion", "time, with the graph")
    ]  # fmt: skip
    for name, half in halves.items():
        for loss, runs in half.items():
            detail = runs[DETAIL.key]
            cells = [relative(runs.get(key), detail) for key in columns]
            error = nmsve_cell(detail.nmsve.mean())
            times = [slower(runs.get(key), detail) for key in columns[2:]]
            lines.append((name, loss, error, *cells, prior_weight(runs.get(TRAINED)), *times))
            for key, run in runs.items():
                if key.startswith(f"{TRAINED} on"):
                    cells = ["", "", "", relative(run, detail), "", ""]
                    use = prior_weight(run), slower(run, detail)
                    lines.append((f"{name}, {key}", loss, *cells, *use, "", ""))
    return lines


def training_summary(halves: dict[str, Runs]) -> list[Line]:
    """Tabulate the errors of trained detail, then those of the better matrix completion.

    Both are relative to detail. Losses that were not measured on a sequence have an empty place.
    """
    cells: dict[tuple[str, str], str] = {}
    for kind, keys in ((TRAINED, (TRAINED,)), ("offline", tuple(OFFLINE))):
        for name, half in halves.items():
            for loss, runs in half.items():
                measured = [runs[key] for key in keys if key in runs]
                best = min(measured, key=lambda run: float(run.nmsve.mean()), default=None)
                cells[name, f"{kind}, {loss}"] = relative(best, runs[DETAIL.key])
    return by_row_and_column("", cells)


def prior_weight(run: Run | None) -> str:
    """Return how far a run used the training sequence, from 0 to 1."""
    return ABSENT if run is None else f"{run.prior_weight.mean():.2f}"


def slower(run: Run | None, detail: Run) -> str:
    """Return how many times as long as one of detail a frame takes."""
    return ABSENT if run is None else ratio(*(float(np.median(r.seconds)) for r in (run, detail)))


def relative(run: Run | None, detail: Run) -> str:
    """Return the error of a run relative to that of detail, in bold if it is smaller."""
    if run is None or detail.nmsve.mean() == 0:
        return ABSENT
    value = float(run.nmsve.mean() / detail.nmsve.mean())
    cell = f"{value:.2f}" if value < 10 else number(value)
    return f"**{cell}**" if float(cell) < 1 else cell


def learning() -> list[Line]:
    """Return the processor time that completers of meshes of two sizes take to learn."""
    lines: list[Line] = [("vertices", "without training, s", "with 75 frames, s")]
    for grid in (100, 316):
        ocean = synth.ocean(75, grid=grid)
        seconds = []
        for training in (None, ocean.vertices):
            begun = time.thread_time()
            Completer(ocean.faces, ocean.vertices[0], method="detail", training=training)
            seconds.append(f"{time.thread_time() - begun:.2f}")
        lines.append((str(grid * grid), *seconds))
    return lines


def main() -> None:
    """Measure, and print the tables."""
    made = parser(__doc__)
    made.add_argument("--whole", action="store_true", help="complete all frames of sequences")
    made.add_argument("--learning", action="store_true", help="measure the time of learning")
    arguments = made.parse_args()
    if arguments.learning:
        show(arguments, Table("training-time", learning()))
        return
    subjects = sequences(arguments)
    found: dict[str, Runs] = {}
    for subject in progress(subjects, "measuring"):
        parts = (None, subject) if arguments.whole else halves(subject)
        if parts is None:
            made.error(f"{subject.name}: too few frames for a training sequence")
        training, frames = parts
        title = f"{subject.name}, {frames.n_frames} frames" if arguments.whole else subject.name
        others = [other for other in subjects if other is not subject]
        found[title] = training_study(frames, training, others=others)
    summary, table = training_summary(found), training_table(found)
    if arguments.whole:
        show(arguments, Table("whole", table))
    else:
        show(arguments, Table("training-summary", summary), Table("training", table))


if __name__ == "__main__":
    main()
