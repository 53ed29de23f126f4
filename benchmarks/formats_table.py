"""Prints the time to write and to read the same sequence in every file format, as a table.

    python -m benchmarks.formats_table [--frames 100] [--repeats 3]

The sequence is the built-in walker (10 002 vertices) in single precision with 30 % of its vertices
known. The table shows the median times to write and to read all frames, and the size of the files.
The first row is a lower bound: NumPy saves and loads the same bytes without
compression. All files stay in the file cache of the system.
"""

import statistics
import tempfile
import timeit
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

import dynmesh
from dynmesh import files
from dynmesh.study.tables import Line

from .harness import Table, parser, progress, show


def partial_walker(n_frames: int) -> dynmesh.Sequence:
    """Return the walker with NaN for every unknown vertex."""
    walker = dynmesh.synth.walker(n_frames)
    n_vertices = walker.vertices.shape[1]
    known = np.stack(list(dynmesh.degrade.random_known(n_frames, n_vertices, 0.3, seed=0)))
    vertices = np.where(known[..., None], walker.vertices, np.float32(np.nan))
    return dynmesh.Sequence(vertices, walker.faces, known, fps=walker.fps, up_axis=walker.up_axis)


def save(path: Path, sequence: dynmesh.Sequence) -> None:
    """Save all arrays of a sequence by NumPy."""
    np.savez(path, sequence.vertices, sequence.faces, np.asarray(sequence.known))


def load(path: Path) -> None:
    """Load what `save` saved."""
    with np.load(path) as arrays:
        for name in arrays:
            arrays[name]


def read_through(path: Path) -> None:
    """Read all frames, one at a time."""
    with dynmesh.open(path) as reader:
        for _ in reader:
            pass


def median_seconds(action: Callable[[], object], repeats: int) -> float:
    """Return the median time of an action."""
    return statistics.median(timeit.repeat(action, number=1, repeat=repeats))


def main() -> None:
    """Measure, and print the table."""
    made = parser(__doc__, folder=False)
    made.add_argument("--frames", type=int, default=100)
    made.add_argument("--repeats", type=int, default=3)
    arguments = made.parse_args()
    sequence = partial_walker(arguments.frames)
    lines: list[Line] = [("format", "write, s", "read, s", "MB", "ms a frame, both")]
    written = [name for name, format in files.formats.items() if format.writer is not None]
    for name in progress(("*numpy.savez, load*", *written), "measuring"):
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            write: Callable[[Path, dynmesh.Sequence], None] = save
            read: Callable[[Path], None] = load
            path = folder / "plain.npz"
            if name in written:
                suffix = files.formats[name].suffixes[0]
                numbered = "frame_%04d" if name in ("ply", "obj") else "walker"
                write, read, path = dynmesh.write, read_through, folder / f"{numbered}{suffix}"
            times = (
                median_seconds(partial(write, path, sequence), arguments.repeats),
                median_seconds(partial(read, path), arguments.repeats),
            )
            size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
        each = 1e3 * sum(times) / arguments.frames
        shown = [f"{seconds:.2f}" for seconds in times]
        lines.append((name, *shown, f"{size / 1e6:.1f}", f"{each:.2f}"))
    show(arguments, Table("format-speed", lines))


if __name__ == "__main__":
    main()
