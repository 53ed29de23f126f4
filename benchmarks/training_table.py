"""Prints what training changes in the error of method detail, beside other methods, as tables.

    python -m benchmarks.training_table FOLDER [NAME ...]
    python -m benchmarks.training_table FOLDER --whole [NAME ...]
    python -m benchmarks.training_table --learning

FOLDER contains sequences in files NAME.npz; NAME:FRAMES takes the first FRAMES of one. The
training frames are from the first half of each, at most 50, evenly; vertices are lost in the second
half, of which at most the first 50 frames are completed. Some rows show training frames that are of
no use. With --whole, all frames are completed, without training. With --learning, it prints
instead how long completers take to learn 75 frames of an ocean. The first table is a summary of the
second.
"""

import argparse
import time
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from dynmesh import Completer, synth
from dynmesh.study.result_tables import Results, training_summary, training_table
from dynmesh.study.tables import Line, markdown
from dynmesh.study.training_study import halves, training_study

from .methods_table import read


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
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--whole", action="store_true", help="complete all frames of sequences")
    parser.add_argument("--learning", action="store_true", help="measure the time of learning")
    parser.add_argument("names", nargs="*", help="the sequences; the default is all of them")
    arguments = parser.parse_intermixed_args()
    if arguments.learning:
        print(markdown(learning()))
        return
    if arguments.folder is None:
        parser.error("a folder of sequences is needed")
    names = arguments.names or sorted(path.stem for path in arguments.folder.glob("*.npz"))
    subjects = [read(arguments.folder, name) for name in names]
    made: dict[str, Results] = {}
    for subject in subjects:
        parts = (None, subject) if arguments.whole else halves(subject)
        if parts is None:
            parser.error(f"{subject.name}: too few frames for a training sequence")
        training_frames, frames = parts
        title = f"{subject.name}, {frames.n_frames} frames" if arguments.whole else subject.name
        others = [other for other in subjects if other is not subject]
        with Progress(console=Console(stderr=True)) as progress:
            advance = partial(progress.advance, progress.add_task(title, total=1.0))
            made[title] = training_study(
                frames, training_frames, others=others, advance=advance
            ).numbers()
    tables = (training_summary(made), training_table(made))
    print("\n\n".join(markdown(table) for table in tables))


if __name__ == "__main__":
    main()
