"""Measures the time to write and to read the same sequence in every file format.

    python -m benchmarks.formats_table [--frames 100] [--repeats 3]

The sequence is the built-in walker (10 002 vertices) in single precision with 30 % of its vertices
known. The table in Markdown shows the median times to write and to read all frames, the size of the
files, and what was read back. The first row is a lower bound: NumPy saves and loads the same bytes
without compression. All files stay in the file cache of the system.
"""

import argparse
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import dynmesh
from dynmesh import files
from dynmesh.study.tables import Line, markdown, median


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    sequence = partial_walker(arguments.frames)
    print(f"{arguments.frames} frames of {sequence.vertices.shape[1]} vertices\n")
    lines: list[Line] = [
        ("format", "write, s", "read, s", "MB", "ms a frame, both", "what came back")
    ]
    with tempfile.TemporaryDirectory() as folder:
        plain = plain_copy(Path(folder), sequence, arguments.repeats)
        lines.append(row(*plain, arguments.frames))
        for name, format in files.formats.items():
            if format.writer is not None:
                result = round_trip(Path(folder), name, sequence, arguments.repeats)
                lines.append(row(name, *result, arguments.frames))
    print(markdown(lines))


def partial_walker(n_frames: int) -> dynmesh.Sequence:
    """Return the walker with NaN for every unknown vertex."""
    walker = dynmesh.synth.walker(n_frames)
    n_vertices = walker.vertices.shape[1]
    known = np.stack(list(dynmesh.degrade.random_known(n_frames, n_vertices, 0.3, seed=0)))
    vertices = np.where(known[..., None], walker.vertices, np.float32(np.nan))
    return dynmesh.Sequence(vertices, walker.faces, known, fps=walker.fps, up_axis=walker.up_axis)


def row(name: str, write: float, read: float, size: int, verdict: str, n_frames: int) -> Line:
    """Return a line of the table."""
    each = 1e3 * (write + read) / n_frames
    return name, f"{write:.2f}", f"{read:.2f}", f"{size / 1e6:.1f}", f"{each:.2f}", verdict


def plain_copy(
    folder: Path, sequence: dynmesh.Sequence, repeats: int
) -> tuple[str, float, float, int, str]:
    """Measure NumPy alone with the same bytes."""
    path = folder / "plain.npz"
    names = ("vertices", "faces", "known")
    write = median_seconds(lambda: save(path, sequence), repeats)
    read = median_seconds(lambda: [np.load(path)[name] for name in names], repeats)
    size = path.stat().st_size
    path.unlink()
    return "*numpy.savez, load*", write, read, size, ""


def save(path: Path, sequence: dynmesh.Sequence) -> None:
    """Save all arrays of a sequence by NumPy."""
    known = np.asarray(sequence.known)
    np.savez(path, vertices=sequence.vertices, faces=sequence.faces, known=known)


def round_trip(
    folder: Path, name: str, sequence: dynmesh.Sequence, repeats: int
) -> tuple[float, float, int, str]:
    """Write and read the sequence in one format."""
    home = folder / name
    home.mkdir()
    suffix = files.formats[name].suffixes[0]
    path = home / (f"frame_%04d{suffix}" if name in ("ply", "obj") else f"walker{suffix}")
    write = median_seconds(lambda: dynmesh.write(path, sequence), repeats)
    read = median_seconds(lambda: read_through(path), repeats)
    size = sum(file.stat().st_size for file in home.rglob("*") if file.is_file())
    verdict = compare(dynmesh.read(path), sequence)
    shutil.rmtree(home)
    return write, read, size, verdict


def read_through(path: Path) -> None:
    """Read all frames, one at a time."""
    with dynmesh.open(path) as reader:
        for _ in reader:
            pass


def compare(again: dynmesh.Sequence, sequence: dynmesh.Sequence) -> str:
    """Describe what was read back."""
    known = np.asarray(sequence.known)
    positions = "equal" if np.array_equal(
        again.vertices, sequence.vertices, equal_nan=True
    ) else "DIFFERENT"  # fmt: skip
    if again.known is None:
        holes = np.isfinite(again.vertices).all(axis=2)
        masks = "holes equal" if np.array_equal(holes, known) else "holes DIFFERENT"
    else:
        masks = "masks equal" if np.array_equal(again.known, known) else "masks DIFFERENT"
    fps = f"{again.fps:g} fps" if again.fps else "no fps"
    return f"positions {positions} in {again.vertices.dtype}, {masks}, {fps}"


def median_seconds(action: Callable[[], object], repeats: int) -> float:
    """Return the median time of an action."""
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        action()
        seconds.append(time.perf_counter() - began)
    return median(seconds)


if __name__ == "__main__":
    main()
