"""What all benchmarks share: arguments, sequences, progress bars, and tables and their cells."""

import argparse
import csv
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from rich.console import Console
from rich.progress import track

from .subjects import Subject, built_in, from_file

NMSVE_UNIT = 1e-4
"""Tables and figures show NMSVE in this unit, as multiples of 10⁻⁴ bounding-box diagonals of frame
0. Values in the code are in diagonals."""

ABSENT = "-"
"""The cell of a value that could not be measured."""

Line = tuple[str, ...]


def by_row_and_column(corner: str, cells: Mapping[tuple[str, str], str]) -> list[Line]:
    """Return the lines of a table from its cells by row and column, both in order of appearance."""
    columns = list(dict.fromkeys(column for _, column in cells))
    lines: list[Line] = [(corner, *columns)]
    for row in dict.fromkeys(row for row, _ in cells):
        lines.append((row, *(cells.get((row, column), ABSENT) for column in columns)))
    return lines


def number(value: float) -> str:
    """Return a number with three significant digits, or all digits before the decimal point."""
    if np.isnan(value):
        return ABSENT
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def nmsve_cell(diagonals: float) -> str:
    """Return an NMSVE in the unit of all tables, with three significant digits."""
    return ABSENT if np.isnan(diagonals) else f"{diagonals / NMSVE_UNIT:.3g}"


def milliseconds(seconds: float) -> str:
    """Return a time in milliseconds, without the unit."""
    return number(1e3 * seconds)


DOCS = Path(__file__).parents[1] / "docs"

T = TypeVar("T")


class Table(NamedTuple):
    """A table that is printed and stored.

    Attributes:
        name: the name of its CSV file, also in docs/tables if a page shows it.
        lines: the head and the rows.
    """

    name: str
    lines: list[Line]

    def text(self) -> str:
        """Return it in Markdown."""
        rows = [f"| {' | '.join(row)} |" for row in self.lines]
        rows.insert(1, f"|{'---|' * len(self.lines[0])}")
        return "\n".join(rows)


def add_arguments(made: argparse.ArgumentParser, *, folder: bool = True) -> None:
    """Add the arguments that all benchmarks have; with `folder`, those of sequences, too."""
    if folder:
        made.add_argument(
            "folder",
            type=Path,
            nargs="?",
            help="a folder of sequences NAME.npz; the default is the built-in walker and ocean",
        )
        made.add_argument(
            "names",
            nargs="*",
            metavar="NAME[:FRAMES]",
            help="sequences of the folder, or only their first frames; the default is every one",
        )
        made.add_argument("--frames", type=int, help="at most this many of each sequence")
    made.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        default=Path("build/reproduce"),
        help="where each table is written as NAME.csv; the default is build/reproduce",
    )
    made.add_argument("--docs", action="store_true", help="also replace the tables in docs/tables")


def sequences(arguments: argparse.Namespace, frames: int | None = None) -> list[Subject]:
    """Read the sequences that the arguments name, of each at most so many frames or --frames."""
    frames = arguments.frames or frames
    if arguments.folder is None:
        return built_in(frames)
    files = sorted(arguments.folder.glob("*.npz"))
    names = arguments.names or [path.stem for path in files if _holds_sequence(path)]
    if not names:
        raise ValueError(f"{arguments.folder}: contains no sequence in a file *.npz")
    found = []
    for name in names:
        stem, _, first = name.partition(":")
        found.append(from_file(arguments.folder / f"{stem}.npz", int(first) if first else frames))
    return found


def _holds_sequence(path: Path) -> bool:
    """Return whether it is not a recording of scans."""
    with np.load(path) as arrays:
        return "vertices" in arrays


def progress(work: Iterable[T], words: str, total: float | None = None) -> Iterable[T]:
    """Yield work, with a progress bar on standard error."""
    return track(work, words, total, console=Console(stderr=True))


def show(arguments: argparse.Namespace, *tables: Table) -> None:
    """Print tables in Markdown, and write them where the arguments say."""
    print("\n\n".join(table.text() for table in tables))
    for table in tables:
        arguments.out.mkdir(parents=True, exist_ok=True)
        _write_csv(table, arguments.out / f"{table.name}.csv")
        shown = DOCS / "tables" / f"{table.name}.csv"
        if arguments.docs and shown.exists():
            _write_csv(table, shown)


def _write_csv(table: Table, path: Path) -> None:
    """Write a table, without what marks bold text and code."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(
            [re.sub(r"\*\*|`", "", cell) for cell in line] for line in table.lines
        )
