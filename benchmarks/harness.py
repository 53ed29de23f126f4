"""What all benchmarks share: their arguments, sequences, progress bars and tables."""

import argparse
import csv
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from rich.console import Console
from rich.progress import track

from dynmesh.study.subjects import Subject, built_in, from_file
from dynmesh.study.tables import Line, markdown

DOCS = Path(__file__).parents[1] / "docs"

T = TypeVar("T")


class Table(NamedTuple):
    """A table that is printed and stored.

    Attributes:
        name: the name of its CSV file, also in docs/tables if a page shows it, or of the comment
            on a page that its note belongs below.
        lines: the head and the rows; without any, there is only the note.
        note: sentences below it.
    """

    name: str
    lines: list[Line]
    note: str = ""

    def text(self) -> str:
        """Return it in Markdown."""
        table = markdown(self.lines) if self.lines else ""
        return "\n\n".join(part for part in (table, self.note) if part)


def parser(
    words: str | None,
    *,
    folder: bool = True,
    of: Iterable[str] = (),
    known: Sequence[float] = (),
) -> argparse.ArgumentParser:
    """Return a parser of the arguments that all benchmarks have.

    Args:
        words: the docstring of the benchmark, whose first line describes it.
        folder: whether it measures sequences, of a folder or the built-in ones.
        of: the parts of the benchmark, of which the first argument names one.
        known: the shares of known vertices, if an option can name others.
    """
    made = argparse.ArgumentParser(description=(words or "").partition("\n")[0])
    if of:
        made.add_argument("of", choices=list(of), help="what is measured")
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
    if known:
        made.add_argument("--known", type=float, nargs="+", metavar="SHARE", default=known)
    made.add_argument("--csv", type=Path, metavar="FOLDER", help="also write tables to NAME.csv")
    made.add_argument("--docs", action="store_true", help="also replace the tables in docs/tables")
    return made


def sequences(arguments: argparse.Namespace, frames: int | None = None) -> list[Subject]:
    """Read the sequences that the arguments name, and at most so many frames of each.

    Raises:
        ValueError, OSError: a sequence cannot be read or is not complete, or there is none.
    """
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
    if arguments.csv is not None:
        arguments.csv.mkdir(parents=True, exist_ok=True)
        for table in tables:
            if table.lines:
                write_csv(table, arguments.csv / f"{table.name}.csv")
    if arguments.docs:
        for table in tables:
            replace_in(DOCS, table)


def write_csv(table: Table, path: Path) -> None:
    """Write a table, without what marks bold text and code."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(
            [re.sub(r"\*\*|`", "", cell) for cell in line] for line in table.lines
        )


def replace_in(docs: Path, table: Table) -> None:
    """Replace a table, or else a note, in the documentation, if it is there.

    A table is there if the folder has tables/NAME.csv, and a note if a page has the comments NAME
    and end.

    Raises:
        ValueError: there is more than one place of that name; the pages are unchanged.
    """
    if table.lines:
        path = docs / "tables" / f"{table.name}.csv"
        if path.exists():
            write_csv(table, path)
        return
    name = table.name
    pattern = re.compile(rf"<!-- {re.escape(name)} -->\n.*?<!-- end -->", re.DOTALL)
    pages = {page: page.read_text(encoding="utf-8") for page in sorted(docs.rglob("*.md"))}
    places = [(page, old) for page, whole in pages.items() for old in pattern.findall(whole)]
    if len(places) > 1:
        raise ValueError(f"{docs}: has {len(places)} places for {name}; at most one is possible")
    for page, old in places:
        new = f"<!-- {name} -->\n{table.note}\n<!-- end -->"
        page.write_text(pages[page].replace(old, new), encoding="utf-8")
