"""The tables of the page of bad input, which is on the site alone."""

import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from . import (
    commands,
    completer,
    files,
    functions,
    losses,
    scans,
    scenes,
    tracking,
    training,
)
from .case import Case, World, shown

PATH = Path(__file__).parents[3] / "build" / "docs" / "bad_input.md"


class Row(NamedTuple):
    """Formats a row of a table."""

    call: str
    given: str
    answer: str


def prepared(folder: Path) -> World:
    """Creates a world with all files that the cases read."""
    world = World(folder)
    files.prepare(world)
    scenes.prepare(world)
    commands.prepare(world)
    training.prepare(world)
    scans.prepare(world)
    return world


def python_sections() -> dict[str, list[Case]]:
    """The cases that need only the Python package, by the title of their table."""
    return {
        "Python: the completer": completer.cases,
        "Python: the tracker": tracking.cases,
        "Python: streams, topology, measures, baselines, whole frames, pictures": functions.cases,
        "Python: losses and built-in sequences": losses.cases,
        "Python: sequences and files": files.cases,
        "Python: scenes": scenes.cases,
        "Training": training.cases,
        "Scans and tracking": scans.cases,
        "The command dynmesh": commands.shell,
    }


def from_native(programs: Path) -> dict[str, list[Row]]:
    """Runs the cases of the C++ and the C interface, which are part of the C++ tests."""
    command = [programs / "tests" / "cpp" / "dynmesh-bad-input"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    rows: dict[str, list[Row]] = {}
    for line in printed.splitlines():
        interface, *row = line.split("\t")
        rows.setdefault(interface, []).append(Row(*row))
    return rows


def table(title: str, rows: Iterable[Row]) -> str:
    """Formats a section of the page."""
    lines = [f"## {title}", "", "| call | what is wrong | answer |", "|---|---|---|"]
    lines += [f"| `{row.call}` | {row.given} | {_quoted(row.answer)} |" for row in rows]
    return "\n".join(lines) + "\n"


def sections(world: World, programs: Path) -> Iterator[str]:
    """Yields one table at a time."""
    cases = python_sections()
    cases["The program dynmesh-complete"] = commands.compiled(programs)
    for title, some in cases.items():
        yield table(title, [Row(c.call, c.given, shown(c.answer(world))) for c in some])
    for interface, rows in from_native(programs).items():
        yield table(interface, rows)


def page(programs: Path) -> str:
    """Returns all tables, after the number of cases."""
    with tempfile.TemporaryDirectory() as folder:
        body = "\n".join(sections(prepared(Path(folder)), programs))
    count = sum(line.startswith("| `") for line in body.splitlines())
    return f"There are {count} cases.\n\n{body}"


def _quoted(text: str) -> str:
    fence = "``" if "`" in text else "`"
    return f"{fence}{text}{fence}".replace("|", "\\|")
