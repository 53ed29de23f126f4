"""Times a round trip of the same sequence through every file format.

    python -m benchmarks.formats_table [--frames 100] [--repeats 3]

The sequence is the built-in walker (10 002 vertices) in single precision with 30 % of its vertices
known. Prints a table in Markdown: median times to write and to read all frames, the size on disk,
and what came back. The first row is the least that it could take: the same bytes, saved and loaded
by numpy, uncompressed. Everything goes through the system's file cache.
"""

import argparse
import shutil
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import dynmesh
from dynmesh import files

from .markdown import Line, table


def main() -> None:
    """Prints the table."""
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
    print(table(lines))


def partial_walker(n_frames: int) -> dynmesh.Sequence:
    """The walker with holes, NaN where a vertex is not known."""
    walker = dynmesh.synth.walker(n_frames)
    n_vertices = walker.vertices.shape[1]
    known = np.stack(list(dynmesh.degrade.random_known(n_frames, n_vertices, 0.3, seed=0)))
    vertices = np.where(known[..., None], walker.vertices, np.float32(np.nan))
    return dynmesh.Sequence(vertices, walker.faces, known, fps=walker.fps, up_axis=walker.up_axis)


def row(name: str, write: float, read: float, size: int, verdict: str, n_frames: int) -> Line:
    """A line of the table."""
    each = 1e3 * (write + read) / n_frames
    return name, f"{write:.2f}", f"{read:.2f}", f"{size / 1e6:.1f}", f"{each:.2f}", verdict


def plain_copy(
    folder: Path, sequence: dynmesh.Sequence, repeats: int
) -> tuple[str, float, float, int, str]:
    """The same bytes, by numpy alone."""
    path = folder / "plain.npz"
    assert sequence.known is not None
    arrays = {"vertices": sequence.vertices, "faces": sequence.faces, "known": sequence.known}
    write = median_seconds(lambda: np.savez(path, **arrays), repeats)  # type: ignore[arg-type]
    read = median_seconds(lambda: [np.load(path)[name] for name in arrays], repeats)
    size = path.stat().st_size
    path.unlink()
    return "*numpy.savez, load*", write, read, size, ""


def round_trip(
    folder: Path, name: str, sequence: dynmesh.Sequence, repeats: int
) -> tuple[float, float, int, str]:
    """Writes and reads the sequence in one format."""
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
    """Reads all frames, one at a time."""
    with dynmesh.open(path) as reader:
        for _ in reader:
            pass


def compare(again: dynmesh.Sequence, sequence: dynmesh.Sequence) -> str:
    """What came back, in words."""
    positions = "equal" if np.array_equal(
        again.vertices, sequence.vertices, equal_nan=True
    ) else "DIFFERENT"  # fmt: skip
    if again.known is None:
        holes = np.isfinite(again.vertices).all(axis=2)
        masks = "holes equal" if np.array_equal(holes, sequence.known) else "holes DIFFERENT"  # type: ignore[arg-type]
    else:
        masks = "masks equal" if np.array_equal(again.known, sequence.known) else "masks DIFFERENT"  # type: ignore[arg-type]
    fps = f"{again.fps:g} fps" if again.fps else "no fps"
    return f"positions {positions} in {again.vertices.dtype}, {masks}, {fps}"


def median_seconds(action: Callable[[], object], repeats: int) -> float:
    """The median time of an action."""
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        action()
        seconds.append(time.perf_counter() - began)
    return statistics.median(seconds)


if __name__ == "__main__":
    main()
